#include "apps/check_command.hpp"

#include <iostream>

#include "configs/config.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/player.hpp"

namespace vcnc {

void check_command(const CheckOptions& options) {
  if (options.machine.empty() && !options.assignments.empty())
    throw InputError("vcnc check: --set needs --machine");
  for (const std::string& program : options.programs) {
    if (options.machine.empty()) {
      GcodeInterpreter interpreter(program, Machine(), {.tools = {}, .bare = true});
      while (!std::holds_alternative<ProgramEnd>(interpreter.next())) {
      }
    } else {
      Player(program, as_nc_believes(load_machine(options.machine, options.assignments)));
    }
    std::cout << program << ": can be run\n";
  }
}

}  // namespace vcnc
