#include "apps/lockout_processes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "analysis/recording.hpp"
#include "apps/lockout_random.hpp"
#include "apps/node_options.hpp"
#include "apps/run_folder.hpp"
#include "bus/pacer.hpp"
#include "model/probe/noise.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;
using Kind = BusFault::Kind;

constexpr std::uint64_t kProcessStream = 0x70726f63657373;
constexpr double kPatience = 60;  ///< with one run [s]
constexpr double kStartUp = 0.4;  ///< about the time until the first cycle [s]
constexpr const char* kAnswerTimeout = "1.5";

constexpr std::array<std::string_view, 10> kProcesses{
    "drive X", "drive Y",       "drive Z",    "drive A", "drive C",
    "probe",   "drive spindle", "overtravel", "NC unit", "analysis"};

struct Planned {
  Scenario scenario;
  BusFault fault;
  const char* phase = "";  ///< in which the fault is meant to fall
};

std::string whole_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Ids of processes whose command line names the folder.
std::vector<pid_t> processes_of(const std::string& folder) {
  std::vector<pid_t> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if (whole_text(entry.path() / "cmdline").find(folder) == std::string::npos) continue;
    if (std::stol(name) != ::getpid()) found.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return found;
}

pid_t start(const std::vector<std::string>& argv, const std::string& tmp, const std::string& out,
            const std::string& err) {
  std::vector<char*> arguments;
  std::vector<std::string> texts = argv, environment{"TMPDIR=" + tmp};
  for (char** e = environ; *e != nullptr; ++e)
    if (!std::string_view(*e).starts_with("TMPDIR=") &&
        !std::string_view(*e).starts_with("VCNC_DDS_TAG="))
      environment.emplace_back(*e);
  for (std::string& a : texts) arguments.push_back(a.data());
  arguments.push_back(nullptr);
  std::vector<char*> variables;
  for (std::string& v : environment) variables.push_back(v.data());
  variables.push_back(nullptr);
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::setpgid(0, 0);  // Ctrl-C ends the suite, not one run of it
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(::open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644), STDOUT_FILENO);
  ::dup2(::open(err.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644), STDERR_FILENO);
  ::execve(arguments[0], arguments.data(), variables.data());
  ::_exit(127);
}

/// Its exit code, 128 + signal, or -1 where it had to be killed.
int await(pid_t pid) {
  const Pacer clock;
  int status = 0;
  while (true) {
    const pid_t ended = ::waitpid(pid, &status, WNOHANG);
    if (ended == pid) return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    if (clock.elapsed() > kPatience) break;
    ::poll(nullptr, 0, 5);
  }
  ::kill(pid, SIGKILL);
  ::waitpid(pid, &status, 0);
  return -1;
}

class ProcessRun {
 public:
  ProcessRun(const ProcessSuite& suite, const ScenarioDraw& draw, std::uint64_t number)
      : suite_(suite), draw_(draw), number_(number), counter_(number << 8) {}

  LockoutVerdict play() {
    const LockoutFolder work;
    const fs::path folder = work.path();
    plan(folder);
    verdict_.id = fmt::format("process-{}", number_);
    verdict_.kind = planned_.scenario.kind;
    verdict_.expect = Scenario::Expect::fault_safe;
    verdict_.name = fmt::format("{}, {} ({})", to_string(planned_.scenario.kind),
                                planned_.fault.text, planned_.phase);
    verdict_.faults = {planned_.fault.text};
    verdict_.process = ProcessEnd{.phase = planned_.phase};
    if (!verdict_.failures.empty()) return std::move(verdict_);

    const LockoutCase the_case = make_case(planned_.scenario);
    {
      RunFolder inputs((folder / "in").string(), {});
      inputs.write_inputs(the_case.machine, the_case.piece ? &*the_case.piece : nullptr);
    }
    std::ofstream(folder / "in/program.ngc") << the_case.program;
    hash_ = hash_of_files(folder);
    fs::create_directory(folder / "tmp");
    const std::string out = (folder / "out").string();
    const Pacer clock;
    const pid_t pid = start(
        {suite_.program, "run", (folder / "in/program.ngc").string(), "--machine",
         (folder / "in/machine.toml").string(), "--seed", std::to_string(planned_.scenario.seed),
         "--out", out, "--no-report", "--pace", "1", "--answer-timeout-s", kAnswerTimeout,
         "--fault", planned_.fault.text},
        (folder / "tmp").string(), (folder / "stdout").string(), (folder / "stderr").string());
    code_ = await(pid);
    verdict_.process->seconds = clock.elapsed();
    verdict_.process->exit_code = code_;
    said_ = whole_text(folder / "stderr");
    leftovers(folder);
    verdict_.process->struck = said_.find("had no effect") == std::string::npos;
    judge_code();
    judge_recording(folder / "out");
    if (!verdict_.failures.empty()) say("it said: " + said_);
    return std::move(verdict_);
  }

