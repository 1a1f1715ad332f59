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
    const PlayerOptions how = player_options(options.how, program);
    std::string begin;
    if (options.machine.empty()) {
      if (how.from_line > 0) throw InputError("--from-line, --from-block: need --machine");
      InterpreterOptions bare = how.interpreter;
      bare.bare = true;
      GcodeInterpreter interpreter(program, with_program_path(Machine(), options.how.program_path),
                                   bare);
      while (!std::holds_alternative<ProgramEnd>(interpreter.next())) {
      }
    } else {
      const Machine machine = with_program_path(load_machine(options.machine, options.assignments),
                                                options.how.program_path);
      begin = text_of_begin(Player(program, as_nc_believes(machine), how));
    }
    std::cout << program << ": can be run" << (begin.empty() ? "" : ", ") << begin << '\n';
  }
}

}  // namespace vcnc
