#include "diagnosis/replica/clipped_replica.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc::clipped_replica_test {
namespace {

TEST(ClippedReplica, TakesOffBeforeTheEndOfTheScale) {
  const Record record = toy::commands(1000, 1);
  toy::ToyReplica plain(record);
  const Machine open = toy::machine({{"effects.X.scale_error.error_ppm", 1000}});
  Machine clipping = open;
  clipping.effects.get<RangeClip>().limit = 20e-6;
  std::vector<double> off(record.samples());
  for (std::size_t k = 0; k < off.size(); ++k)
    off[k] = 3e-6 * std::sin(0.1 * static_cast<double>(k));
  off[10] = std::nan("");
  const ClippedReplica replica(plain, {{}, {}, off});
  const Prediction u = plain.predict(open), p = replica.predict(clipping);
  for (std::size_t k = 0; k < off.size(); ++k) {
    const double e = k == 10 ? 0 : off[k];
    EXPECT_NEAR(p[2][k], std::clamp(u[2][k] + e, -20e-6, 20e-6) - e, 1e-18) << k;
  }
  EXPECT_EQ(replica.predict(open), u);
  EXPECT_EQ(p[1], u[1]);
}

TEST(ClippedReplica, SharesWhatPredictionsShare) {
  class KeepingReplica final : public Replica {
   public:
    const std::vector<ComparedChannel>& channels() const override { return channels_; }
    Prediction predict(const Machine& m) const override {
      return {m.effects.get<RangeClip>().null() ? open_ : ended_};
    }

   private:
    std::vector<ComparedChannel> channels_{{SignalKind::deflection, 0}};
    SharedSeries open_{std::vector<double>{0, 3}}, ended_{std::vector<double>{0, 2}};
  } keeping;
  Machine one, other;
  one.effects.get<RangeClip>().limit = other.effects.get<RangeClip>().limit = 2;
  other.axes[kX].mechanics.load *= 2;
  const ClippedReplica replica(keeping, {{0.5, 0.5}});
  const std::vector<Prediction> p = replica.predict_all({one, other});
  EXPECT_EQ(p[0][0], SharedSeries(std::vector<double>{0, 1.5}));
  EXPECT_TRUE(p[0][0].shares(p[1][0]));
}

/// Waves of 4 um that nobody has declared are in both runs; then the scale ends at 20 um, and there
/// is a squareness.
TEST(ClippedReplica, LeavesNothingOfAScaleThatEnds) {
  Record healthy = toy::commands(1024, 4), now = healthy;
  const Machine was = toy::machine({{"effects.X.pitch_periodic.amplitude_um", 4},
                                    {"effects.X.pitch_periodic.period_mm", 12},
                                    {"effects.X.scale_error.error_ppm", 800}});
  Machine is = was;
  is.effects.get<RangeClip>().limit = 20e-6;
  is.effects.get<Squareness>().xy = 50e-6;
  toy::measure(healthy, was, 1);
  toy::measure(now, is, 2);
  toy::ToyReplica of_healthy(healthy), of_now(now);
  const Machine declared = toy::machine({{"effects.X.scale_error.error_ppm", 800}});
  std::vector<Candidate> candidates = toy::candidates();
  candidates.push_back(
      {"range_clip", "probe", {{"effects.probe.range_clip.limit_mm", 0.4, 0, 50, true}}, {}});
  const Diagnosis d = diagnose({now, of_now, declared, candidates},
                               less_healthy(now, healthy_run(healthy, of_healthy, declared)));
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  std::vector<std::string> names;
  for (const FoundEffect& e : d.effects) names.push_back(e.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"range_clip", "squareness"}));
  EXPECT_NEAR(d.found.effects.get<RangeClip>().limit, 20e-6, 0.02e-6);
  for (const FoundEffect& e : d.effects)  // where a scale ends is read off, not the form of a law
    if (e.name == "range_clip") {
      EXPECT_LT(e.numbers[0].high - e.numbers[0].low, 0.1e-3);
    }
  EXPECT_NEAR(d.found.effects.get<Squareness>().xy, 50e-6, 0.5e-6);
}

}  // namespace
}  // namespace vcnc::clipped_replica_test