 private:
  double unit() { return uniform_noise(suite_.seed, kProcessStream, counter_++); }
  void say(std::string sentence) { verdict_.failures.push_back(std::move(sentence)); }
  const std::string& node() const { return planned_.fault.node; }
  bool is_module() const { return node() != kNcUnitName && node() != "analysis"; }

  /// Draws what happens; the same scenario in one process tells when and what the hash must be.
  void plan(const fs::path& folder) {
    Scenario& s = planned_.scenario;
    s = unit() < 0.7 ? draw_.faulted(number_) : draw_.ordinary(number_);
    s.faults.clear();
    if (s.expect == Scenario::Expect::fault_safe) s.expect = Scenario::Expect::trip;
    TripLog log;
    const LockoutVerdict alone = run_lockout("reference", s, {.work_folder = folder.string()}, log);
    if (alone.end.refused) {  // the next one then; the feed is at the edge
      counter_ += 100;
      s = draw_.ordinary(number_);
      run_lockout("reference", s, {.work_folder = folder.string()}, log);
    }
    BusFault& f = planned_.fault;
    const double which = unit();
    f.kind = which < 0.45   ? Kind::kill
             : which < 0.7  ? Kind::stop
             : which < 0.95 ? Kind::restart
                            : Kind::disk_full;
    f.node = f.kind == Kind::disk_full
                 ? "analysis"
                 : std::string(kProcesses[static_cast<std::size_t>(unit() * 10) % 10]);
    // The NC unit waits for no reader, but nobody waits for a reader that never comes back either.
    if (f.kind == Kind::stop && f.node == "analysis") f.cycles = 500;
    const double end = seconds(static_cast<Tick>(log.size()));
    const auto first = [&](auto&& is) {
      const auto at = std::find_if(log.begin(), log.end(), is);
      return at == log.end() ? end : seconds(at - log.begin());
    };
    const double touch =
        first([](const TripCycle& c) { return c.deflection.back().norm() > 1e-6; });
    const double trip = first([](const TripCycle& c) { return c.nc_alarm; });
    const double phase = unit(), u = unit();
    double from = 0, to = 0;
    if (phase < 0.2) {
      planned_.phase = "start-up";
      to = kStartUp;
    } else if (phase < 0.45) {
      planned_.phase = "before contact";
      from = kStartUp, to = kStartUp + touch;
    } else if (phase < 0.75) {
      planned_.phase = "contact";
      from = kStartUp + touch, to = kStartUp + trip;
    } else {
      planned_.phase = trip < end ? "trip" : "end";
      from = kStartUp + trip - (trip < end ? 0 : 0.1), to = kStartUp + end;
    }
    f.wall_s = std::round((from + u * std::max(to - from, 0.05)) * 1e3) / 1e3;
    f.text = text_of(f);
  }

  /// Of the run in one process from the files that the processes get: what is drawn may have no
  /// decimal that reads back to the last bit.
  std::string hash_of_files(const fs::path& folder) const {
    Scenario files;
    files.kind = Scenario::Kind::program;
    files.machine = (folder / "in/machine.toml").string();
    files.program = (folder / "in/program.ngc").string();
    files.seed = planned_.scenario.seed;
    TripLog log;
    return run_lockout("reference", files, {.work_folder = folder.string()}, log).trace_hash;
  }

  void leftovers(const fs::path& folder) {
    constexpr int kTries = 100;
    for (int i = 0; i < kTries && !processes_of(folder.string()).empty(); ++i)
      ::poll(nullptr, 0, 10);
    for (const pid_t pid : processes_of(folder.string())) {
      say(fmt::format("process {} is left over", pid));
      ::kill(pid, SIGKILL);
    }
    if (!fs::is_empty(folder / "tmp")) say("a folder of sockets is left over");
  }

  void judge_code() {
    if (code_ == -1) return say(fmt::format("did not end within {:.0f} s", kPatience));
    if (code_ != kExitOk && code_ != kExitFailure && code_ != kExitAlarm)
      return say(fmt::format("exit code {}", code_));
    if (code_ != kExitFailure) return;
    if (said_.find(node()) == std::string::npos) say("no message names " + node());
    if (!verdict_.process->struck) say("failed without a fault");
  }

