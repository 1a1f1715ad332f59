// Assignments of the command line: one a line, beginning with 's' for --set or 'i' for --inject.
#include <vector>

#include "configs/config.hpp"
#include "fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  static const fuzz::MemoryFile* const file = [] {
    auto* machine = new fuzz::MemoryFile;
    machine->hold("name = \"m\"\n[axes.X]\nload_kg = 400\n[effects.X.backlash]\ngap_um = 4\n");
    return machine;
  }();
  std::vector<std::string> set, inject;
  std::string_view rest = fuzz::text_of(data, size);
  while (!rest.empty() && set.size() + inject.size() < 8) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty()) continue;
    (line[0] == 'i' ? inject : set).emplace_back(line.substr(1));
  }
  try {
    const Machine machine = load_machine(file->path(), set, inject);
    const std::string written = to_toml(machine);
    fuzz::require(to_toml(parse_machine(written, "written.toml")) == written);
  } catch (const ConfigError&) {
  }
  return 0;
}
