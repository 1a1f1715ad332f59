#include "apps/lockout_command.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "analysis/session.hpp"
#include "apps/launcher.hpp"
#include "apps/lockout_fault.hpp"
#include "apps/lockout_page.hpp"
#include "apps/lockout_processes.hpp"
#include "apps/lockout_report.hpp"
#include "apps/node_options.hpp"
#include "apps/progress_line.hpp"
#include "apps/run_folder.hpp"
#include "apps/stop_signal.hpp"
#include "bus/pacer.hpp"
#include "configs/config.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

constexpr const char* kKinds = R"(kinds of scenarios (key `kind` of a scenario file)
  program_error   the programmed end point lies in the material
  wrong_offset    the piece does not stand where the work offset says
  wrong_length    the stylus is longer than its tool length says
  not_retracted   a rapid runs through the piece
  rotary          the A axis swings the ball and the piece into each other
  spindle_start   M3 with the probe in the spindle
  scan            nothing goes wrong: approach, scan, retract
  program         a program of your own
expected (key `expect`)
  soft_stop       feed hold and retraction, no quick stop
  hard            quick stop of all axes
  trip            one of the two
  safe            refused before anything moves, or a trip
  refused         refused before anything moves
  none            no trip; the program comes to its end
  fault_safe      with faults: a safe stand-still with an alarm that names the cause, or no stop
                  because nothing was driven out of range

faults (key `faults`; all kinds: vcnc faults), with a moment of the run or of the first touch
  faults = ["probe mute from_s=0.8", "drive X deaf at=contact from_s=0.02 for_s=0.005"]
With faults every run is judged by the table below besides what it is expected to do: every axis
truly stands, the spindle was locked or stood by then and stays locked, states are latched, an alarm
names the cause, every cycle is recorded, the axes brake within 6 cycles of the sample that shows
the range left, the deflection stays below the mechanical limit where the feed was checked.

)";

/// The machines that come with vcnc: seen from here, or from where the program is.
std::vector<std::string> shipped_machines() {
  std::vector<fs::path> places{fs::current_path()};
  std::error_code error;
  for (fs::path p = program_directory(); p.has_relative_path(); p = p.parent_path())
    places.push_back(p);
  for (const fs::path& place : places) {
    const fs::path folder = place / "configs/machines";
    if (!fs::exists(folder / "trunnion.toml", error)) continue;
    std::vector<std::string> machines;
    for (const char* file : {"trunnion.toml", "head.toml", "trunnion_measured.toml"})
      machines.push_back((folder / file).string());
    return machines;
  }
  throw InputError("no machine files found; name one or more with --machine FILE");
}

void write_file(const std::string& path, const std::string& text) {
  if (path.empty()) return;
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw InputError(path + ": cannot be written");
}

/// Found out before the runs, not after them.
void check_writable(const std::string& path) {
  if (path.empty()) return;
  const fs::path folder = fs::absolute(path).parent_path();
  if (fs::is_directory(path) || !fs::is_directory(folder))
    throw InputError(path + ": cannot be written");
}

/// One run again, as `vcnc run` leaves it: recording, report, machine, piece, and its program.
LockoutVerdict run_into_folder(const LockoutItem& item, const std::string& out) {
  const LockoutCase the_case = make_case(item.scenario);
  RunFolder folder(out, {item.scenario.machine, item.scenario.program});
  folder.write_inputs(the_case.machine, the_case.piece ? &*the_case.piece : nullptr);
  write_file((folder.path() / "program.ngc").string(), the_case.program);
  write_file((folder.path() / "scenario.toml").string(), to_toml(item.scenario));
  AnalysisSession session({.folder = folder.path()});
  TripLog log;
  const LockoutFolder work;
  LockoutVerdict verdict =
      run_lockout(item.id, item.scenario, {.work_folder = work.path(), .also = &session}, log);
  if (session.summary()) std::cout << to_text(*session.summary()) << '\n';
  return verdict;
}

}  // namespace

int lockout_command(LockoutArguments a) {
  if (a.list) {
    std::cout << kKinds << fault_tolerances_markdown() << "\nall keys of a scenario file\n\n"
              << scenario_key_reference();
    return kExitOk;
  }
  if (!a.out.empty() && a.only.empty())
    throw InputError("--out: needs --only ID, which names the run that is written there");
  for (const std::string& path : {a.json, a.junit, a.html}) check_writable(path);
  if (a.machines.empty()) a.machines = shipped_machines();
  if (a.only.starts_with("process-") && a.processes == 0)
    throw InputError("--only " + a.only + ": needs --processes");
  if (a.only.starts_with("process-") && !a.out.empty())
    throw InputError("--out: only a run in this process leaves a folder, not " + a.only);
  LockoutResults results{.seed = a.seed};
  if (!a.only.starts_with("process-")) results.items = lockout_items(a);
  if (results.items.empty() && a.processes == 0)
    throw InputError("nothing to run: no scenario file and --scenarios 0");
  catch_stop_signals();
  const Pacer clock;
  if (!a.out.empty()) {
    results.verdicts = {run_into_folder(results.items.front(), a.out)};
  } else {
    ProgressLine line;
    const auto show = [&](std::size_t done, std::size_t bad) {
      line.show(fmt::format("{} of {} runs, {} not as expected", done, results.items.size(), bad));
    };
    results.verdicts =
        LockoutRunner{.jobs = a.jobs, .stop = &stop_requested(), .progress = show}.run(
            results.items);
  }
  results.interrupted = results.verdicts.size() < results.items.size();
  if (a.processes > 0) {
    ProgressLine line;
    const ProcessSuite suite{
        .seed = a.seed,
        .runs = a.processes,
        .machines = a.machines,
        .program = program_directory() + "/vcnc",
        .jobs = a.jobs > 0 ? a.jobs : 1,
        .only = a.only,
        .stop = &stop_requested(),
        .progress = [&](std::size_t done, std::size_t bad) {
          line.show(fmt::format("{} of {} runs on real processes, {} not as expected", done,
                                a.processes, bad));
        }};
    std::vector<LockoutVerdict> verdicts = suite.run();
    results.interrupted = results.interrupted || (a.only.empty() && verdicts.size() < a.processes);
    for (LockoutVerdict& verdict : verdicts) results.verdicts.push_back(std::move(verdict));
  }
  results.wall_seconds = clock.elapsed();
  results.summary = summarise(results.verdicts);
  std::cout << lockout_text(results);
  write_file(a.json, lockout_json(results));
  write_file(a.junit, lockout_junit(results));
  if (!a.html.empty()) write_file(a.html, lockout_page(results));
  if (results.interrupted) return kExitInterrupted;
  return results.summary.as_expected == results.summary.runs ? kExitOk : kExitFailure;
}

}  // namespace vcnc
