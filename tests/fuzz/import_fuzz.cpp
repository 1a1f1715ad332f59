// A map and a text table, with a line of "---" between them.
#include <cmath>

#include "configs/config.hpp"
#include "configs/import_map.hpp"
#include "diagnosis/records/import_table.hpp"
#include "fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  static const Machine machine;
  const std::string_view text = fuzz::text_of(data, size);
  constexpr std::string_view kBetween = "\n---\n";
  const std::size_t at = std::min(text.find(kBetween), text.size());
  const std::string_view rest = text.substr(std::min(at + kBetween.size(), text.size()));
  try {
    const ImportMap map = parse_import_map(text.substr(0, at), "map.toml");
    const TextFormat format{
        .separator = map.separator, .decimal = map.decimal, .missing = map.missing};
    const MeasuredTable table = parse_text_table(rest, "table.csv", format);
    for (const MeasuredColumn& c : table.columns) fuzz::require(c.value.size() == table.rows());
    const Record record = import_table(table, map, "map.toml", &machine);
    fuzz::require(record.period > 0);
    for (const MeasuredSignal& s : record.signals) {
      fuzz::require(s.value.size() == record.samples());
      for (const double v : s.value) fuzz::require(!std::isinf(v));
    }
    for (const Stretch& s : record.stretches)
      fuzz::require(s.begin < s.end && s.end <= record.samples());
  } catch (const InputError&) {
  }
  return 0;
}
