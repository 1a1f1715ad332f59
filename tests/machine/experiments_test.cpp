// Every motion of the experiments on the ideal machine, and effects read off their curves.
#include "apps/experiments.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "apps/demonstrations.hpp"
#include "apps/gallery_page.hpp"
#include "configs/config.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::experiments_test {
namespace {

constexpr double kMicrometre = 1e-6;

struct Motion {
  const char* name;
  Showing showing;
  std::size_t axis;
  ExperimentOptions::Wall wall = ExperimentOptions::Wall::inclined;
  double from, to;  ///< what the abscissa has to cover
};

void PrintTo(const Motion& motion, std::ostream* out) { *out << motion.name; }

class EveryMotion : public testing::TestWithParam<Motion> {
 protected:
  Experiment make() const {
    ExperimentOptions options;
    options.wall = GetParam().wall;
    return experiment(GetParam().showing, GetParam().axis, ideal_machine(), options);
  }
};

TEST_P(EveryMotion, RunsCleanCoversItsAbscissaAndMeasuresNothing) {
  const Experiment e = make();
  const Observation o = observe(e);
  ASSERT_TRUE(o.clean()) << o.nc.end.reason;
  ASSERT_EQ(o.rows.size(), o.errors.size());
  EXPECT_LT(o.rows.size(), 35000u) << "experiments are short";
  const bool free = !e.piece;
  const Quantity quantity = free ? Quantity::following : Quantity::machine_error;
  const std::vector<Curve> all = curves(e, o, quantity);
  ASSERT_EQ(all.size(), e.passes.size());
  for (const Curve& curve : all) {
    SCOPED_TRACE(curve.label);
    ASSERT_GT(curve.size(), 500u);
    const auto [low, high] = std::minmax_element(curve.x.begin(), curve.x.end());
    const double slack = 0.01 * (GetParam().to - GetParam().from);
    EXPECT_NEAR(*low, GetParam().from, slack);
    EXPECT_NEAR(*high, GetParam().to, slack);
    // What is left is the lag of the ball along the wall; on the S piece its ends are the worst.
    EXPECT_LT(max_abs(curve),
              GetParam().showing == Showing::s_piece ? 0.6 * kMicrometre : 0.01 * kMicrometre);
  }
}

using Wall = ExperimentOptions::Wall;
constexpr double kTurn = 2 * kPi;
INSTANTIATE_TEST_SUITE_P(
    Experiments, EveryMotion,
    testing::Values(Motion{"circle_X", Showing::circle, kX, Wall::inclined, 0, kTurn},
                    Motion{"circle_Y", Showing::circle, kY, Wall::inclined, 0, kTurn},
                    Motion{"circle_Z", Showing::circle, kZ, Wall::inclined, 0, kTurn},
                    Motion{"circle_feeds", Showing::circle_feeds, kX, Wall::inclined, 0, kTurn},
                    Motion{"line_X", Showing::line, kX, Wall::inclined, -0.04, 0.04},
                    Motion{"line_Y", Showing::line, kY, Wall::inclined, -0.04, 0.04},
                    Motion{"line_Z", Showing::line, kZ, Wall::inclined, -0.04, 0.04},
                    Motion{"guide_X", Showing::line, kX, Wall::guide, -0.04, 0.04},
                    Motion{"guide_Z", Showing::line, kZ, Wall::guide, -0.04, 0.04},
                    Motion{"free_Y", Showing::line, kY, Wall::none, -0.04, 0.04},
                    Motion{"reversals_X", Showing::reversals, kX, Wall::inclined, 0, 1.21},
                    Motion{"reversals_Z", Showing::reversals, kZ, Wall::inclined, 0, 1.21},
                    Motion{"reversals_free_X", Showing::reversals, kX, Wall::none, 0, 3.61},
                    Motion{"standstill_X", Showing::standstill, kX, Wall::inclined, 0, 2},
                    Motion{"standstill_Z", Showing::standstill, kZ, Wall::inclined, 0, 2},
                    Motion{"spin_A", Showing::spin, kA, Wall::inclined, -50 * kDegree,
                           50 * kDegree},
                    Motion{"spin_C", Showing::spin, kC, Wall::inclined, -kPi, kPi},
                    Motion{"s_piece", Showing::s_piece, kX, Wall::inclined, 0, 1.107}),
    [](const auto& motion) { return motion.param.name; });

TEST(Experiments, CornerIsRoundedWithinItsToleranceAndFollowedExactly) {
  const Experiment e = experiment(Showing::corner, kX, ideal_machine());
  const Observation o = observe(e);
  ASSERT_TRUE(o.clean()) << o.nc.end.reason;
  const Curve off = curves(e, o, Quantity::contour).at(0);
  const auto [low, high] = std::minmax_element(off.x.begin(), off.x.end());
  EXPECT_NEAR(*low, 0, 1e-4);
  EXPECT_NEAR(*high, 80e-3, 1e-4);
  // G64 P0.02: the corner's point is missed by at most 20 um, of which the distance from the sides
  // is at most 1/sqrt(2).
  EXPECT_LE(max_abs(off), 20 * kMicrometre / std::sqrt(2.0) + 1e-9);
  EXPECT_GT(max_abs(off), 5 * kMicrometre) << "it is rounded";
  for (const Curve& following : curves(e, o, Quantity::following))
    EXPECT_LT(max_abs(following), 0.01 * kMicrometre);
}

TEST(Experiments, AMotionForAnotherKindOfAxisIsRefused) {
  EXPECT_THROW(experiment(Showing::line, kC, ideal_machine()), std::invalid_argument);
  EXPECT_THROW(experiment(Showing::reversals, kA, ideal_machine()), std::invalid_argument);
  EXPECT_THROW(experiment(Showing::spin, kX, ideal_machine()), std::invalid_argument);
}

TEST(Experiments, TheIdealMachineIsThatOfTheMachineFile) {
  Machine file = load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml");
  file.setup.piece.clear();
  EXPECT_EQ(to_toml(ideal_machine()), to_toml(file));
}

/// The tool stands 5 um further along an axis than its scale says: every experiment shows it with
/// its size and sign.
TEST(Experiments, AKnownDisplacementIsSeenInFull) {
  constexpr double kShift = 5e-6;
  const auto seen = [](Showing showing, std::size_t axis, Wall wall) {
    ExperimentOptions options;
    options.wall = wall;
    Experiment e = experiment(showing, axis, ideal_machine(), options);
    Law law;
    law.axis = static_cast<Law::OfAxis>(axis);
    law.point = Law::Point::displacement;
    law.at = {0};
    law.value = {kShift};
    e.machine.effects.laws = {law};
    return curves(e, observe(e), Quantity::machine_error);
  };
  for (const std::size_t axis : {kX, kY, kZ}) {
    SCOPED_TRACE(axis);
    for (const Curve& pass : seen(Showing::line, axis, Wall::inclined)) {
      EXPECT_NEAR(mean(pass), kShift, 1e-9);
      EXPECT_NEAR(peak_to_peak(pass), 0, 1e-9);
    }
    for (const Curve& pass : seen(Showing::line, axis, Wall::guide))
      EXPECT_NEAR(max_abs(pass), 0, 1e-9) << "a guide wall does not see it";
    EXPECT_NEAR(mean(seen(Showing::reversals, axis, Wall::inclined).at(0)), kShift, 1e-9);
    EXPECT_NEAR(mean(seen(Showing::standstill, axis, Wall::inclined).at(0)), kShift, 1e-9);
    // In the bore the normal points to the centre. First axis of the plane: X, for Z it is Z.
    const Wave first = harmonic(seen(Showing::circle, axis, Wall::inclined).at(0), 1);
    EXPECT_NEAR(axis == kY ? first.sine : first.cosine, -kShift, 2e-9);
    EXPECT_NEAR(axis == kY ? first.cosine : first.sine, 0, 2e-9);
  }
}

/// With the measuring system on the motor the tool steps by the gap at every reversal of X.
TEST(Experiments, BacklashStepsByItsGap) {
  Demonstration d = demonstration("backlash", ideal_machine());
  const std::vector<Curve> without = curves(d.without, observe(d.without), d.quantity);
  const std::vector<Curve> with = curves(d.with, observe(d.with), d.quantity);
  for (std::size_t i = 0; i < with.size(); ++i) {
    const Curve lap = difference(with[i], without[i]);
    SCOPED_TRACE(lap.label);
    for (const double at : {0.0, kPi}) {
      ASSERT_TRUE(step_at(lap, at));
      // 10 um gap; friction of 50 N bends the contact by 2 x 50 N / K, K = (2 pi 400)^2 m_red =
      // 2.67e9 N/m, 0.04 um; the rest is the reversal's settling within the straight line's reach.
      EXPECT_NEAR(std::abs(*step_at(lap, at)), 10.04e-6, 0.25e-6);
    }
    for (const double at : {kPi / 2, 1.5 * kPi})
      EXPECT_NEAR(*step_at(lap, at), 0, 0.05e-6) << "Y has none";
  }
}

/// Mismatched loop gains without feed-forward: mean radius and second harmonic in closed form.
TEST(Experiments, LoopGainsShrinkAndTiltTheCircle) {
  Experiment e = experiment(Showing::circle, kX, ideal_machine());
  for (const std::size_t axis : {kX, kY}) {
    e.machine.axes[axis].servo.velocity_ff = 0;
    e.machine.axes[axis].servo.acceleration_ff = 0;
  }
  e.machine.axes[kY].servo.kv_per_s = 38;
  const Curve lap = curves(e, observe(e), Quantity::machine_error).at(0);
  // Each axis lags by 1/Kv: x = R cos(wt - w/Kx), y = R sin(wt - w/Ky), to second order in w/K; the
  // 45 deg harmonic is R w (1/Kx - 1/Ky) / 2 in first order.
  const double R = 25e-3, w = 50e-3 / R;
  EXPECT_NEAR(std::abs(harmonic(lap, 2).sine), R * w * (1 / 38.0 - 1 / 40.0) / 2,
              0.02 * R * w * (1 / 38.0 - 1 / 40.0) / 2);
}

TEST(Experiments, TheSameSeedGivesTheSameRowsInAnyThread) {
  const Experiment e = experiment(Showing::circle, kX, ideal_machine());
  Observation here, there;
  std::jthread thread([&] { there = observe(e, 7); });
  here = observe(e, 7);
  thread.join();
  EXPECT_EQ(here.nc.end.trace_hash, there.nc.end.trace_hash);
  EXPECT_EQ(here.rows.size(), there.rows.size());
}

class EveryEffect : public testing::TestWithParam<const EffectText*> {};

TEST_P(EveryEffect, ShowsInItsDemonstration) {
  const Demonstration d = demonstration(GetParam()->name, ideal_machine());
  EXPECT_EQ(d.text, GetParam());
  EXPECT_FALSE(d.setting.empty());
  EXPECT_NE(to_toml(d.with.machine), to_toml(d.without.machine)) << "the effect is switched on";
  EXPECT_EQ(d.with.program, d.without.program);
  const Observation without = observe(d.without), with = observe(d.with);
  EXPECT_TRUE(without.clean()) << without.nc.end.reason;
  const auto before = curves(d.without, without, d.quantity);
  const auto after = curves(d.with, with, d.quantity);
  const std::vector<Reading> read = readings(d, before, after);
  ASSERT_FALSE(read.empty());
  EXPECT_GT(std::abs(read.front().si), 1e-10) << read.front().name;
}

/// Every fourth one under a sanitizer.
std::vector<const EffectText*> demonstrated() {
  std::vector<const EffectText*> some;
  const std::vector<const EffectText*> all = all_effect_texts();
  for (std::size_t i = 0; i < all.size(); i += kSanitized ? 4 : 1) some.push_back(all[i]);
  return some;
}

INSTANTIATE_TEST_SUITE_P(Demonstrations, EveryEffect, testing::ValuesIn(demonstrated()),
                         [](const auto& effect) { return std::string(effect.param->name); });

TEST(Demonstrations, AnUnknownEffectIsRefusedWithASuggestion) {
  try {
    demonstration("baklash", ideal_machine());
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean backlash?"), std::string::npos) << e.what();
  }
}

TEST(Gallery, PageHoldsTheEntryWithoutAPicture) {
  std::vector<GalleryEntry> entries;
  entries.push_back(gallery_entry("backlash", ideal_machine(), false));
  const std::string page = gallery_page(entries, ideal_machine(), "No figures: <test>.");
  EXPECT_NE(page.find(kGalleryMark), std::string::npos);
  EXPECT_NE(page.find("id=\"backlash\""), std::string::npos);
  EXPECT_NE(page.find("step at the reversal"), std::string::npos);
  EXPECT_NE(page.find("No figures: &lt;test&gt;."), std::string::npos);
  EXPECT_EQ(page.find("<svg"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos) << "self-contained";
}

}  // namespace
}  // namespace vcnc::experiments_test
