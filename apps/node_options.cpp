#include "apps/node_options.hpp"

#include <CLI/CLI.hpp>
#include <cstring>
#include <iostream>

#include "model/input_error.hpp"

namespace vcnc {

NodeOptions parse_node_options(int argc, char** argv, const char* description, const char* needs) {
  NodeOptions o;
  CLI::App app{description};
  const auto with = [&](char letter) { return std::strchr(needs, letter) != nullptr; };
  if (with('m')) app.add_option("--machine", o.machine, "machine file")->required();
  if (with('p')) {
    app.add_option("--program", o.program, "G-code program")->required();
    app.add_option("--pace", o.pace, "times real time, 0 = free-running")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--on-power-return", o.on_power_return, "when the mains return")
        ->check(CLI::IsMember({"end", "resume"}));
    app.add_flag("--resume", o.resume, "go on with the interrupted program");
    app.add_option("--operate", o.operations, "what the operator does, e.g. \"at 3.2 s feed 50 %\"")
        ->allow_extra_args(false);
    app.add_flag("--block-delete", o.block_delete, "skip lines that begin with /");
    app.add_option("--dialect", o.dialect, "auto, ngc, fanuc or siemens");
    app.add_option("--from-line", o.from_line, "the program begins there");
    app.add_option("--tools", o.tools, "tool table of LinuxCNC");
    app.add_option("--tools-unit", o.tools_unit, "mm or inch");
  }
  if (with('b')) {
    app.add_option("--bus", o.bus, "hub:///PATH or can://INTERFACE")->required();
    app.add_option("--fault", o.faults, "a fault, e.g. \"probe mute from_s=1.5 for_s=0.005\"")
        ->allow_extra_args(false);
    app.add_option("--answer-timeout-ms", o.answer_timeout_ms,
                   "how long the NC unit waits for a module")
        ->check(CLI::Range(1, 3600000));
  }
  if (with('t')) app.add_option("--truth", o.truth, "path of the ground-truth channel")->required();
  if (with('a'))
    app.add_option("--axis", o.axis, "which drive")
        ->required()
        ->check(CLI::IsMember({"X", "Y", "Z", "A", "C", "spindle"}));
  if (with('o')) {
    app.add_option("--out", o.out, "result directory")->required();
    app.add_flag("--csv", o.csv, "also write rows.csv");
    app.add_flag("--no-report", o.no_report, "no report.html");
  }
  if (with('s')) app.add_option("--seed", o.seed, "seed of all noise");
  if (with('k')) app.add_option("--memory", o.memory, "folder of what the machine keeps");
  if (with('w'))
    app.add_option("--switched-on-at", o.switched_on_at, "axis positions, m and rad")
        ->delimiter(',')
        ->expected(5);
  app.add_option("--control-fd", o.control_fd, "pipe to the launcher");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    std::exit(code == 0 ? kExitOk : kExitBadInput);
  }
  return o;
}

int guarded_main(const char* name, int (*body)(int, char**), int argc, char** argv) {
  try {
    return body(argc, argv);
  } catch (const InputError& e) {
    std::cerr << name << ": " << e.what() << '\n';
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << name << ": " << e.what() << '\n';
    return kExitFailure;
  }
}

}  // namespace vcnc
