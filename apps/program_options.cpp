#include "apps/program_options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "apps/interrupted_program.hpp"
#include "apps/memory_folder.hpp"
#include "model/input_error.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

long block_number(const std::string& text) {
  const std::string digits = text.substr(!text.empty() && (text[0] == 'N' || text[0] == 'n'));
  long number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || end != digits.data() + digits.size() || number < 0)
    throw InputError(fmt::format("--from-block {}: expected a block number, e.g. N40", text));
  return number;
}

KeptNcData kept_data(const std::string& memory) {
  std::error_code error;
  if (memory.empty() || !fs::exists(fs::path(memory) / "memory.txt", error)) return {};
  try {
    SlotFiles files(memory, "data");
    return load_nc_data(files);
  } catch (const MemoryError& e) {
    throw InputError(e.what());
  }
}

}  // namespace

Machine with_program_path(Machine machine, const std::vector<std::string>& folders) {
  std::string path;
  for (const std::string& folder : folders) {
    std::error_code error;
    if (!fs::is_directory(folder, error))
      throw InputError(fmt::format("--program-path {}: is not a folder", folder));
    if (!path.empty()) path += ':';
    path += fs::absolute(folder).lexically_normal().string();
  }
  if (!path.empty() && !machine.nc.program_path.empty()) path += ':';
  machine.nc.program_path = path + machine.nc.program_path;
  return machine;
}

InterpreterOptions::Dialect dialect_of(const std::string& name) {
  using Dialect = InterpreterOptions::Dialect;
  return name == "ngc"       ? Dialect::ngc
         : name == "fanuc"   ? Dialect::fanuc
         : name == "siemens" ? Dialect::siemens
                             : Dialect::automatic;
}

ToolTable read_tools(const std::string& path, const std::string& unit) {
  return ToolTable::read(path, unit == "inch" ? 25.4e-3 : 1e-3);
}

PlayerOptions player_options(const ProgramChoice& options, const std::string& program) {
  PlayerOptions player;
  if (options.from_line > 0 && !options.from_block.empty())
    throw InputError("--from-line and --from-block: one of them is too many");
  if (options.from_line < 0)
    throw InputError(fmt::format("--from-line {}: expected a line from 1", options.from_line));
  player.from_line = options.from_block.empty()
                         ? options.from_line
                         : line_of_block(program, block_number(options.from_block));
  player.interpreter.block_delete = options.block_delete;
  player.interpreter.dialect = dialect_of(options.dialect);
  KeptNcData kept = kept_data(options.memory);
  player.interpreter.data = std::move(options.resumed ? kept.begin : kept.now);
  if (options.resumed || player.from_line > 0) player.interpreter.touches = std::move(kept.touches);
  if (!options.tools.empty())
    player.interpreter.tools = read_tools(options.tools, options.tools_unit);
  return player;
}

PlayerOptions player_options(const NodeOptions& options) {
  ProgramChoice how;
  how.tools = options.tools;
  how.tools_unit = options.tools_unit;
  how.from_line = options.from_line;
  how.block_delete = options.block_delete;
  how.dialect = options.dialect;
  return player_options(how, options.program);
}

std::string text_of_begin(const Player& player) {
  if (!player.begins_at()) return {};
  return fmt::format("from line {}: {}", player.begins_at()->line, text_of(*player.begins_at()));
}

}  // namespace vcnc
