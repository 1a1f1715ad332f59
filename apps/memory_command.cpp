#include "apps/memory_command.hpp"

#include <fstream>
#include <iostream>

#include "apps/interrupted_program.hpp"
#include "apps/memory_content.hpp"
#include "apps/program_options.hpp"
#include "model/input_error.hpp"

namespace vcnc {

namespace {

void write_text(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw InputError(path + ": cannot be written");
}

/// The tools kept, as a table.
ToolTable table_of(const NcData& data) {
  ToolTable table;
  for (const auto& [number, tool] : data.tools) table.entry(number) = tool;
  return table;
}

}  // namespace

void memory_command(const MemoryOptions& options) {
  const MemoryFolder memory(options.folder, false);
  try {
    MemoryContent content = read_content(memory);
    SlotFiles files(memory.path(), "data");
    if (options.forget) content.data = {};
    if (!options.read_tools.empty())
      content.data.tools = read_tools(options.read_tools, options.tools_unit).all();
    if (content.data.tools.size() > NcData::kMostTools)
      throw InputError(options.read_tools + ": holds more than 1000 tools");
    if (options.forget || !options.read_tools.empty()) {
      KeptNcData kept = load_nc_data(files);
      kept.now = content.data;
      files.save(encode_nc_data(kept));
    }
    if (!options.write_tools.empty())
      write_text(options.write_tools,
                 table_of(content.data).to_text(options.tools_unit == "inch" ? 25.4e-3 : 1e-3));
    if (!options.write_parameters.empty())
      write_text(options.write_parameters, to_var_file(content.data));
    std::cout << to_text(content);
  } catch (const MemoryError& e) {
    throw InputError(e.what());
  }
}

void reset_command(const std::string& folder) {
  const MemoryFolder memory(folder, false);
  try {
    std::cout << to_text(read_content(memory));
    for (const char* owner : kLatchOwners) SlotFiles(memory.path(), owner).save({});
  } catch (const MemoryError& e) {
    std::cout << e.what() << '\n';
    for (const char* owner : kMemoryOwners) SlotFiles(memory.path(), owner).create();
  }
  std::cout << "reset: nothing is latched any more, no program waits\n";
}

}  // namespace vcnc
