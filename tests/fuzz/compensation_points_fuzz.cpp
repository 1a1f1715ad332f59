// A file of compensation points: what is accepted survives being written as a machine file and read
// again. The first byte chooses the axes and the type of the file.
#include "configs/compensation_file.hpp"
#include "configs/config.hpp"
#include "fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  if (size == 0) return 0;
  Machine machine;
  CompensationTable table;
  table.axis = static_cast<CompensationTable::OfAxis>(data[0] % kAxisCount);
  table.over = static_cast<CompensationTable::OfAxis>(data[0] / kAxisCount % kAxisCount);
  table.file_type =
      data[0] >= 128 ? CompensationTable::FileType::trim : CompensationTable::FileType::actual;
  try {
    parse_compensation_points(fuzz::text_of(data + 1, size - 1), "points.txt", table);
    machine.nc.compensation.tables = {table};
    const std::string written = to_toml(machine);
    fuzz::require(to_toml(parse_machine(written, "written.toml")) == written);
  } catch (const ConfigError&) {
  }
  return 0;
}
