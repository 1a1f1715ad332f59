// A machine file: what is accepted survives being written and read again, and makes the machines of
// the simulators and of the NC unit.
#include "configs/config.hpp"
#include "fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  try {
    const Machine machine = parse_machine(fuzz::text_of(data, size), "input.toml");
    actual(machine);
    as_nc_believes(machine);
    const std::string written = to_toml(machine);
    fuzz::require(to_toml(parse_machine(written, "written.toml")) == written);
  } catch (const ConfigError&) {
  }
  return 0;
}
