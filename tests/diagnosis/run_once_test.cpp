// A run of the whole machine in which no motion is repeated: an effect is named all the same, and
// nobody is accused without one.
#include <gtest/gtest.h>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "healthy_run.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::run_once_test {
namespace {

struct RunOnce {
  std::string name;
  RunOfMachine (*motion)(const Effects&);
  double noise_mV;
  std::string effect;  ///< "Y.coulomb"; empty: none
  std::string key;     ///< of its number
  double value;
};

void PrintTo(const RunOnce& run, std::ostream* out) { *out << run.name; }

class RunsOnce : public testing::TestWithParam<RunOnce> {};

TEST_P(RunsOnce, TellWhatThereIsAndNoMore) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  const RunOnce& of = GetParam();
  Machine with;
  move_number(with, "effects.probe.adc_noise.noise_mV", of.noise_mV);
  if (!of.key.empty()) move_number(with, of.key, of.value);
  const RunOfMachine run = of.motion(with.effects);
  MachineReplica replica(run.record, run.declared, run.piece);
  const Diagnosis d = diagnose({run.record, replica, run.declared, candidates(run.declared)});
  if (of.key.empty()) {
    EXPECT_EQ(d.verdict, DiagnosisVerdict::no_deviation);
    EXPECT_TRUE(d.effects.empty());
    return;
  }
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].place + "." + d.effects[0].name, of.effect);
  EXPECT_NEAR(number_of(d.found, of.key), of.value, 0.01 * std::abs(of.value));
}

INSTANTIATE_TEST_SUITE_P(
    Machine, RunsOnce,
    testing::Values(RunOnce{"nothing", circles_in_a_ring, 0, "", "", 0},
                    RunOnce{"noise", circles_in_a_ring, 2, "", "", 0},
                    RunOnce{"friction", lap_of_the_s_piece, 0, "Y.coulomb",
                            "effects.Y.coulomb.level_N", 150},
                    RunOnce{"latency", lap_of_the_s_piece, 2, "probe.sample_latency",
                            "effects.probe.sample_latency.latency_us", 300},
                    RunOnce{"squareness", circles_in_a_ring, 2, "geometry.squareness",
                            "effects.geometry.squareness.xy_urad", 15},
                    RunOnce{"pitch", circles_in_a_ring, 2, "X.pitch_periodic",
                            "effects.X.pitch_periodic.amplitude_um", 2},
                    RunOnce{"gain", circles_in_a_ring, 2, "X.velocity_ff_error",
                            "effects.X.velocity_ff_error.deviation_percent", -2}),
    [](const auto& run) { return run.param.name; });

/// Rounding repeats with the laps: a force that hardly changes is off by most of half a step all
/// the time, which is more than an even spread makes.
TEST(CoarselyRecordedRun, IsNoDeviation) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  const double step = 10;  // [N]
  RunOfMachine run = reversals_in_the_air({});
  for (MeasuredSignal& s : run.record.signals) {
    if (s.kind != SignalKind::force) continue;
    s.resolution = step;
    for (double& v : s.value) v = step * std::round(v / step);
  }
  MachineReplica replica(run.record, run.declared, run.piece);
  const Diagnosis d = diagnose({run.record, replica, run.declared, candidates(run.declared)});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::no_deviation) << to_text(d);
  EXPECT_TRUE(std::any_of(d.notes.begin(), d.notes.end(), [](const std::string& note) {
    return note.find("force X is recorded in steps of") != std::string::npos;
  }));
}

}  // namespace
}  // namespace vcnc::run_once_test
