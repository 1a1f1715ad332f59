// Compensation on the whole machine: an effect is injected, measured by the probe, compensated by
// the setting that belongs to it, measured again; and once more with the setting's sign turned.
#include "controller/compensation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "apps/compensation_effect.hpp"
#include "apps/compensation_for.hpp"
#include "configs/config.hpp"
#include "model/effects/numbers.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc::compensation_test {
namespace {

constexpr double kUm = 1e-6, kRadius = 25e-3;  // of the circles
constexpr double kFeed = 50e-3;                // of the circles [m/s], F3000

using Wall = ExperimentOptions::Wall;

struct Case {
  const char* name;
  std::function<void(Machine&)> inject;
  Showing showing;
  std::size_t axis = kX;
  ExperimentOptions options{};
  double (*size)(const Curve&);
  double before;          ///< size of the effect's error, from its equation [m]
  double within;          ///< how well that is met, share
  double after;           ///< what may be left, share of before
  double wrong;           ///< with the wrong sign at least this many times before
  double transition = 0;  ///< declared [s]
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

ExperimentOptions guide() {
  ExperimentOptions o;
  o.wall = Wall::guide;
  return o;
}
ExperimentOptions at_feed(double mm_min) {
  ExperimentOptions o;
  o.feed_mm_min = mm_min;
  return o;
}

/// Everything with the other sign.
CompensationParams turned(CompensationParams c) {
  for (AxisCompensation& axis : c.axes) {
    axis.backlash = -axis.backlash;
    axis.scale = -axis.scale;
    axis.lead = -axis.lead;
    axis.friction.amplitude = -axis.friction.amplitude;
    axis.friction.least = -axis.friction.least;
  }
  c.squareness = {-c.squareness.xy, -c.squareness.xz, -c.squareness.yz};
  for (CompensationTable& table : c.tables)
    for (std::vector<double>* errors : {&table.error, &table.error_reverse})
      for (double& e : *errors) e = -e;
  return c;
}

/// Of the worst pass.
double worst(const std::vector<Curve>& passes, double (*size)(const Curve&)) {
  double most = 0;
  for (const Curve& pass : passes) most = std::max(most, size(pass));
  return most;
}

class EveryKind : public testing::TestWithParam<Case> {};

TEST_P(EveryKind, IsTakenOffAndDoublesWithTheWrongSign) {
  const Case& c = GetParam();
  Machine machine = ideal_machine();
  c.inject(machine);
  const CompensationProposal proposal = compensation_for(machine);
  ASSERT_TRUE(std::all_of(proposal.remarks.begin(), proposal.remarks.end(),
                          [](const CompensationRemark& r) { return r.compensated; }));
  const auto measure = [&](const CompensationParams& settings) {
    Machine with = machine;
    with.nc.compensation = settings;
    for (AxisCompensation& axis : with.nc.compensation.axes) axis.transition = c.transition;
    return worst(machine_error(c.showing, c.axis, with, c.options), c.size);
  };
  const double before = measure({}), after = measure(proposal.settings),
               wrong = measure(turned(proposal.settings));
  std::printf("%-22s before %7.3f um, after %7.3f um, wrong sign %7.3f um\n", c.name, before / kUm,
              after / kUm, wrong / kUm);
  EXPECT_NEAR(before, c.before, c.within * c.before);
  EXPECT_LT(after, c.after * before);
  EXPECT_GT(wrong, c.wrong * before);
}

template <class Effect>
Effect& of(Machine& m, std::size_t axis) {
  return m.effects.axis[axis].get<Effect>();
}

/// The C axis turns a point 30 mm off its centre along the normal of the wall.
ExperimentOptions along_y() {
  ExperimentOptions o;
  o.normal = Vec3::UnitY();
  return o;
}

/// 400 N of dry friction of X.
Case rubbing(const char* name, std::function<void(Machine&)> inject) {
  return {name, std::move(inject), Showing::circle, kX, {}, max_abs, 2.95 * kUm, 0.05, 0.1, 1.8};
}

constexpr double kHalfGap = 12 * kUm / 2;  ///< half a gap
const double kRms = std::sqrt(0.5);        ///< of |cos| on a circle

// Friction of 400 N on 3242 kg: the largest value of dF/J L^-1 of 1/((s + 38.2)(s + 196)(s + 269)),
// the poles of the loop in apps/compensation_for.hpp, is 2.95 um.
INSTANTIATE_TEST_SUITE_P(
    Compensation, EveryKind,
    testing::Values(
        Case{"pitch_periodic",
             [](Machine& m) {
               of<PitchPeriodic>(m, kX) = {4 * kUm, 10e-3, 0.7};
             },
             Showing::line,
             kX,
             {},
             max_abs,
             4 * kUm,
             0.02,
             0.01,
             1.95},
        Case{"pitch_progressive",
             [](Machine& m) {
               of<PitchProgressive>(m, kY) = {.quadratic = 20 * kUm / 0.01, .cubic = 0};
             },
             Showing::line,
             kY,
             {},
             max_abs,
             20 * kUm * 0.4 * 0.4,
             0.02,
             0.01,
             1.95},
        Case{"scale_error",
             [](Machine& m) { of<ScaleError>(m, kX).error = 100e-6; },
             Showing::circle,
             kX,
             {},
             max_abs,
             100e-6 * kRadius,
             0.02,
             0.01,
             1.95},
        Case{"lead_error",
             [](Machine& m) {
               m.axes[kX].servo.feedback = ServoParams::Feedback::motor;
               of<LeadError>(m, kX).error = 100e-6;
             },
             Showing::circle,
             kX,
             {},
             max_abs,
             100e-6 * kRadius,
             0.02,
             0.01,
             1.95},
        Case{"squareness",
             [](Machine& m) { m.effects.get<Squareness>() = {.xy = 200e-6, .xz = 0, .yz = 0}; },
             Showing::circle,
             kX,
             {},
             max_abs,
             200e-6 * kRadius / 2,
             0.02,
             0.01,
             1.95},
        Case{"straightness", [](Machine& m) { of<Straightness>(m, kX) = {.first_bow = 50 * kUm}; },
             Showing::line, kX, guide(), max_abs, 50 * kUm * 0.4 * 0.4, 0.02, 0.01, 1.95},
        Case{"lateral_play", [](Machine& m) { of<LateralPlay>(m, kX).first = 8 * kUm; },
             Showing::line, kX, guide(), rms, 4 * kUm, 0.02, 0.1, 1.9},
        Case{"backlash",
             [](Machine& m) {
               m.axes[kX].servo.feedback = ServoParams::Feedback::motor;
               of<Backlash>(m, kX).gap = 12 * kUm;
               of<Coulomb>(m, kX).level = 50;
             },
             Showing::circle, kX, at_feed(1500), rms, kHalfGap* kRms, 0.03, 0.1, 1.9},
        Case{"load_play", [](Machine& m) { of<LoadPlay>(m, kY).width = 12 * kUm; }, Showing::circle,
             kY, at_feed(1500), rms, kHalfGap* kRms, 0.03, 0.05, 1.9},
        Case{"load_play_quickly", [](Machine& m) { of<LoadPlay>(m, kY).width = 12 * kUm; },
             Showing::circle, kY, at_feed(1500), rms, kHalfGap* kRms, 0.03, 0.01, 1.9, 7e-3},
        Case{"lost_motion",
             [](Machine& m) {
               of<LostMotion>(m, kX).compliance = 10e-9;
               of<Coulomb>(m, kX).level = 250;
             },
             Showing::circle,
             kX,
             {},
             rms,
             2.5 * kUm* kRms,
             0.1,
             0.35,
             1.9},
        rubbing("friction", [](Machine& m) { of<Coulomb>(m, kX).level = 400; }),
        rubbing("motor_friction", [](Machine& m) { of<MotorFriction>(m, kX).level = 400; }),
        Case{"command_delay",
             [](Machine& m) { of<CommandDelay>(m, kX).delay = 0.4e-3; },
             Showing::circle,
             kX,
             {},
             max_abs,
             0.5 * kFeed * 0.4e-3,
             0.02,
             0.01,
             1.95},
        Case{"load_encoder_latency",
             [](Machine& m) { of<LoadEncoderLatency>(m, kX).latency = 0.4e-3; },
             Showing::circle,
             kX,
             {},
             max_abs,  // a circle that the loop makes larger by t_d w^2/Kv stays
             0.5 * kFeed * 0.4e-3,
             0.06,
             0.1,
             1.95},
        Case{"velocity_ff_error",
             [](Machine& m) { of<VelocityFfError>(m, kY).deviation = -0.03; },
             Showing::circle,
             kY,
             {},
             max_abs,
             0.5 * kFeed * 0.03 / 40,
             0.06,
             0.12,
             1.9},
        Case{"encoder_eccentricity",
             [](Machine& m) {
               of<EncoderEccentricity>(m, kC) = {.amplitude = 30 * unit::arcsec.to_si,
                                                 .phase = 0.4};
             },
             Showing::spin, kC, along_y(), max_abs, 30 * unit::arcsec.to_si * 30e-3, 0.05, 0.02,
             1.9},
        Case{"transmission_error",
             [](Machine& m) {
               m.axes[kX].servo.feedback = ServoParams::Feedback::motor;
               of<TransmissionError>(m, kX) = {4 * kUm, 10e-3, 0.4};
             },
             Showing::line,
             kX,
             {},
             max_abs,
             4 * kUm,
             0.02,
             0.02,
             1.95},
        Case{"load_encoder_error",
             [](Machine& m) {
               of<LoadEncoderError>(m, kY) = {4 * kUm, 20e-3, 0.4};
             },
             Showing::line, kY, at_feed(300), max_abs, 4 * kUm, 0.02, 0.06, 1.95}),
    [](const auto& one) { return std::string(one.param.name); });

/// Numbers that a diagnosis fitted and that came out as they were are no work for the control.
TEST(CompensationFor, LeavesOutWhatIsNextToNothing) {
  Machine machine = ideal_machine();
  of<ScaleError>(machine, kX).error = 0.07e-6;
  of<ScaleError>(machine, kY).error = 7e-6;
  const double load = machine.axes[kX].mechanics.load;
  machine.effects.deviations = {{"axes.X.load_kg", load * (1 + 1e-6)},
                                {"axes.Y.load_kg", 1.1 * machine.axes[kY].mechanics.load}};
  const CompensationProposal proposal = compensation_for(machine);
  std::string told;
  for (const CompensationRemark& r : proposal.remarks)
    told += r.effect + (r.compensated ? "+ " : "- ");
  EXPECT_EQ(told, "X.scale_error- Y.scale_error+ axes.Y.load_kg- ");
  EXPECT_EQ(proposal.settings.axes[kX].scale, 0);
  EXPECT_EQ(proposal.settings.axes[kY].scale, 7e-6);
}

// ---------------------------------------------------------------------------------- the NC unit

const char* const kSquare = "G54 G90 G17 G21 G94 G49\nG64 P0.02\nG1 X20 F3000\nY20\nX0\nY0\nM30\n";

Machine free_machine() {
  Machine machine = ideal_machine();
  machine.probe.in_spindle = false;
  return machine;
}

TEST(CompensatedRun, RecordsPositionsOfTheProgramBothCommandedAndMeasured) {
  Machine machine = free_machine();
  const Outcome plain = play(machine, kSquare);
  machine.nc.compensation.axes[kX].backlash = 40 * kUm;
  machine.nc.compensation.squareness.xy = 500e-6;
  machine.nc.compensation.axes[kY].scale = 1e-3;
  const Outcome set = play(machine, kSquare);
  ASSERT_TRUE(plain.nc.end.complete) << plain.nc.end.reason;
  ASSERT_EQ(plain.rows.size(), set.rows.size());
  EXPECT_NE(plain.nc.end.trace_hash, set.nc.end.trace_hash);
  for (std::size_t k = 0; k < set.rows.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      ASSERT_EQ(set.rows[k].q_cmd[i], plain.rows[k].q_cmd[i]) << "row " << k;
      ASSERT_NEAR(set.rows[k].q_act[i], plain.rows[k].q_act[i], 0.2 * kUm) << "row " << k;
    }
}

TEST(CompensatedRun, ATableOfZerosChangesNoBit) {
  Machine machine = free_machine();
  const Outcome plain = play(machine, kSquare);
  CompensationTable zeros;
  zeros.at = {-1, 1};
  zeros.error = {0, 0};
  machine.nc.compensation.tables = {zeros};
  EXPECT_EQ(play(machine, kSquare).nc.end.trace_hash, plain.nc.end.trace_hash);
}

TEST(CompensatedRun, SetPointsStayWithinTheTravel) {
  Machine machine = free_machine();
  machine.axes[kX].limits.max = 20e-3;
  machine.nc.compensation.axes[kX].backlash = 100 * kUm;
  machine.axes[kX].limits.switch_distance = 20 * kUm;
  const Outcome o = play(machine, kSquare);
  EXPECT_TRUE(o.nc.end.complete) << o.nc.end.reason;
}

// ------------------------------------------------------------------------------- the settings

TEST(CompensationFor, NamesWhatItCannotCompensateWithTheReason) {
  Machine machine = ideal_machine();
  of<Backlash>(machine, kX).gap = 10 * kUm;  // measuring system on the load
  machine.effects.get<PieceOffset>() = PieceOffset::nominal();
  of<Cogging>(machine, kY) = Cogging::nominal(false);
  machine.effects.deviations.push_back({"axes.Y.load_kg", 480});
  machine.effects.laws.emplace_back();
  machine.effects.laws.back().at = {0, 1};
  machine.effects.laws.back().value = {0, 1};
  const CompensationProposal proposal = compensation_for(machine);
  ASSERT_EQ(proposal.remarks.size(), 5u);
  for (const CompensationRemark& remark : proposal.remarks) {
    EXPECT_FALSE(remark.compensated) << remark.effect;
    EXPECT_FALSE(remark.text.empty()) << remark.effect;
  }
  machine.nc.compensation = proposal.settings;
  EXPECT_TRUE(CompensationRules(machine).empty());
}

TEST(CompensationFor, EveryEffectOfTheListHasAnAnswerOrAReasonAndTheFileCanBeRead) {
  for_each_effect([]<class Effect>(std::type_identity<Effect>) {
    Machine machine = ideal_machine();
    if constexpr (of_axis(Effect::place)) {
      const std::size_t axis = fits(Effect::place, false) ? kX : kC;
      machine.effects.axis[axis].get<Effect>() = nominal_of<Effect>(is_rotary(axis));
      machine.axes[axis].servo.feedback = ServoParams::Feedback::motor;
    } else {
      machine.effects.get<Effect>() = nominal_of<Effect>(false);
    }
    const CompensationProposal proposal = compensation_for(machine);
    ASSERT_EQ(proposal.remarks.size(), 1u) << Effect::text.name;
    EXPECT_FALSE(proposal.remarks.front().text.empty()) << Effect::text.name;
    machine.nc.compensation = proposal.settings;
    const std::string written = to_toml(machine);
    EXPECT_EQ(to_toml(parse_machine(written, "written.toml")), written) << Effect::text.name;
    EXPECT_EQ(CompensationRules(machine).empty(), !proposal.remarks.front().compensated)
        << Effect::text.name;
  });
}

TEST(CompensationFor, ALeadCountsAllThatMakesAnAxisLate) {
  Machine machine = ideal_machine();
  machine.axes[kX].servo.velocity_ff = 0.9;
  of<CommandDelay>(machine, kX).delay = 0.3e-3;
  of<BusLatency>(machine, kX).cycles = 1;
  of<VelocityFfError>(machine, kX).deviation = -0.02;
  machine.effects.deviations.push_back({"axes.X.kv_per_s", 50});
  const double lead = compensation_for(machine).settings.axes[kX].lead;
  EXPECT_NEAR(lead, 0.3e-3 + 1e-3 + 0.12 / 50, 1e-12);
}

TEST(CompensationFor, AxesThatLagTooLongAreBroughtToOneLag) {
  Machine machine = ideal_machine();
  for (const std::size_t i : {kX, kY}) machine.axes[i].servo.velocity_ff = 0;
  machine.axes[kY].servo.kv_per_s = 38;
  const PerAxis<AxisCompensation> axes = compensation_for(machine).settings.axes;
  EXPECT_NEAR(axes[kY].lead, 5e-3, 1e-15);
  EXPECT_NEAR(axes[kY].lead - axes[kX].lead, 1.0 / 38 - 1.0 / 40, 1e-12);
}

TEST(CompensationFor, MeasuredMachineGainsOnCirclesAndOnTheSPiece) {
  const Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion_measured.toml");
  for (const PassComparison& pass :
       compare_compensation(machine, compensation_for(machine).settings)) {
    std::printf("%-8s %-16s rms %6.2f -> %5.2f um, largest %6.2f -> %5.2f um\n",
                pass.motion.c_str(), pass.pass.c_str(), pass.before.rms / kUm, pass.after.rms / kUm,
                pass.before.largest / kUm, pass.after.largest / kUm);
    EXPECT_LT(pass.after.rms, 0.4 * pass.before.rms) << pass.motion;
    EXPECT_LT(pass.after.largest, 0.5 * pass.before.largest) << pass.motion;
  }
}

TEST(CompensationFor, ALawOverAPositionIsATable) {
  Machine machine = ideal_machine();
  Law law;
  law.point = Law::Point::displacement;
  law.over = Covariate::position;
  law.over_axis = law.times_axis = Law::OfAxis::Y;
  law.times = Covariate::sign;
  law.at = {-0.1, 0, 0.1};
  law.value = {1 * kUm, 2 * kUm, -3 * kUm};
  machine.effects.laws = {law};
  const CompensationProposal proposal = compensation_for(machine);
  ASSERT_EQ(proposal.settings.tables.size(), 1u);
  const CompensationTable& table = proposal.settings.tables[0];
  EXPECT_EQ(table.axis_index(), kX);
  EXPECT_EQ(table.over_index(), kY);
  EXPECT_EQ(table.error, law.value);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(table.error_reverse[i], -law.value[i]);
  // One way only: nothing the other way.
  const std::vector<double> none(3, 0.0);
  for (const bool forwards : {true, false}) {
    machine.effects.laws[0].times = forwards ? Covariate::forwards : Covariate::backwards;
    const CompensationTable one_way = compensation_for(machine).settings.tables.at(0);
    EXPECT_EQ(one_way.error, forwards ? law.value : none);
    EXPECT_EQ(one_way.error_reverse, forwards ? none : law.value);
  }
}

/// The pulse of the closed form against the friction step it is meant for: the integral over it is
/// what the integrator of the velocity loop has to gather, dF Ti / Kp, and it starts from zero.
TEST(CompensationFor, ThePulseCarriesTheImpulseThatTheIntegratorNeeds) {
  constexpr double kStep = 800, kInertia = 3242, kTi = 10e-3, kKv = 40;
  const double crossover = 2 * kPi * 80;
  const ReversalPulse p = pulse_against(kStep, kInertia, crossover, kTi, kKv);
  EXPECT_GT(p.decay, p.rise);
  EXPECT_NEAR(p.amplitude * (p.decay - p.rise), kStep * kTi / (kInertia * crossover),
              0.06 * kStep * kTi / (kInertia * crossover));
  // Its slope at the beginning is the acceleration dF/J.
  EXPECT_NEAR(p.amplitude * (1 / p.rise - 1 / p.decay), kStep / kInertia, 1e-9);
}

}  // namespace
}  // namespace vcnc::compensation_test
