#include "apps/run_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>

#include "analysis/session.hpp"
#include "apps/fault_draw.hpp"
#include "apps/faults.hpp"
#include "apps/host_faults.hpp"
#include "apps/interrupted_program.hpp"
#include "apps/launcher.hpp"
#include "apps/live_line.hpp"
#include "apps/memory_content.hpp"
#include "apps/nc_run.hpp"
#include "apps/node_options.hpp"
#include "apps/operations.hpp"
#include "apps/progress_line.hpp"
#include "apps/run_folder.hpp"
#include "apps/stop_signal.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/hub.hpp"
#include "bus/inproc.hpp"
#include "configs/config.hpp"
#include "configs/idle_effects.hpp"
#include "controller/player.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

constexpr int kLeastReadyTimeoutMs = 5000;
constexpr int kStopTimeoutMs = 5000;           ///< modules, after the NC unit has ended
constexpr int kNcAgainMs = 1000;               ///< an NC unit that was started again
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

OnPowerReturn on_power_return(const RunOptions& options) {
  return options.on_power_return == "resume" ? OnPowerReturn::resume : OnPowerReturn::end;
}

/// A run with a memory: the folder, and what it says about where this run begins.
struct Continuation {
  std::optional<MemoryFolder> folder;
  std::vector<double> switched_on_at;  ///< empty: where the machine file says
};

/// Opens the memory, and sees that this program may start with what it holds.
Continuation open_memory(const RunOptions& options, const Machine& machine,
                         const PieceParams* piece) {
  Continuation start;
  if (options.memory.empty()) {
    if (options.resume) throw InputError("--resume: needs --memory DIR of the interrupted run");
    return start;
  }
  start.folder.emplace(options.memory, !options.resume);
  try {
    const MemoryContent content = read_content(*start.folder);
    if (!options.resume) {
      check_fresh(content.nc, options.memory);
      return start;
    }
    check_resume(content.nc,
                 identity_of(machine, piece ? to_toml(*piece) : "", options.program,
                             player_options(options.how, options.program)),
                 options.memory);
    const Machine believed = as_nc_believes(machine);
    const AxisVector position = position_at_switch_on(believed, *content.nc);
    start.switched_on_at.assign(position.begin(), position.end());
    if (driven_off_by_hand(believed, *content.nc))
      std::cout
          << "the probe still touched when the supply was exhausted; it is taken to have been "
             "driven off by hand\n";
  } catch (const MemoryError& e) {
    throw InputError(e.what());
  }
  return start;
}

/// A fault that never had an effect is told: it may be a slip of the pen.
void warn(const std::vector<std::string>& never) {
  for (const std::string& fault : never)
    std::cerr << "vcnc: warning: --fault \"" << fault
              << "\": had no effect; the run was over before, or no such frame was sent\n";
}

void warn_not_operated(const std::vector<std::string>& never) {
  for (const std::string& text : never)
    std::cerr << "vcnc: warning: --operate \"" << text << "\": there was no occasion for it\n";
}

/// Drawn over the time that the program takes; written as --fault takes them.
std::vector<std::string> drawn_faults(const RunOptions& options, Player& player) {
  Tick cycles = 0;
  while (!player.step().done) ++cycles;
  std::vector<std::string> texts;
  const FaultDraw draw(options.seed);
  for (int i = 0; i < options.random_faults; ++i)
    texts.push_back(draw.any(static_cast<std::uint64_t>(i), 0, cycles).text);
  return texts;
}

int run_in_process(const RunOptions& options, const Machine& machine, const PieceParams* piece,
                   const BusFaults& faults, const RunFolder& folder, const Continuation& start) {
  for (const BusFault& fault : faults)
    if (fault.of_host())
      throw InputError("--fault \"" + fault.text +
                       "\": needs processes; this run has all modules in one");
  SlotFiles nc(options.memory, "nc"), data(options.memory, "data"),
      spindle(options.memory, "spindle"), overtravel(options.memory, "overtravel");
  const auto kept = [&](SlotFiles& files) { return start.folder ? &files : nullptr; };
  VirtualMachine modules(switched_on_at(machine, start.switched_on_at), piece, options.seed, faults,
                         {kept(spindle), kept(overtravel)});
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
                                     .faults = faults,
                                     .memory = kept(nc),
                                     .data = kept(data),
                                     .on_power_return = on_power_return(options),
                                     .resume = options.resume,
                                     .operations = read_operations(options.operations),
                                     .player = player_options(options.how, options.program)},
                                    transport, live);
  progress.clear();
  std::vector<std::string> struck = modules.struck();
  struck.insert(struck.end(), result.struck.begin(), result.struck.end());
  warn(never_struck(faults, struck));
  warn_not_operated(result.never_operated);
  if (session.summary()) std::cout << to_text(*session.summary());
  return result.exit_code();
}