  void judge_recording(const fs::path& out) {
    if (!fs::exists(out)) {
      if (code_ != kExitFailure) say("no recording");
      return;
    }
    try {
      const RecordingReader recording(out);
      verdict_.cycles = recording.rows();
      verdict_.end.rows = recording.rows();
      verdict_.end.complete = recording.end().complete;
      verdict_.end.reason = recording.end().reason;
      verdict_.trace_hash = recording.end().trace_hash;
      verdict_.end.alarmed = code_ == kExitAlarm;
      if (code_ == kExitOk || code_ == kExitAlarm) {
        if (recording.end().trace_hash != hash_)
          say(fmt::format("ended as if nothing had been, but trace hash {} is not {}",
                          recording.end().trace_hash, hash_));
        return;
      }
      if (recording.end().trace_hash == hash_) return;  // the run was over when the fault came
      came_to_rest(recording, whole_text(out / "notes.txt"));
    } catch (const std::exception& e) {
      say(std::string("the recording does not open: ") + e.what());
    }
  }

  void came_to_rest(const RecordingReader& recording, const std::string& notes) {
    if (notes.find("still moving") != std::string::npos) say("a drive did not come to rest");
    bool ran = false;
    TelemetryRow before, last;
    recording.for_each([&](const TelemetryRow& row) {
      ran = ran || row.state == static_cast<double>(NcState::running);
      before = last;
      last = row;
    });
    const bool told = recording.end().reason != RunEnd{}.reason;  // the NC unit lived to say so
    if (!ran) return;
    if (node() == kNcUnitName || !told) {
      const bool spindle = node() != "drive spindle";
      // Without a run-down the modules had been told to stop before: then the axes stood.
      const bool run_down = notes.find("came to rest") != std::string::npos;
      for (std::size_t i = 0; i < kAxisCount && !run_down && node() == kNcUnitName; ++i)
        if (std::abs(last.q_act[i] - before.q_act[i]) > 1e-6)
          say(fmt::format("drive {} neither stood nor ran down", kAxisNames[i]));
      if (node() == kNcUnitName && spindle && run_down &&
          notes.find("the spindle is locked") == std::string::npos)
        say("the spindle does not say that it is locked");
      return;
    }
    for (std::size_t i = 0; i < kAxisCount; ++i)
      if (node() != fmt::format("drive {}", kAxisNames[i]) &&
          std::abs(last.q_act[i] - before.q_act[i]) > 1e-6)
        say(fmt::format("drive {} moved in the last cycle", kAxisNames[i]));
    if (last.spindle_speed != 0) say("the spindle turned in the last cycle");
    const auto& alarms = recording.alarms();
    if (is_module() && std::none_of(alarms.begin(), alarms.end(), [&](const Alarm& a) {
          return a.code == 3201 && a.source == node();
        }))
      say("no alarm 3201 names " + node());
  }

  const ProcessSuite& suite_;
  const ScenarioDraw& draw_;
  std::uint64_t number_, counter_;
  Planned planned_;
  LockoutVerdict verdict_;
  std::string hash_, said_;
  int code_ = -1;
};

}  // namespace

std::vector<LockoutVerdict> ProcessSuite::run() const {
  const ScenarioDraw draw(seed, machines);
  std::vector<std::uint64_t> numbers;
  if (!only.empty())
    numbers = {std::stoull(only.substr(only.find('-') + 1))};
  else
    for (std::uint64_t i = 0; i < runs; ++i) numbers.push_back(i);
  std::vector<LockoutVerdict> verdicts(numbers.size());
  std::vector<char> done(numbers.size(), 0);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::size_t finished = 0, bad = 0;
  const auto work = [&] {
    for (std::size_t i; !(stop && *stop) && (i = next++) < numbers.size();) {
      verdicts[i] = ProcessRun(*this, draw, numbers[i]).play();
      const std::lock_guard lock(mutex);
      done[i] = 1;
      bad += !verdicts[i].passed();
      if (progress) progress(++finished, bad);
    }
  };
  std::vector<std::thread> workers;
  for (int i = 0; i < std::max(1, jobs); ++i) workers.emplace_back(work);
  for (std::thread& worker : workers) worker.join();
  std::vector<LockoutVerdict> kept;
  for (std::size_t i = 0; i < verdicts.size(); ++i)
    if (done[i]) kept.push_back(std::move(verdicts[i]));
  return kept;
}

}  // namespace vcnc
