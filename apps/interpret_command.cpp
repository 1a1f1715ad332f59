#include "apps/interpret_command.hpp"

#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/node_options.hpp"
#include "apps/output_file.hpp"
#include "apps/path_writer.hpp"
#include "apps/program_options.hpp"
#include "configs/config.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/program_error.hpp"

namespace vcnc {
namespace {

InterpreterOptions interpreter_options(const InterpretOptions& options) {
  InterpreterOptions result;
  result.dialect = dialect_of(options.dialect);
  if (!options.tools.empty()) result.tools = read_tools(options.tools, options.tools_unit);
  result.block_delete = options.block_delete;
  result.bare = options.machine.empty();
  return result;
}

/// A machine without limits: program coordinates are axis positions.
Machine bare_machine() {
  Machine machine;
  for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].limits.start = 0;
  return machine;
}

}  // namespace

int interpret_command(const InterpretOptions& options) {
  const Machine machine = with_program_path(
      options.machine.empty() ? bare_machine() : load_machine(options.machine, options.assignments),
      options.program_path);
  InterpreterOptions wanted = interpreter_options(options);
  if (!options.json.empty()) refuse_foreign_output("--json", options.json, "{\"program\": \"");
  using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
  File file(options.json.empty() ? nullptr : std::fopen(options.json.c_str(), "wb"), &std::fclose);
  if (!options.json.empty() && !file) throw InputError(options.json + ": cannot be written");
  PathWriter writer(file ? file.get() : stdout, options.program, machine);
  try {
    GcodeInterpreter program(options.program, machine, std::move(wanted));
    for (Block block = program.next(); !std::holds_alternative<ProgramEnd>(block);
         block = program.next())
      writer.add(block);
  } catch (const ProgramError& error) {
    writer.end(error.what());
    std::cerr << "vcnc: " << error.what() << '\n';
    return kExitFailure;
  }
  writer.end("");
  const bool failed = std::ferror(file ? file.get() : stdout) != 0;
  if (failed || (file && std::fclose(file.release()) != 0))
    throw InputError((options.json.empty() ? std::string("the terminal") : options.json) +
                     ": cannot be written");
  return kExitOk;
}

}  // namespace vcnc