std::string file_text(const fs::path& path) {
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
                   const Continuation& start, const std::string& bus, const std::string& truth,
                   HostFaults& host_faults) {
  const std::string bin = program_directory();
  const std::string machine = folder.machine_file();
  const std::string seed = std::to_string(options.seed);
  const std::vector<std::string> common = common_options(options);
  std::vector<std::string> kept, standing;
  if (start.folder) kept = {"--memory", start.folder->path()};
  if (!start.switched_on_at.empty())
    standing = {fmt::format("--switched-on-at={:a}", fmt::join(start.switched_on_at, ","))};
  for (const char* axis : {"X", "Y", "Z", "A", "C", "spindle"})
    launcher.start(fmt::format("drive {}", axis),
                   with({bin + "/vcnc-drive", "--machine", machine, "--bus", bus, "--truth", truth,
                         "--axis", axis, "--seed", seed},
                        with(with(common, kept), standing)));
  launcher.start("probe", with({bin + "/vcnc-probe", "--machine", machine, "--bus", bus, "--truth",
                                truth, "--seed", seed},
                               with(common, standing)));
  launcher.start("overtravel", with({bin + "/vcnc-overtravel", "--machine", machine, "--bus", bus},
                                    with(common, kept)));
  std::vector<std::string> analysis{bin + "/vcnc-analysis", "--out", folder.path().string()};
  if (options.csv) analysis.push_back("--csv");
  if (!options.report) analysis.push_back("--no-report");
  launcher.start("analysis", analysis);
  const int patience_ms = static_cast<int>(std::lround(options.answer_timeout_s * 4e3));
  launcher.wait_all_ready(
      std::max(patience_ms, kLeastReadyTimeoutMs),
      host_faults.empty() ? std::function<void()>() : [&] { host_faults.act(launcher); });
}

struct RunEnded {
  int nc_code = kExitFailure;
  std::string failure;              ///< the cause; what follows from it is not told
  std::vector<std::string> notes;   ///< "drive Y: came to rest ..."
  std::vector<std::string> struck;  ///< faults that have had an effect
};

/// Shows the progress until every process has ended; sees to it that they do.
class Watch {
 public:
  /// `answer_timeout_s` is the NC unit's with a module; twice that is a module's with the NC unit.
  Watch(Launcher& launcher, const RunFolder& folder, HostFaults& host_faults,
        double answer_timeout_s)
      : launcher_(launcher),
        folder_(folder),
        host_faults_(host_faults),
        nc_patience_ms_(static_cast<int>(std::lround(answer_timeout_s * 3e3))) {}

