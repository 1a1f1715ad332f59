#include "diagnosis/records/map_columns.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "configs/config.hpp"
#include "configs/spelling.hpp"

namespace vcnc {

void MapColumns::refuse(const KeyLines& lines, const std::string& path, std::string_view key,
                        const std::string& reason) const {
  const auto at = lines.find(key);
  const auto whole = lines.find("");
  const int line = at != lines.end() ? at->second : whole != lines.end() ? whole->second : 0;
  throw ConfigError(fmt::format("{}: {}{}: {}",
                                line > 0 ? fmt::format("{}:{}", map_name_, line) : map_name_, path,
                                key, reason));
}

const MeasuredColumn& MapColumns::find(const std::string& name, int number, const KeyLines& lines,
                                       const std::string& path, std::string_view key) const {
  if (number > 0) {
    const auto i = static_cast<std::size_t>(number);
    if (i > table_.columns.size())
      refuse(lines, path, key,
             fmt::format("column {} is not there, {} has {}", number, table_.source,
                         table_.columns.size()));
    return usable(table_.columns[i - 1]);
  }
  const MeasuredColumn* found = nullptr;
  for (const MeasuredColumn& c : table_.columns) {
    if (c.name != name) continue;
    if (found)
      refuse(
          lines, path, key,
          fmt::format("{} has two columns \"{}\"; say which by its number", table_.source, name));
    found = &c;
  }
  if (!found)
    refuse(lines, path, key,
           fmt::format("\"{}\" is no column of {}{}", name, table_.source, suggestion(name)));
  return usable(*found);
}

const MeasuredColumn& MapColumns::usable(const MeasuredColumn& c) const {
  if (c.bad_line > 0) {
    const bool of_digits = c.bad_text.find_first_of("0123456789") != c.bad_text.npos;
    throw MeasurementError(fmt::format(
        "{}:{}: \"{}\" in column \"{}\" is no number; {}", table_.source, c.bad_line, c.bad_text,
        c.name,
        of_digits
            ? "only digits, a sign, one decimal point and an exponent make one"
            : fmt::format("if it means that there is none, say so in the map: missing = [\"{}\"]",
                          c.bad_text)));
  }
  if (c.value.empty()) throw MeasurementError(table_.source + ": holds no rows");
  return c;
}

std::string MapColumns::suggestion(const std::string& name) const {
  const MeasuredColumn* best = nullptr;
  std::size_t least = name.size() / 3 + 1;
  for (const MeasuredColumn& c : table_.columns)
    if (const std::size_t edits = edit_distance(name, c.name); edits < least)
      least = edits, best = &c;
  if (best) return fmt::format("; did you mean \"{}\"?", best->name);
  constexpr std::size_t kMost = 20;
  std::string all;
  for (std::size_t i = 0; i < std::min(kMost, table_.columns.size()); ++i)
    all += (all.empty() ? "" : ", ") + table_.columns[i].name;
  return "; it has " + all + (table_.columns.size() > kMost ? ", ..." : "");
}

}  // namespace vcnc
