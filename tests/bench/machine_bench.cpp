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

/// Ten effects at their nominal size: of drives, friction, mechanics, geometry, probe.
const std::vector<std::string> kTenEffects{"X.backlash.gap_um=10",
                                           "X.windup.compliance_nm_per_N=10",
                                           "X.coulomb.level_N=250",
                                           "Y.coulomb.level_N=250",
                                           "Y.stribeck.excess_N=100",
                                           "Y.viscous.coefficient_Ns_per_m=1000",
                                           "X.pitch_periodic.amplitude_um=3",
                                           "Z.scale_error.error_ppm=20",
                                           "geometry.squareness.xy_urad=20",
                                           "probe.adc_noise.noise_mV=1"};

void bench(const char* name, const char* file, double limit,
           const std::vector<std::string>& injections = {}) {
  const Machine machine = load_machine(configs(file), {}, injections);
  const auto params = piece_params(machine);
  const auto piece = make_piece(*params);
  const TemporaryFile program("bench.ngc", s_piece_program(machine, *piece, {}));

  const Stopwatch check;
  { const Player player(program.path(), machine); }
  fmt::print("{}: reading and checking the program {:.3f} s\n", name, check.seconds());

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
    fmt::print("{}: {:<20} {:7.1f} x real time  (limit {:.0f}, ratio {:.2f})\n", name, what, best,
               limit, best / limit);
  }
}

}  // namespace
}  // namespace vcnc

int main() {
  vcnc::bench("ideal", "machines/trunnion.toml", 100);
  vcnc::bench("ten effects", "machines/trunnion.toml", 60, vcnc::kTenEffects);
  vcnc::bench("as measured", "machines/trunnion_measured.toml", 60);
}