  RunEnded until_all_ended() {
    const int step_ms = host_faults_.empty() ? 100 : 5;
    while (launcher_.running() > 0) {
      if (stop_requested() && !told_to_stop_) stop("stopping ...");
      host_faults_.act(launcher_);
      if (ending_) launcher_.kill_stopped("analysis");  // whose stall may pass
      watch_nc_unit(step_ms);
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
    return {nc_code_.value_or(kExitFailure), !failure_.empty() ? failure_ : consequence_, notes_,
            struck_};
  }

 private:
  /// Modules that wait for the first SYNC wait for ever; only from outside can be seen that the NC
  /// unit is stopped.
  void watch_nc_unit(int step_ms) {
    nc_stopped_ms_ = !ending_ && launcher_.stopped("NC unit") ? nc_stopped_ms_ + step_ms : 0;
    if (nc_stopped_ms_ > nc_patience_ms_) stop("the NC unit is stopped, ending ...");
    // Started again, it finds no module: they have left with the bus.
    nc_again_ms_ = nc_code_ && launcher_.running("NC unit") ? nc_again_ms_ + step_ms : 0;
    if (nc_again_ms_ > kNcAgainMs) launcher_.signal("NC unit", SIGKILL);
  }

  void stop(const char* what) {
    told_to_stop_ = ending_ = true;
    patience_ms_ = kStopTimeoutMs;
    progress_.show(what);
    launcher_.signal("NC unit", SIGTERM);
  }

  void note(const Exited& exited) {
    const bool nc = exited.name == "NC unit";
    if (nc && !nc_code_) nc_code_ = exited.code;  // one that was started again leads no run
    struck_.insert(struck_.end(), exited.struck.begin(), exited.struck.end());
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
  HostFaults& host_faults_;
  std::string failure_, consequence_;
  std::vector<std::string> notes_, struck_;
  bool told_to_stop_ = false, ending_ = false, dismissed_ = false;
  int patience_ms_ = 0;
  int nc_stopped_ms_ = 0, nc_again_ms_ = 0;
  const int nc_patience_ms_;
};

int run_processes(const RunOptions& options, const BusFaults& faults, const RunFolder& folder,
                  const Continuation& start) {
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
  HostFaults host_faults(faults, folder.path());
  start_modules(launcher, options, folder, start, bus, sockets.file("truth"), host_faults);
  if (stop_requested()) return kExitInterrupted;
  std::vector<std::string> mains{"--on-power-return", options.on_power_return};
  if (start.folder) mains = with(mains, {"--memory", start.folder->path()});
  if (options.resume) mains.push_back("--resume");
  if (options.how.block_delete) mains.push_back("--block-delete");
  if (options.how.dialect != "auto") mains = with(mains, {"--dialect", options.how.dialect});
  if (options.how.from_line > 0)
    mains = with(mains, {"--from-line", std::to_string(options.how.from_line)});
  if (!options.how.tools.empty())
    mains = with(mains, {"--tools", fs::absolute(options.how.tools).string(), "--tools-unit",
                         options.how.tools_unit});
  for (const std::string& text : options.operations) mains = with(mains, {"--operate", text});
  launcher.start("NC unit",
                 with({program_directory() + "/vcnc-nc", "--machine", folder.machine_file(),
                       "--program", fs::absolute(options.program).string(), "--bus", bus, "--pace",
                       fmt::format("{}", options.pace), "--seed", std::to_string(options.seed)},
                      with(common_options(options), mains)));

  const RunEnded ended =
      Watch(launcher, folder, host_faults, options.answer_timeout_s).until_all_ended();
  for (const std::string& note : ended.notes) std::cerr << "vcnc: " << note << '\n';
  folder.write_notes(ended.notes);
  // A program that was killed cannot tell what it has suffered.
  BusFaults simulated;
  if (host_faults.empty() && ended.failure.empty())
    std::copy_if(faults.begin(), faults.end(), std::back_inserter(simulated),
                 [](const BusFault& f) { return !f.of_host(); });
  warn(never_struck(simulated, ended.struck));
  warn(host_faults.not_begun());
  std::cout << file_text(folder.path() / "summary.txt");
  if (ended.failure.empty()) return ended.nc_code;
  std::cerr << "vcnc: " << ended.failure << '\n';
  return kExitFailure;
}

}  // namespace

int run_command(RunOptions options) {
  const Machine machine =
      with_program_path(load_machine(options.machine, options.assignments, options.injections),
                        options.how.program_path);
  options.how.memory = options.memory;
  options.how.resumed = options.resume;
  const std::unique_ptr<PieceParams> piece = piece_of(machine);
  // Refuses a wrong program before anything is started or written.
  const PlayerOptions how = player_options(options.how, options.program);
  options.how.from_line = how.from_line;
  options.how.from_block.clear();
  Player player(options.program, as_nc_believes(machine), how);
  if (how.from_line > 0) std::cout << text_of_begin(player) << '\n';
  options.operations = texts_of(read_operations(options.operations));
  if (options.random_faults > 0)
    for (std::string& fault : drawn_faults(options, player)) {
      std::cerr << "vcnc: --fault \"" << fault << "\"\n";
      options.faults.push_back(std::move(fault));
    }
  const BusFaults faults = parse_faults(options.faults);
  const bool in_process = options.in_process || options.bus == "inproc://";
  if (!in_process && options.bus != "hub://") check_bus(options.bus);
  const Continuation start = open_memory(options, machine, piece.get());
  for (const std::string& idle : idle_effects(machine))
    std::cerr << "vcnc: warning: " << idle << '\n';
  catch_stop_signals();
  RunFolder folder(options.out, {options.program, options.machine, machine.setup.piece});
  try {
    folder.write_inputs(machine, piece.get());
    folder.write_faults(options.faults);
    folder.write_operations(options.operations);
    const int code = in_process
                         ? run_in_process(options, machine, piece.get(), faults, folder, start)
                         : run_processes(options, faults, folder, start);
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
