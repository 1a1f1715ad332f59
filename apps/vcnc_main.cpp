// vcnc: the command that people type.
#include "apps/command_line.hpp"
#include "apps/node_options.hpp"

int main(int argc, char** argv) {
  return vcnc::guarded_main("vcnc", vcnc::command_line, argc, argv);
}
