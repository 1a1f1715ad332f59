#include "apps/command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <memory>

#include "analysis/session.hpp"
#include "apps/check_command.hpp"
#include "apps/commission_command.hpp"
#include "apps/compare_command.hpp"
#include "apps/compensate_command.hpp"
#include "apps/diagnose_command.hpp"
#include "apps/effects_command.hpp"
#include "apps/gallery_command.hpp"
#include "apps/import_command.hpp"
#include "apps/interpret_command.hpp"
#include "apps/lockout_command.hpp"
#include "apps/memory_command.hpp"
#include "apps/node_options.hpp"
#include "apps/objects_command.hpp"
#include "apps/plan_command.hpp"
#include "apps/program_command.hpp"
#include "apps/run_command.hpp"
#include "bus/fault_docs.hpp"
#include "bus/wire_docs.hpp"
#include "configs/config.hpp"
#include "controller/alarms.hpp"

namespace vcnc {
namespace {

/// "free" or a factor of real time.
double parse_pace(const std::string& text) {
  if (text == "free") return 0;
  std::size_t used = 0;
  double pace = 0;
  try {
    pace = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used != text.size() || !(pace >= 0.01 && pace <= 1000))
    throw InputError("--pace " + text + ": expected free or a factor of real time, 0.01 .. 1000");
  return pace;
}

std::uint64_t parse_seed(const std::string& text) {
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError("--seed " + text + ": expected a whole number, 0 .. 18446744073709551615");
  return seed;
}

void add_dialect(CLI::App& command, std::string& dialect) {
  command.add_option("--dialect", dialect, "auto (default), ngc, fanuc or siemens")
      ->check(CLI::IsMember({"auto", "ngc", "fanuc", "siemens"}));
}

/// What run, plan and check say about a program.
void add_program_options(CLI::App& command, ProgramChoice& how) {
  command.add_flag("--block-delete", how.block_delete, "skip lines that begin with /");
  command.add_option("--from-line", how.from_line,
                     "begin at this line of the program, with every mode as if it had been played "
                     "up to there");
  command.add_option("--from-block", how.from_block, "the same for the block N.., e.g. N40");
  command
      .add_option("--program-path", how.program_path,
                  "a folder of subprograms, searched before those of nc.program_path")
      ->allow_extra_args(false);
  command.add_option("--tools", how.tools, "tool table of LinuxCNC, instead of the machine's");
  command.add_option("--tools-unit", how.tools_unit, "unit of its numbers: mm (default) or inch")
      ->check(CLI::IsMember({"mm", "inch"}));
  add_dialect(command, how.dialect);
}

void add_run(CLI::App& app, int& code) {
  struct Arguments : RunOptions {
    std::string pace_text = "free", seed_text = "1";
    bool no_report = false;
  };
  const auto o = std::make_shared<Arguments>();
  CLI::App* run = app.add_subcommand(
      "run", "run a program on the virtual machine and measure its dynamic error");
  run->add_option("PROGRAM", o->program, "G-code program")->required();
  run->add_option("--machine", o->machine, "machine file (TOML)")->required();
  run->add_option("--set", o->assignments,
                  "override a key of the machine file, e.g. axes.Y.velocity_ff=0.9")
      ->allow_extra_args(false);
  run->add_option("--inject", o->injections,
                  "an effect (X.backlash.gap_um=12; see vcnc effects) or the true value of a "
                  "declared number (axes.Y.load_kg=550)")
      ->allow_extra_args(false);
  run->add_option("--fault", o->faults,
                  "a fault, e.g. \"probe mute from_s=1.5 for_s=0.005\" (see vcnc faults)")
      ->allow_extra_args(false);
  run->add_option("--operate", o->operations,
                  "what the operator does, e.g. \"at 3.2 s feed 50 %\", or a file of such lines "
                  "(docs/operating.md)")
      ->allow_extra_args(false);
  add_program_options(*run, o->how);
  run->add_option("--random-faults", o->random_faults,
                  "so many faults of the simulation, drawn from --seed over the program's time")
      ->check(CLI::Range(0, 1000));
  run->add_option("--answer-timeout-s", o->answer_timeout_s,
                  "a module that lets the NC unit wait longer is lost (default 5)")
      ->check(CLI::Range(0.05, 3600.0));
  run->add_option("--bus", o->bus, "hub:// (default), can://INTERFACE or inproc://");
  run->add_option("--pace", o->pace_text, "free (default) or a factor of real time");
  run->add_option("--seed", o->seed_text, "seed of all noise (default 1)");
  run->add_option("--out", o->out, "folder for the results")->required();
  run->add_option("--memory", o->memory,
                  "folder of what the machine keeps while it is off: latches, interrupted program, "
                  "offsets, parameters, tools");
  run->add_option("--on-power-return", o->on_power_return,
                  "when the mains return after a loss: end (default) or resume")
      ->check(CLI::IsMember({"end", "resume"}));
  run->add_flag("--resume", o->resume, "go on with the program that --memory says was interrupted");
  run->add_flag("--in-process", o->in_process, "all modules in this process");
  run->add_flag("--csv", o->csv, "also write every row as rows.csv");
  run->add_flag("--no-report", o->no_report, "no report.html");
  run->callback([o, &code] {
    o->pace = parse_pace(o->pace_text);
    o->seed = parse_seed(o->seed_text);
    o->report = !o->no_report;
    code = run_command(*o);
  });
}

void add_memory(CLI::App& app) {
  const auto folder = std::make_shared<std::string>();
  const auto o = std::make_shared<MemoryOptions>();
  CLI::App* memory =
      app.add_subcommand("memory", "what a machine keeps while it is off (vcnc run --memory)");
  memory->add_option("DIR", o->folder, "folder given as --memory")->required();
  memory->add_option("--write-tools", o->write_tools, "write the tools kept as a tool table");
  memory->add_option("--read-tools", o->read_tools, "keep the tools of a tool table of LinuxCNC");
  memory->add_option("--tools-unit", o->tools_unit, "unit of tool tables: mm (default) or inch")
      ->check(CLI::IsMember({"mm", "inch"}));
  memory->add_option("--write-parameters", o->write_parameters,
                     "write the parameters kept as LinuxCNC's parameter file");
  memory->add_flag("--forget-data", o->forget, "drop offsets, parameters and tools");
  memory->callback([o] { memory_command(*o); });
  CLI::App* reset = app.add_subcommand(
      "reset", "the operator's reset: open every latch, drop an interrupted program");
  reset->add_option("DIR", *folder, "folder given as --memory")->required();
  reset->callback([folder] { reset_command(*folder); });
}

void add_plan(CLI::App& app) {
  const auto o = std::make_shared<PlanOptions>();
  CLI::App* plan = app.add_subcommand(
      "plan", "what the NC unit will command for a program, and how close to the limits it gets");
  plan->add_option("PROGRAM", o->program, "G-code program")->required();
  plan->add_option("--machine", o->machine, "machine file (TOML)")->required();
  plan->add_option("--set", o->assignments, "override a key of the machine file")
      ->allow_extra_args(false);
  plan->add_option("--dynamics", o->dynamics, "smooth or fast, for programs that do not choose");
  plan->add_option("--csv", o->csv, "write every cycle: time, axes, tip, feed, program line");
  plan->add_option("--operate", o->operations,
                   "what the operator does, e.g. \"at 3.2 s feed 50 %\", or a file of such lines")
      ->allow_extra_args(false);
  add_program_options(*plan, o->how);
  plan->add_option("--memory", o->how.memory, "with the offsets, parameters and tools kept there");
  plan->callback([o] { plan_command(*o); });
}

void add_analyze(CLI::App& app) {
  struct Arguments {
    std::string path, out;
    bool csv = false;
  };
  const auto o = std::make_shared<Arguments>();
  CLI::App* analyze_command = app.add_subcommand("analyze", "evaluate a recording again");
  analyze_command->add_option("RUN", o->path, "recording or folder of a run")->required();
  analyze_command->add_option("--out", o->out,
                              "also write summary.json and report.html into this folder");
  analyze_command->add_flag("--csv", o->csv, "with --out: also write every row as rows.csv");
  analyze_command->callback([o] {
    if (o->csv && o->out.empty())
      throw InputError("--csv: needs --out FOLDER to write rows.csv into");
    const auto recording_of = [](const std::string& path) {
      try {
        return std::make_unique<RecordingReader>(path);
      } catch (const RecordingError& e) {
        throw InputError(e.what());
      }
    };
    const auto reader = recording_of(o->path);
    const RecordingReader& recording = *reader;
    for (const std::string& missing : recording.missing())
      std::cerr << "vcnc: " << o->path << ": missing: " << missing << '\n';
    const Summary summary = analyze(recording);
    std::cout << to_text(summary);
    if (!o->out.empty())
      write_results(recording, summary, {.folder = o->out, .report = true, .csv = o->csv});
  });
}

void add_effects(CLI::App& app) {
  const auto o = std::make_shared<EffectsOptions>();
  CLI::App* effects =
      app.add_subcommand("effects", "what a real machine does besides: all effects there are");
  effects->add_flag("--json", o->json, "everything about all of them, for scripts");
  effects->add_flag("--markdown", o->markdown, "the reference page, docs/effects.md");
  effects->add_subcommand("show", "equation, source, signature and parameters of one")
      ->add_option("NAME", o->show, "name of an effect, e.g. backlash")
      ->required();
  effects->callback([o] { effects_command(*o); });
}

void add_gallery(CLI::App& app, int& code) {
  const auto o = std::make_shared<GalleryOptions>();
  CLI::App* gallery =
      app.add_subcommand("gallery", "a page with a figure of what every effect looks like");
  gallery->add_option("--out", o->out, "folder for index.html")->required();
  gallery->add_option("--only", o->only, "only these effects, by name");
  gallery->add_option("--machine", o->machine, "machine file; default: the ideal trunnion");
  gallery->callback([o, &code] { code = gallery_command(*o); });
}

void add_compare(CLI::App& app, int& code) {
  const auto o = std::make_shared<CompareOptions>();
  CLI::App* compare = app.add_subcommand("compare", "two runs side by side");
  compare->add_option("RUN_A", o->a, "recording or folder of a run")->required();
  compare->add_option("RUN_B", o->b, "the run to compare it with")->required();
  compare->add_option("--out", o->out, "also write compare.html with figures into this folder");
  compare->add_flag("--reveal", o->reveal,
                    "also tell which effects, keys and faults of the two runs differ");
  compare->callback([o, &code] { code = compare_command(*o); });
}

void add_compensate(CLI::App& app, int& code) {
  const auto o = std::make_shared<CompensateOptions>();
  CLI::App* compensate = app.add_subcommand(
      "compensate", "set the NC unit's compensation against the effects of a machine");
  compensate->add_option("MACHINE", o->machine, "machine file with effects")->required();
  compensate->add_option("--set", o->assignments, "override a key of the machine file")
      ->allow_extra_args(false);
  compensate->add_option("--inject", o->injections, "a further effect, as in vcnc run")
      ->allow_extra_args(false);
  compensate->add_option("--out", o->out, "machine file to write, with nc.compensation set");
  compensate->add_flag("--measure", o->measure,
                       "run a circle and the S piece before and after, print the dynamic error");
  compensate->callback([o, &code] { code = compensate_command(*o); });
}

void add_import(CLI::App& app) {
  const auto o = std::make_shared<ImportOptions>();
  CLI::App* command =
      app.add_subcommand("import", "a table of a real machine (CSV, HDF5) as a record to diagnose");
  command->add_option("TABLE", o->table, "what was measured");
  command->add_option("--map", o->map, "what its columns are (TOML)");
  command->add_option("--out", o->out, "record to write");
  command->add_flag("--keys", o->keys, "show the keys of a map, as Markdown");
  command->callback([o] { import_command(*o); });
}  // namespace

void add_diagnose(CLI::App& app, int& code) {
  const auto o = std::make_shared<DiagnoseOptions>();
  CLI::App* diagnose =
      app.add_subcommand("diagnose", "why a measured machine is not as its file declares");
  diagnose
      ->add_option("RUN", o->run,
                   "recording or folder of a run, imported record, or table with --map")
      ->required();
  diagnose->add_option("--model", o->model,
                       "declared machine file (default: the one the run was made with)");
  diagnose->add_option("--map", o->map, "what the columns of tables are (see vcnc import)");
  diagnose->add_option("--reference", o->reference,
                       "the same program when the machine was healthy");
  diagnose
      ->add_option("--suspect", o->suspects,
                   "seek nothing but this effect (backlash, X.backlash) or declared number "
                   "(axes.X.load_kg); may be told several times")
      ->allow_extra_args(false);
  diagnose->add_option("--without", o->without,
                       "an effect the library is to be without: what it makes then has no name");
  diagnose->add_option("--test", o->tests, "a run to be predicted, not fitted")
      ->allow_extra_args(false);
  diagnose->add_option("--out", o->out, "folder for diagnosis.json, found.toml and report.html");
  diagnose->add_option("--compare-only", o->compare,
                       "machine file: only tell how well the two machines predict the run");
  diagnose->callback([o, &code] { code = diagnose_command(*o); });
}

void add_commission(CLI::App& app, int& code) {
  const auto o = std::make_shared<CommissionOptions>();
  CLI::App* commission =
      app.add_subcommand("commission", "fit a declared machine to a run of the healthy one");
  commission->add_option("RUN", o->run, "as of vcnc diagnose")->required();
  commission->add_option("--model", o->model,
                         "declared machine file (default: the one the run was made with)");
  commission->add_option("--map", o->map, "what the columns of a table are (see vcnc import)");
  commission->add_option("--out", o->out, "machine file to write")->required();
  commission->callback([o, &code] { code = commission_command(*o); });
}

void add_lockout(CLI::App& app, int& code) {
  struct Arguments : LockoutArguments {
    std::string seed_text = "1";
    std::int64_t scenarios = 500;
  };
  const auto o = std::make_shared<Arguments>();
  CLI::App* lockout = app.add_subcommand(
      "lockout", "crash the probe many times and see that the overtravel protection holds");
  CLI::Option* files = lockout->add_option("SCENARIO", o->files, "scenario files (TOML)");
  lockout->add_option("--seed", o->seed_text, "seed of the drawn scenarios (default 1)");
  CLI::Option* count =
      lockout
          ->add_option(
              "--scenarios", o->scenarios,
              "drawn crashes, as many ordinary runs, and as many crashes with a fault besides "
              "(default 500; 0 where files are given)")
          ->check(CLI::Range(0, 10'000'000));
  CLI::Option* processes =
      lockout
          ->add_option("--processes", o->processes,
                       "runs on real processes, one of which is killed, stopped or restarted "
                       "(default 0; without --scenarios these alone)")
          ->check(CLI::Range(0, 1'000'000));
  lockout->add_option("--machine", o->machines, "machine files to draw from (default: the shipped)")
      ->allow_extra_args(false);
  lockout->add_option("--jobs", o->jobs, "threads (default: one per processor)")
      ->check(CLI::Range(1, 1024));
  lockout->add_option("--only", o->only,
                      "this run alone: crash-N, ordinary-N, faulted-N, process-N or a file's name");
  lockout->add_option("--out", o->out, "with --only: folder for its recording and report");
  lockout->add_option("--json", o->json, "write all results as JSON");
  lockout->add_option("--junit", o->junit, "write all results as JUnit XML");
  lockout->add_option("--html", o->html, "write a page with distributions and example trips");
  lockout->add_flag("--list", o->list, "show the kinds and keys of scenarios");
  lockout->callback([o, files, count, processes, &code] {
    o->seed = parse_seed(o->seed_text);
    o->crashes = o->ordinary = o->faulted =
        (*files || *processes) && !*count ? 0 : static_cast<std::uint64_t>(o->scenarios);
    code = lockout_command(*o);
  });
}

void add_interpret(CLI::App& app, int& code) {
  const auto o = std::make_shared<InterpretOptions>();
  CLI::App* interpret = app.add_subcommand("interpret", "the path a program describes, as JSON");
  interpret->add_option("PROGRAM", o->program, "G-code program")->required();
  interpret->add_option("--json", o->json, "file to write (default: the terminal)");
  interpret->add_option("--machine", o->machine, "machine file; without it: no machine at all");
  interpret->add_option("--set", o->assignments, "override a key of the machine file")
      ->allow_extra_args(false);
  interpret->add_option("--tools", o->tools, "tool table of LinuxCNC, instead of the machine's");
  interpret->add_option("--tools-unit", o->tools_unit, "unit of its numbers: mm (default) or inch")
      ->check(CLI::IsMember({"mm", "inch"}));
  add_dialect(*interpret, o->dialect);
  interpret
      ->add_option("--program-path", o->program_path,
                   "a folder of subprograms, searched after the program's own")
      ->allow_extra_args(false);
  interpret->add_flag("--block-delete", o->block_delete, "skip lines that begin with /");
  interpret->callback([o, &code] { code = interpret_command(*o); });
}

void add_check(CLI::App& app) {
  const auto o = std::make_shared<CheckOptions>();
  CLI::App* check = app.add_subcommand("check", "can the machine run these programs?");
  check->add_option("PROGRAM", o->programs, "G-code programs")->required();
  check->add_option("--machine", o->machine, "machine file; default: only the language is checked");
  check->add_option("--set", o->assignments, "override a key of the machine file")
      ->allow_extra_args(false);
  add_program_options(*check, o->how);
  check->add_option("--memory", o->how.memory, "with the offsets, parameters and tools kept there");
  check->callback([o] { check_command(*o); });
}

void add_references(CLI::App& app) {
  app.add_subcommand("alarms", "all alarms with cause and remedy, as Markdown")->callback([] {
    std::cout << alarms_markdown();
  });
  app.add_subcommand("keys", "all keys of machine and piece files, as Markdown")->callback([] {
    std::cout << "# Keys of a machine file\n\n"
              << machine_key_reference() << "\n# Keys of a piece file\n\n"
              << piece_key_reference();
  });
  app.add_subcommand("faults", "all kinds of faults and how they are written, as Markdown")
      ->callback([] { std::cout << faults_markdown(); });
  app.add_subcommand("wire", "all messages on the bus, as Markdown")->callback([] {
    std::cout << wire_table_markdown();
  });
  app.add_subcommand("objects", "the CANopen object dictionaries of the modules, as Markdown")
      ->callback([] { std::cout << objects_page(); });
  struct Arguments {
    std::string node, machine;
  };
  const auto o = std::make_shared<Arguments>();
  CLI::App* eds = app.add_subcommand("eds", "the electronic data sheet of a module (CiA 306)");
  eds->add_option("NODE", o->node, "\"drive X\", probe, ... or its node id")->required();
  eds->add_option("--machine", o->machine, "machine file; default: one without entries");
  eds->callback([o] { std::cout << data_sheet(o->node, o->machine); });
  app.add_subcommand("dbc", "all messages on the bus, as a DBC file for CAN tools")->callback([] {
    std::cout << dbc();
  });
}

/// A value that is there but empty (--out "") is a slip, most often of a shell variable.
void refuse_empty_values(CLI::App& app) {
  const auto not_empty = [](const std::string& value) {
    return value.empty() ? std::string("needs a value, \"\" is none") : std::string();
  };
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() > 0) option->check(not_empty);
  for (CLI::App* sub : app.get_subcommands({})) refuse_empty_values(*sub);
}

}  // namespace

int command_line(int argc, char** argv) {
  CLI::App app{"vcnc: a virtual five-axis CNC machine that behaves like a measured one"};
  app.set_version_flag("--version", VCNC_VERSION);
  app.require_subcommand(1);
  int code = kExitOk;
  add_run(app, code);
  add_memory(app);
  add_plan(app);
  add_analyze(app);
  add_gallery(app, code);
  add_compare(app, code);
  add_compensate(app, code);
  add_import(app);
  add_diagnose(app, code);
  add_commission(app, code);
  add_program_command(app);
  add_interpret(app, code);
  add_check(app);
  add_effects(app);
  add_lockout(app, code);
  add_references(app);
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    code = app.exit(e) == 0 ? kExitOk : kExitBadInput;
  }
  if (!std::cout.flush()) throw std::runtime_error("standard output: cannot be written");
  return code;
}

}  // namespace vcnc
