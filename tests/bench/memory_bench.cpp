// Resident memory of a machine that runs for an hour of simulated time, with the live analysis and
// its recording: printed each simulated minute, and the growth after the first.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "analysis/session.hpp"
#include "controller/program_writer.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc {
namespace {

double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double pages = 0, resident = 0;
  in >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

class Watcher : public TelemetrySink {
 public:
  explicit Watcher(AnalysisSession& session) : session_(session) {}
  void begin(const RunBegin& begin) override { session_.begin(begin); }
  void row(const TelemetryRow& row) override {
    session_.row(row);
    if (++rows_ % 60000 != 0) return;
    const double now = resident_mb();
    if (rows_ == 60000) first_ = now;
    last_ = now;
    if (rows_ % 600000 == 0 || rows_ == 60000)
      fmt::print("minute {:3d}: {:.1f} MB\n", rows_ / 60000, now);
  }
  void alarm(const Alarm& alarm) override { session_.alarm(alarm); }
  void end(const RunEnd& end) override { session_.end(end); }
  double growth() const { return last_ - first_; }
  double first() const { return first_; }

 private:
  AnalysisSession& session_;
  int rows_ = 0;
  double first_ = 0, last_ = 0;
};

/// A circle program that repeats its laps until an hour has passed.
std::string hour_long_program(const Machine& machine, const Piece& piece) {
  ProgramOptions options;
  options.feed_mm_min = 3000;
  options.laps = 5;
  std::string once = circle_program(machine, &piece, options);
  once.erase(once.rfind("M30"));
  std::string hour;
  for (int i = 0; i < 48; ++i) hour += i == 0 ? once : once.substr(once.find("G54"));
  return hour + "M30\n";
}

}  // namespace
}  // namespace vcnc

int main() {
  using namespace vcnc;
  const Machine machine = load_machine(configs("machines/trunnion.toml"),
                                       {"setup.piece=" + configs("pieces/ring.toml")});
  const auto params = piece_params(machine);
  const auto piece = make_piece(*params);
  const TemporaryFile program("hour.ngc", hour_long_program(machine, *piece));
  const auto folder =
      std::filesystem::temp_directory_path() / fmt::format("vcnc-bench-hour-{}", ::getpid());
  VirtualMachine modules(machine, params.get(), 1);
  InprocTransport transport(modules.nodes());
  AnalysisSession session({.folder = folder, .report = false, .csv = false});
  Watcher watcher(session);
  NcRunOptions options;
  options.program = program.path();
  options.piece_toml = to_toml(*params);
  const NcRunResult result = run_nc(machine, options, transport, watcher);
  std::filesystem::remove_all(folder);
  fmt::print(
      "{:.0f} simulated minutes ({}), {:.0f} x real time; memory after the first minute {:.1f} MB, "
      "growth since {:+.1f} MB, ratio {:.3f}\n",
      seconds(result.end.cycles) / 60, result.end.reason,
      seconds(result.end.cycles) / result.end.wall_seconds, watcher.first(), watcher.growth(),
      1 + watcher.growth() / watcher.first());
}
