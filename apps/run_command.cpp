#include "apps/run_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "analysis/session.hpp"
#include "apps/faults.hpp"
#include "apps/host_faults.hpp"
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
constexpr int kStopTimeoutMs = 5000;           ///< modules, after the NC unit has ended
constexpr int kResultsTimeoutMs = 300000;      ///< analysis, to write its results
constexpr int kHastyResultsTimeoutMs = 20000;  ///< the same after Ctrl-C

/// The piece of the machine, null where it has none. A piece file whose numbers make no surface is
/// the user's to mend.
std::unique_ptr<PieceParams> piece_of(const Machine& machine) {
  if (machine.setup.piece.empty()) return nullptr;
  auto piece = std::make_unique<PieceParams>(load_piece(machine.setup.piece));
  try {
    make_piece(*piece);
  } catch (const std::invalid_argument& e) {
    throw InputError(machine.setup.piece + ": " + e.what());
  }
  return piece;
}

int run_in_process(const RunOptions& options, const Machine& machine, const PieceParams* piece,
                   const BusFaults& faults, const RunFolder& folder) {
  for (const BusFault& fault : faults)
    if (fault.of_host())
      throw InputError("--fault \"" + fault.text +
                       "\": needs processes; this run has all modules in one");
  VirtualMachine modules(machine, piece, options.seed, faults);
  InprocTransport transport(modules.nodes());
  AnalysisSession session({.folder = folder.path(), .report = options.report, .csv = options.csv});
  ProgressLine progress;
  LiveLine live(session, [&](const std::string& text) { progress.show(text); });
  const NcRunResult result = run_nc(machine,
                                    {.program = options.program,
                                     .pace = options.pace,
                                     .seed = options.seed,
                                     .piece_toml = piece ? to_toml(*piece) : "",
                                     .stop = &stop_requested(),
                                     .faults = faults},
                                    transport, live);
  progress.clear();
  if (session.summary()) std::cout << to_text(*session.summary());
  return result.exit_code();
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A bus that cannot be opened is told before anything is started.
void check_bus(const std::string& uri) {
  try {
    open_transport(uri, kTapId);
  } catch (const BusError& e) {
    throw InputError(std::string("--bus: ") + e.what());
  }
}

/// A private directory for sockets, gone with the run.
class SocketFolder {
 public:
  SocketFolder() {
    std::error_code error;
    const fs::path base = fs::temp_directory_path(error);
    std::string pattern = (base / "vcnc-XXXXXX").string();
    if (error || !::mkdtemp(pattern.data()))
      throw InputError(
          "TMPDIR: no folder can be made in it; it must name a folder one can write to");
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

/// Options that every module on the bus has.
std::vector<std::string> common_options(const RunOptions& options) {
  std::vector<std::string> common{"--answer-timeout-ms",
                                  std::to_string(std::lround(options.answer_timeout_s * 1e3))};
  for (const std::string& fault : options.faults) {
    common.push_back("--fault");
    common.push_back(fault);
  }
  return common;
}

std::vector<std::string> with(std::vector<std::string> argv, const std::vector<std::string>& more) {
  argv.insert(argv.end(), more.begin(), more.end());
  return argv;
}

/// Starts every module and the analysis, and waits until all are ready.
void start_modules(Launcher& launcher, const RunOptions& options, const RunFolder& folder,
                   const std::string& bus, const std::string& truth) {
  const std::string bin = program_directory();
  const std::string machine = folder.machine_file();
  const std::string seed = std::to_string(options.seed);
  const std::vector<std::string> common = common_options(options);
  for (const char* axis : {"X", "Y", "Z", "A", "C", "spindle"})
    launcher.start(fmt::format("drive {}", axis),
                   with({bin + "/vcnc-drive", "--machine", machine, "--bus", bus, "--truth", truth,
                         "--axis", axis, "--seed", seed},
                        common));
  launcher.start("probe", with({bin + "/vcnc-probe", "--machine", machine, "--bus", bus, "--truth",
                                truth, "--seed", seed},
                               common));
  launcher.start("overtravel",
                 with({bin + "/vcnc-overtravel", "--machine", machine, "--bus", bus}, common));
  std::vector<std::string> analysis{bin + "/vcnc-analysis", "--out", folder.path().string()};
  if (options.csv) analysis.push_back("--csv");
  if (!options.report) analysis.push_back("--no-report");
  launcher.start("analysis", analysis);
  launcher.wait_all_ready(kReadyTimeoutMs);
}

struct RunEnded {
  int nc_code = kExitFailure;
  std::string failure;             ///< the cause; what follows from it is not told
  std::vector<std::string> notes;  ///< "drive Y: came to rest ..."
};

/// Shows the progress until every process has ended; sees to it that they do.
class Watch {
 public:
  Watch(Launcher& launcher, const RunFolder& folder, const BusFaults& faults)
      : launcher_(launcher), folder_(folder), host_faults_(faults) {}

  RunEnded until_all_ended() {
    const int step_ms = host_faults_.empty() ? 100 : 5;
    while (launcher_.running() > 0) {
      if (stop_requested() && !told_to_stop_) stop("stopping ...");
      host_faults_.act(launcher_);
      const auto exited = launcher_.next(step_ms, [&](const std::string& text) {
        progress_.show(text);
        host_faults_.note(text);
      });
      if (exited) {
        note(*exited);
      } else if (ending_ && (patience_ms_ -= step_ms) <= 0) {
        if (stop_requested())
          nc_code_ = kExitInterrupted;
        else if (failure_.empty())
          failure_ = "did not end and were killed: " + launcher_.names();
        launcher_.kill_all();
      }
    }
    return {nc_code_.value_or(kExitFailure), !failure_.empty() ? failure_ : consequence_, notes_};
  }

 private:
  void stop(const char* what) {
    told_to_stop_ = ending_ = true;
    patience_ms_ = kStopTimeoutMs;
    progress_.show(what);
    launcher_.signal("NC unit", SIGTERM);
  }

  void note(const Exited& exited) {
    const bool nc = exited.name == "NC unit";
    if (nc) nc_code_ = exited.code;
    for (const std::string& text : exited.notes) notes_.push_back(exited.name + ": " + text);
    const bool dismissed = exited.name == "analysis" && dismissed_;
    const bool expected = exited.code == kExitOk || dismissed ||
                          (nc && (exited.code == kExitAlarm || exited.code == kExitInterrupted));
    if (exited.code == kExitBusGone)
      consequence_ = exited.sentence();
    else if (!expected && failure_.empty())
      failure_ = exited.sentence();

    if (exited.name == "analysis" && !expected && launcher_.running("NC unit"))
      stop("the analysis has died, stopping ...");
    if (exited.code == kExitBusGone && !ending_ && launcher_.running("NC unit"))
      stop("the NC unit gives no SYNC, stopping ...");
    if (exited.name == "analysis" && ending_)  // nobody has anything to write any more
      patience_ms_ = std::min(patience_ms_, kStopTimeoutMs);
    if (!nc) return;
    ending_ = true;
    const bool results_to_write = launcher_.running("analysis") && folder_.has_recording();
    patience_ms_ = !results_to_write  ? kStopTimeoutMs
                   : stop_requested() ? kHastyResultsTimeoutMs
                                      : kResultsTimeoutMs;
    if (results_to_write) return;
    dismissed_ = true;  // the run never began
    launcher_.signal("analysis", SIGTERM);
  }

  Launcher& launcher_;
  const RunFolder& folder_;
  ProgressLine progress_;
  std::optional<int> nc_code_;
  HostFaults host_faults_;
  std::string failure_, consequence_;
  std::vector<std::string> notes_;
  bool told_to_stop_ = false, ending_ = false, dismissed_ = false;
  int patience_ms_ = 0;
};

int run_processes(const RunOptions& options, const BusFaults& faults, const RunFolder& folder) {
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
  if (stop_requested()) return kExitInterrupted;
  launcher.start("NC unit",
                 with({program_directory() + "/vcnc-nc", "--machine", folder.machine_file(),
                       "--program", fs::absolute(options.program).string(), "--bus", bus, "--pace",
                       fmt::format("{}", options.pace), "--seed", std::to_string(options.seed)},
                      common_options(options)));

  const RunEnded ended = Watch(launcher, folder, faults).until_all_ended();
  for (const std::string& note : ended.notes) std::cerr << "vcnc: " << note << '\n';
  folder.write_notes(ended.notes);
  std::cout << text_of(folder.path() / "summary.txt");
  if (ended.failure.empty()) return ended.nc_code;
  std::cerr << "vcnc: " << ended.failure << '\n';
  return kExitFailure;
}

}  // namespace

int run_command(const RunOptions& options) {
  const Machine machine = load_machine(options.machine, options.assignments, options.injections);
  const std::unique_ptr<PieceParams> piece = piece_of(machine);
  Player(options.program,
         as_nc_believes(machine));  // refuses a wrong program before anything is started or written
  const BusFaults faults = parse_faults(options.faults);
  const bool in_process = options.in_process || options.bus == "inproc://";
  if (!in_process && options.bus != "hub://") check_bus(options.bus);
  catch_stop_signals();
  RunFolder folder(options.out, {options.program, options.machine, machine.setup.piece});
  try {
    folder.write_inputs(machine, piece.get());
    const int code = in_process ? run_in_process(options, machine, piece.get(), faults, folder)
                                : run_processes(options, faults, folder);
    folder.remove_if_without_results();
    if (fs::exists(folder.path() / "report.html"))
      std::cout << "report: " << (folder.path() / "report.html").string() << '\n';
    return code;
  } catch (...) {
    folder.remove_if_without_results();
    throw;
  }
}

}  // namespace vcnc
