#include "apps/run_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "analysis/session.hpp"
#include "apps/launcher.hpp"
#include "apps/live_line.hpp"
#include "apps/nc_run.hpp"
#include "apps/node_options.hpp"
#include "apps/progress_line.hpp"
#include "apps/run_folder.hpp"
#include "apps/stop_signal.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/hub.hpp"
#include "bus/inproc.hpp"
#include "configs/config.hpp"
#include "controller/player.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

constexpr int kReadyTimeoutMs = 20000;
constexpr int kStopTimeoutMs = 5000;       ///< modules, after the NC unit has ended
constexpr int kResultsTimeoutMs = 300000;  ///< analysis, to write its results

int run_in_process(const RunOptions& options, const Machine& machine, const RunFolder& folder) {
  std::unique_ptr<PieceParams> piece;
  if (!machine.setup.piece.empty())
    piece = std::make_unique<PieceParams>(load_piece(machine.setup.piece));
  VirtualMachine modules(machine, piece.get(), options.seed);
  InprocTransport transport(modules.nodes());
  AnalysisSession session({.folder = folder.path(), .report = options.report, .csv = options.csv});
  ProgressLine progress;
  LiveLine live(session, [&](const std::string& text) { progress.show(text); });
  const NcRunResult result = run_nc(machine,
                                    {.program = options.program,
                                     .pace = options.pace,
                                     .seed = options.seed,
                                     .piece_toml = piece ? to_toml(*piece) : "",
                                     .stop = &stop_requested()},
                                    transport, live);
  progress.clear();
  if (session.summary()) std::cout << to_text(*session.summary());
  return result.exit_code();
}

/// A piece file whose numbers make no surface is the user's to mend.
void check_piece(const std::string& path) {
  try {
    make_piece(load_piece(path));
  } catch (const std::invalid_argument& e) {
    throw InputError(path + ": " + e.what());
  }
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A private directory for sockets, gone with the run.
class SocketFolder {
 public:
  SocketFolder() {
    std::string pattern = (fs::temp_directory_path() / "vcnc-XXXXXX").string();
    if (!::mkdtemp(pattern.data()))
      throw LaunchError("no temporary directory can be made in " +
                        fs::temp_directory_path().string());
    path_ = pattern;
  }
  ~SocketFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

/// Starts every module and the analysis, and waits until all are ready.
void start_modules(Launcher& launcher, const RunOptions& options, const RunFolder& folder,
                   const std::string& bus, const std::string& truth) {
  const std::string bin = program_directory();
  const std::string machine = folder.machine_file();
  const std::string seed = std::to_string(options.seed);
  for (const char* axis : {"X", "Y", "Z", "A", "C", "spindle"})
    launcher.start(fmt::format("drive {}", axis), {bin + "/vcnc-drive", "--machine", machine,
                                                   "--bus", bus, "--truth", truth, "--axis", axis});
  launcher.start("probe", {bin + "/vcnc-probe", "--machine", machine, "--bus", bus, "--truth",
                           truth, "--seed", seed});
  launcher.start("overtravel", {bin + "/vcnc-overtravel", "--machine", machine, "--bus", bus});
  std::vector<std::string> analysis{bin + "/vcnc-analysis", "--out", folder.path().string()};
  if (options.csv) analysis.push_back("--csv");
  if (!options.report) analysis.push_back("--no-report");
  launcher.start("analysis", analysis);
  launcher.wait_all_ready(kReadyTimeoutMs);
}

struct RunEnded {
  int nc_code = kExitFailure;
  std::string failure;  ///< the first one; what follows from it is not told
};

/// Shows the progress until every process has ended; sees to it that they do.
RunEnded watch(Launcher& launcher) {
  constexpr int kStepMs = 100;
  ProgressLine progress;
  RunEnded ended;
  bool told_to_stop = false, ending = false;
  int patience_ms = 0;
  while (launcher.running() > 0) {
    if (stop_requested() && !told_to_stop) {
      told_to_stop = true;
      progress.show("stopping ...");
      launcher.signal("NC unit", SIGTERM);
    }
    const auto exited =
        launcher.next(kStepMs, [&](const std::string& text) { progress.show(text); });
    if (exited) {
      const bool nc = exited->name == "NC unit";
      if (nc) ended.nc_code = exited->code;
      const bool expected = exited->code == kExitOk || (nc && exited->last_words.empty());
      if (!expected && ended.failure.empty()) ended.failure = exited->sentence();
      const bool analysis_died = exited->name == "analysis" && launcher.running("NC unit");
      if (analysis_died) launcher.signal("NC unit", SIGTERM);
      ending = ending || nc || analysis_died;
      patience_ms = launcher.running("analysis") ? kResultsTimeoutMs : kStopTimeoutMs;
    } else if (ending && (patience_ms -= kStepMs) <= 0) {
      if (ended.failure.empty())
        ended.failure = "modules still ran after the end of the run and were killed";
      launcher.kill_all();
    }
  }
  return ended;
}

int run_processes(const RunOptions& options, const RunFolder& folder) {
  SocketFolder sockets;
  std::string bus = options.bus;
  std::unique_ptr<Hub> hub;
  if (bus == "hub://") {
    bus = "hub://" + sockets.file("bus");
    hub = std::make_unique<Hub>(sockets.file("bus"));
  }
  // Runs of the same machine side by side must not hear each other.
  ::setenv("VCNC_DDS_TAG", fmt::format("vcnc-{}", ::getpid()).c_str(), 0);

  Launcher launcher;
  start_modules(launcher, options, folder, bus, sockets.file("truth"));
  launcher.start("NC unit",
                 {program_directory() + "/vcnc-nc", "--machine", folder.machine_file(), "--program",
                  fs::absolute(options.program).string(), "--bus", bus, "--pace",
                  fmt::format("{}", options.pace), "--seed", std::to_string(options.seed)});

  const RunEnded ended = watch(launcher);
  std::cout << text_of(folder.path() / "summary.txt");
  if (ended.failure.empty()) return ended.nc_code;
  std::cerr << "vcnc: " << ended.failure << '\n';
  return kExitFailure;
}

}  // namespace

int run_command(const RunOptions& options) {
  const Machine machine = load_machine(options.machine, options.assignments);
  if (!machine.setup.piece.empty()) check_piece(machine.setup.piece);
  Player(options.program,
         machine);  // refuses a wrong program before anything is started or written
  const bool in_process = options.in_process || options.bus == "inproc://";
  catch_stop_signals();
  RunFolder folder(options.out);
  folder.write_inputs(machine);
  try {
    const int code =
        in_process ? run_in_process(options, machine, folder) : run_processes(options, folder);
    if (fs::exists(folder.path() / "report.html"))
      std::cout << "report: " << (folder.path() / "report.html").string() << '\n';
    return code;
  } catch (...) {
    folder.remove_if_without_results();
    throw;
  }
}

}  // namespace vcnc
