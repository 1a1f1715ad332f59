// The whole machine in one process and thread: simulated over host time, for the ideal and the
// measured machine, without and with the live analysis. Planning the program is counted separately.
#include <fmt/format.h>

#include <functional>

#include "controller/player.hpp"
#include "controller/program_writer.hpp"
#include "tests/bench/stopwatch.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc {
namespace {

/// Forgets everything.
class Nobody : public TelemetrySink {
 public:
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow&) override {}
  void alarm(const Alarm&) override {}
  void end(const RunEnd&) override {}
};

/// Evaluates every row.
class Evaluator : public Nobody {
 public:
  void begin(const RunBegin& begin) override { evaluation_.emplace(begin); }
  void row(const TelemetryRow& row) override { evaluation_->row(row); }

 private:
  std::optional<Evaluation> evaluation_;
};

void bench(const char* file) {
  const Machine machine = load_machine(configs(file));
  const auto params = piece_params(machine);
  const auto piece = make_piece(*params);
  const TemporaryFile program("bench.ngc", s_piece_program(machine, *piece, {}));

  const Stopwatch check;
  { const Player player(program.path(), machine); }
  fmt::print("{}: reading and checking the program {:.3f} s\n", file, check.seconds());

  const std::pair<const char*, std::function<std::unique_ptr<TelemetrySink>()>> sinks[] = {
      {"machine alone", [] { return std::make_unique<Nobody>(); }},
      {"with live analysis", [] { return std::make_unique<Evaluator>(); }}};
  for (const auto& [what, sink] : sinks) {
    double best = 0;
    for (int repeat = 0; repeat < 3; ++repeat) {
      VirtualMachine modules(machine, params.get(), 1);
      InprocTransport transport(modules.nodes());
      const auto s = sink();
      NcRunOptions options;
      options.program = program.path();
      options.piece_toml = to_toml(*params);
      const NcRunResult result = run_nc(machine, options, transport, *s);
      best = std::max(best, seconds(result.end.cycles) / result.end.wall_seconds);
    }
    fmt::print("{}: {:<20} {:7.1f} x real time  (limit 100, ratio {:.2f})\n", file, what, best,
               best / 100);
  }
}

}  // namespace
}  // namespace vcnc

int main() {
  vcnc::bench("machines/trunnion.toml");
  vcnc::bench("machines/trunnion_measured.toml");
}
