// `vcnc program`: writes test programs.
#pragma once

namespace CLI {
class App;
}

namespace vcnc {

void add_program_command(CLI::App& app);

}  // namespace vcnc
