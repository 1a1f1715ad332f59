// Laws and deviations through the drive and the probe module as they run in the machine.
#include "model/effects/law.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>

#include "configs/config.hpp"
#include "model/drive/axis_drive.hpp"
#include "probe_sim/probe_node.hpp"

namespace vcnc::law_test {
namespace {

constexpr double kCycleTime = 1e-3, kLoop = 100e-6;

Machine with_law(const std::string& law, const std::string& rest = "") {
  return parse_machine(rest + "\n[[effects.law]]\n" + law, "m");
}

std::string constant(const char* axis, const char* point, const char* key, double value) {
  return fmt::format("axis = \"{}\"\npoint = \"{}\"\nat_s = [0]\nvalue_{} = [{}]\n", axis, point,
                     key, value);
}

/// True positions of an axis that is told to stand still, at the ends of all loop steps.
std::vector<double> standing(AxisDrive& drive, double seconds) {
  std::vector<double> all;
  for (int k = 0; k < seconds / kCycleTime; ++k)
    for (const double x : drive.hold().truth) all.push_back(x);
  return all;
}

/// The rigid axis under a step of force F on the table at t = 0, in continuous time. With w = Kp/J
/// and the observer's triple pole at -o (o = 4 w), which takes some of F for motion at first:
///   x / F = ((s + o)^3 + w (s + 1/Ti)(s + 3 o))
///           / (J (s + o)^3 (s^3 + w s^2 + w (Kv + 1/Ti) s + w Kv/Ti))
/// as the sum over its poles; the triple one is spread by 1 % to be summed like the others.
class LoadStep {
 public:
  LoadStep(const AxisParams& axis, double force)
      : share_(force / axis.mechanics.total_inertia()),
        w_(2 * kPi * axis.servo.velocity_bandwidth),
        o_(4 * w_),
        ti_(axis.servo.integral_time) {
    const double c = w_ * (axis.servo.kv_per_s + 1 / ti_), d = w_ * axis.servo.kv_per_s / ti_;
    poles_ = {
        {{-w_, 0.3}, {-0.1 * w_, 0.5 * w_}, {-0.2 * w_, -0.4 * w_}, -o_, -0.99 * o_, -1.01 * o_}};
    for (int i = 0; i < 500; ++i)  // Durand-Kerner on the cubic
      for (std::size_t k = 0; k < 3; ++k) {
        const Complex p = poles_[k];
        poles_[k] -= (((p + w_) * p + c) * p + d) / product(k, 3);
      }
  }
  double operator()(double t) const {
    Complex x = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      const Complex p = poles_[k], n = p + o_;
      x += (n * n * n + w_ * (p + 1 / ti_) * (p + 3 * o_)) * std::exp(p * t) / product(k, 6);
    }
    return share_ * x.real();
  }

 private:
  using Complex = std::complex<double>;
  /// Of the differences of a pole to the others among the first `count`.
  Complex product(std::size_t k, std::size_t count) const {
    Complex all = 1;
    for (std::size_t j = 0; j < count; ++j)
      if (j != k) all *= poles_[k] - poles_[j];
    return all;
  }
  double share_, w_, o_, ti_;
  std::array<Complex, 6> poles_;
};

// ---------------------------------------------------------------------- the points of a drive

class ForceLaw : public testing::TestWithParam<const char*> {};

/// On a rigid axis a force of the motor and one on the table are the same.
TEST_P(ForceLaw, DeflectsTheAxisUntilTheIntegralHasTakenOver) {
  const Machine machine =
      with_law(constant("X", GetParam(), "N", 800),
               "[axes.X]\nvelocity_bandwidth_Hz = 20\nkv_per_s = 10\nintegral_time_ms = 50\n");
  AxisDrive drive(machine, kX, 1);
  const std::vector<double> truth = standing(drive, 2.0);
  const LoadStep expected(machine.axes[kX], 800);
  double worst = 0, peak = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double t = static_cast<double>(i + 1) * kLoop;
    peak = std::max(peak, expected(t));
    worst = std::max(worst, std::abs(truth[i] - expected(t)));
  }
  EXPECT_GT(peak, 50e-6);
  // Limited by the steps of 100 us, which the closed form does not have.
  EXPECT_LT(worst, 2e-3 * peak);
  EXPECT_NEAR(*std::max_element(truth.begin(), truth.end()), peak, 2e-3 * peak);
  EXPECT_NEAR(truth.back(), 0, 1e-9);
}

/// The integral of the deflection is F Ti / (Kp Kv): what the integral needed to hold F.
TEST_P(ForceLaw, LeavesTheAreaThatTheIntegralNeeds) {
  const Machine machine =
      with_law(constant("X", GetParam(), "N", 800),
               "[axes.X]\nvelocity_bandwidth_Hz = 100\nintegral_time_ms = 100\n");
  AxisDrive drive(machine, kX, 1);
  double area = 0;
  for (const double x : standing(drive, 3.0)) area += x * kLoop;
  const double w = 2 * kPi * 100, kp = w * machine.axes[kX].mechanics.total_inertia();
  // The observer takes 3 / (4 w)^2 of the force for motion until it knows the disturbance.
  const double observer = 1 + 3 / (16 * w * 0.1);
  EXPECT_NEAR(area, 800 * 0.1 / (kp * 40) * observer, 5e-4 * area);
}

/// Without integral action (Ti = 10 s) the stiffness of the loop is Kp Kv.
TEST_P(ForceLaw, MeetsTheStiffnessOfTheLoop) {
  const Machine machine =
      with_law(constant("X", GetParam(), "N", 800), "[axes.X]\nintegral_time_ms = 10000\n");
  AxisDrive drive(machine, kX, 1);
  const std::vector<double> truth = standing(drive, 0.5);
  const double kp = 2 * kPi * 80 * machine.axes[kX].mechanics.total_inertia();
  const double static_deflection = 800 / (kp * 40);
  EXPECT_NEAR(truth.back(), LoadStep(machine.axes[kX], 800)(0.5), 1e-3 * static_deflection);
  // The integral fades it with Ti + 1/Kv: 5 % in half a second.
  EXPECT_NEAR(truth.back(), static_deflection * std::exp(-0.05), 5e-3 * static_deflection);
}

INSTANTIATE_TEST_SUITE_P(Points, ForceLaw, testing::Values("table_force", "motor_force"),
                         [](const auto& test) { return std::string(test.param); });

/// Between motor and load is a spring: only what pushes the table winds it up.
TEST(Law, TableForceWindsTheTransmissionUpAndMotorForceDoesNot) {
  const auto twist = [](const char* point) {
    const Machine machine =
        with_law(constant("X", point, "N", 800),
                 "[axes.X]\nfeedback = \"motor\"\n[effects.X.windup]\ncompliance_nm_per_N = 10\n");
    AxisDrive drive(machine, kX, 1);
    AxisCycle last;
    for (int k = 0; k < 2000; ++k) last = drive.hold();
    return last;
  };
  const AxisCycle table = twist("table_force"), motor = twist("motor_force");
  EXPECT_NEAR(table.second, 800 * 10e-9, 1e-11);
  EXPECT_NEAR(table.measured, 0, 1e-9);
  EXPECT_NEAR(table.force * 4e4, -800, 1e-3);
  EXPECT_NEAR(motor.second, 0, 1e-11);
  EXPECT_NEAR(motor.force * 4e4, -800, 1e-3);
}

TEST(Law, DisplacementMovesTheToolAndNotTheLoop) {
  const Machine machine = with_law(constant("X", "displacement", "um", 12.5));
  AxisDrive with(machine, kX, 1), without(declared(machine), kX, 1);
  for (int k = 1; k <= 200; ++k) {
    const AxisSetpoint target{1e-4 * k, 0.1};
    const AxisCycle a = with.follow(target), b = without.follow(target);
    EXPECT_EQ(a.measured, b.measured);
    EXPECT_EQ(a.force, b.force);
    for (std::size_t i = 0; i < a.truth.size(); ++i)
      EXPECT_NEAR(a.truth[i] - b.truth[i], 12.5e-6, 1e-16);
  }
}

TEST(Law, CommandMovesTheAxisByItsValue) {
  const Machine machine = with_law(constant("A", "command", "arcsec", 7));
  AxisDrive drive(machine, kA, 1);
  AxisCycle last;
  for (int k = 0; k < 1000; ++k) last = drive.hold();
  EXPECT_NEAR(last.measured, 7 * kDegree / 3600, 1e-12);
  EXPECT_NEAR(last.truth[9], 7 * kDegree / 3600, 1e-12);
}

TEST(Law, CommandTimeMakesTheAxisLagByItsSpeed) {
  const Machine machine = with_law(constant("X", "command_time", "us", 250));
  AxisDrive with(machine, kX, 1), without(declared(machine), kX, 1);
  double lag = 0;
  for (int k = 1; k <= 1000; ++k) {
    const AxisSetpoint target{2e-4 * k, 0.2};
    lag = without.follow(target).measured - with.follow(target).measured;
  }
  EXPECT_NEAR(lag, 0.2 * 250e-6, 1e-12);
}

/// While accelerating the set-point is exactly the one of the earlier time.
TEST(Law, CommandTimeKnowsTheAcceleration) {
  constexpr double a = 2, late = 300e-6;
  Law law;
  law.point = Law::Point::command_time;
  law.at = {0};
  law.value = {late};
  const Motions<double> none{};
  for (const double t : {0.1, 0.2, 0.37}) {
    SetpointPort::Signal<double> signal{0.5 * a * t * t, a * t};
    apply_law(law, signal, {{t, kLoop, 0}, a, &none});
    EXPECT_NEAR(signal.position, 0.5 * a * (t - late) * (t - late), 1e-16);
    EXPECT_NEAR(signal.velocity, a * (t - late), 1e-16);
  }
}

/// A recorded disturbance: piecewise linear over time, constant beyond its ends.
TEST(Law, ATimeSeriesActsAtItsTimes) {
  const Machine machine = with_law(
      "axis = \"X\"\npoint = \"displacement\"\nat_s = [0.01, 0.02, 0.05]\nvalue_um = [1, 5, -3]\n");
  AxisDrive drive(machine, kX, 1);
  const auto expected = [](double t) {
    if (t <= 0.01) return 1.0;
    if (t <= 0.02) return 1 + 4 * (t - 0.01) / 0.01;
    if (t <= 0.05) return 5 - 8 * (t - 0.02) / 0.03;
    return -3.0;
  };
  const std::vector<double> truth = standing(drive, 0.08);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_NEAR(truth[i], 1e-6 * expected(static_cast<double>(i + 1) * kLoop), 1e-18) << i;
}

/// Friction that depends on the position: -sgn(v) f(q) on the table.
TEST(Law, SignOfTheVelocityTimesAFunctionOfThePosition) {
  const Machine machine = with_law(
      "axis = \"X\"\npoint = \"table_force\"\nover = \"position\"\nover_axis = \"X\"\n"
      "at_mm = [10, 20, 50, 60]\nvalue_N = [-100, -300, -300, -200]\ntimes = \"sign\"\n"
      "times_axis = \"X\"\n");
  AxisDrive drive(machine, kX, 1);
  double position = 0;
  const auto force_at = [&](double target, double speed) {
    AxisCycle last;
    while ((target - position) * speed > 1e-9) {
      position += speed * kCycleTime;
      last = drive.follow({position, speed});
    }
    return last.force * 4e4;
  };
  EXPECT_NEAR(force_at(8e-3, 0.02), 100, 0.01);
  EXPECT_NEAR(force_at(48e-3, 0.02), 300, 0.01);
  EXPECT_NEAR(force_at(90e-3, 0.02), 200, 0.01);
  drive.hold();
  EXPECT_NEAR(force_at(70e-3, -0.02), -200, 0.01);
  EXPECT_NEAR(force_at(22e-3, -0.02), -300, 0.01);
  EXPECT_NEAR(force_at(0e-3, -0.02), -100, 0.01);
}

TEST(Law, OneWayOnly) {
  for (const auto& [way, forwards, backwards] :
       {std::tuple{"forwards", 100.0, 0.0}, {"backwards", 0.0, 100.0}}) {
    const Machine machine = with_law(
        fmt::format("axis = \"X\"\npoint = \"table_force\"\nat_s = [0, 1]\nvalue_N = [-100, "
                    "-100]\ntimes = \"{}\"\ntimes_axis = \"X\"\n",
                    way));
    AxisDrive drive(machine, kX, 1);
    double position = 0, force = 0;
    for (int k = 0; k < 500; ++k) {
      position += 0.02 * kCycleTime;
      force = drive.follow({position, 0.02}).force;
    }
    EXPECT_NEAR(force * 4e4, forwards, 0.01) << way;
    drive.hold();
    for (int k = 0; k < 500; ++k) {
      position -= 0.02 * kCycleTime;
      force = drive.follow({position, -0.02}).force;
    }
    EXPECT_NEAR(force * 4e4, backwards, 0.01) << way;
  }
}

/// The drive of X hears where Y is commanded to be.
TEST(Law, AnotherAxisAsCovariate) {
  const Machine machine = with_law(
      "axis = \"X\"\npoint = \"displacement\"\nover = \"position\"\nover_axis = \"Y\"\n"
      "at_mm = [-100, 100]\nvalue_um = [-20, 20]\n");
  AxisDrive drive(machine, kX, 1);
  drive.tell_commands({}, {});
  drive.hold();
  for (int k = 1; k <= 100; ++k) {
    AxisVector position{}, velocity{};
    position[kY] = 1e-4 * k;
    velocity[kY] = 0.1;
    drive.tell_commands(position, velocity);
    const AxisCycle cycle = drive.hold();
    for (std::size_t i = 0; i < cycle.truth.size(); ++i) {
      const double y = 1e-4 * (k - 1) + 1e-5 * static_cast<double>(i + 1);
      EXPECT_NEAR(cycle.truth[i], 2e-4 * y, 1e-15) << k << " " << i;
    }
  }
}

TEST(Law, TheOtherAxesVelocityAndAccelerationAreCommandedOnes) {
  const std::string law =
      "axis = \"X\"\npoint = \"displacement\"\nover = \"{}\"\nover_axis = \"C\"\n"
      "at_deg_s{} = [0, 90]\nvalue_um = [0, 9]\n";
  const Machine velocity = with_law(fmt::format(fmt::runtime(law), "velocity", "")),
                acceleration = with_law(fmt::format(fmt::runtime(law), "acceleration", "2"));
  AxisDrive v(velocity, kX, 1), a(acceleration, kX, 1);
  AxisCycle with_v, with_a;
  for (int k = 1; k <= 50; ++k) {
    const double t = kCycleTime * k;
    AxisVector q{}, dq{};
    q[kC] = 0.5 * kDegree * 30 * t * t;
    dq[kC] = kDegree * 30 * t;
    v.tell_commands(q, dq);
    a.tell_commands(q, dq);
    with_v = v.hold();
    with_a = a.hold();
  }
  EXPECT_NEAR(with_v.truth[0], 0.1e-6 * 30 * 0.0491, 1e-15);
  EXPECT_NEAR(with_a.truth[0], 0.1e-6 * 30, 1e-15);
}

// -------------------------------------------------------------------------------- the probe

/// Readings of a probe module whose axes go from where they are to q within a cycle.
class ProbeBench {
 public:
  explicit ProbeBench(const Machine& machine, std::unique_ptr<Piece> piece = nullptr)
      : truth_(open_local_truth()), node_(machine, std::move(piece), 1, *truth_) {
    for (std::size_t i = 0; i < kAxisCount; ++i) q_[i] = machine.axes[i].limits.start;
  }

  ProbeSample at(const AxisVector& q) {
    if (k_ > 0)
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        TruthCycle cycle{.tick = k_ - 1};
        for (std::size_t j = 0; j < cycle.position.size(); ++j)
          cycle.position[j] = q_[i] + (q[i] - q_[i]) * 0.1 * static_cast<double>(j + 1);
        truth_->publish(i, cycle);
      }
    if (k_ > 0) q_ = q;
    Frames out;
    node_.step(k_++, {}, out);
    return decode_probe_sample(out.at(0)).value();
  }

 private:
  std::unique_ptr<TruthPort> truth_;
  ProbeNode node_;
  AxisVector q_{};
  Tick k_ = 0;
};

TEST(Law, ReadingIsAddedToTheProbesSample) {
  const std::string z =
      "\n[[effects.law]]\naxis = \"Z\"\npoint = \"reading\"\nover = \"position\"\n"
      "over_axis = \"A\"\nat_deg = [0, 10]\nvalue_um = [0, 50]\n";
  ProbeBench with(with_law(constant("Y", "reading", "um", 123.4) + z)), without(Machine{});
  for (int k = 0; k < 20; ++k) {
    const double a = 0.4 * kDegree * k;
    const AxisVector q{0, 0, 0, a, 0};
    const ProbeSample x = with.at(q), y = without.at(q);
    const double turned = k == 0 ? 0 : 5e-6 * 0.4 * k;  // cycle 0 is the start position
    EXPECT_NEAR(x.deflection[0] - y.deflection[0], 0, 1e-15) << k;
    EXPECT_NEAR(x.deflection[1] - y.deflection[1], 123.4e-6, 1.01e-10) << k;  // one step of the bus
    EXPECT_NEAR(x.deflection[2] - y.deflection[2], turned, 1.01e-10) << k;
    EXPECT_EQ(x.adc, y.adc) << k;
  }
}

// ------------------------------------------------------------------------------- what is refused

std::string error_of(const std::string& law) {
  try {
    with_law(law);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Law, BadOnesAreRefusedWithTheReason) {
  const std::string force = "axis = \"X\"\npoint = \"table_force\"\n";
  EXPECT_EQ(error_of(force + "at_s = [0, 1]\nvalue_N = [1]\n"),
            "m:2: effects.law 1: needs as many values as knots, found 1 and 2");
  EXPECT_EQ(error_of(force), "m:2: effects.law 1: needs at least one knot and its value");
  EXPECT_EQ(error_of(force + "at_s = [1, 1]\nvalue_N = [1, 2]\n"),
            "m:2: effects.law 1: the knots must ascend");
  EXPECT_EQ(error_of(force + "at_s = [2, 1]\nvalue_N = [1, 2]\n"),
            "m:2: effects.law 1: the knots must ascend");
  EXPECT_EQ(error_of(constant("A", "reading", "um", 1)),
            "m:2: effects.law 1: the probe has readings in X, Y and Z only");
  EXPECT_NE(error_of(force + "at_mm = [0]\nvalue_N = [1]\n")
                .find("m:5: effects.law.at_mm: unknown key; did you mean at_s?"),
            std::string::npos);
  EXPECT_NE(error_of("over = \"position\"\n" + force + "at_s = [0]\nvalue_N = [1]\n")
                .find("effects.law.at_s: unknown key; did you mean at_mm?"),
            std::string::npos);
  EXPECT_NE(error_of(constant("C", "table_force", "N", 1))
                .find("effects.law.value_N: unknown key; did you mean value_Nm?"),
            std::string::npos);
  EXPECT_NE(error_of(constant("X", "friction", "N", 1))
                .find("effects.law.point: expected one of \"command\", \"command_time\""),
            std::string::npos);
  EXPECT_NE(error_of("axis = \"B\"\n").find("effects.law.axis: expected one of \"X\""),
            std::string::npos);
  EXPECT_NE(error_of(force + "colour = 3\n").find("effects.law.colour: unknown key"),
            std::string::npos);
  EXPECT_NE(error_of(constant("X", "table_force", "N", 2e9)).find("is out of range, allowed -1"),
            std::string::npos);
}

TEST(Law, SurvivesTheRoundTripThroughAFile) {
  const Machine machine = with_law(
      "label = \"a \\\"b\\\"\"\naxis = \"C\"\npoint = \"motor_force\"\nover = \"velocity\"\n"
      "over_axis = \"A\"\nat_deg_s = [-1.7, 33.3]\nvalue_Nm = [0.1, 7]\ntimes = \"position\"\n"
      "times_axis = \"Z\"\n");
  const std::string text = to_toml(machine);
  const Machine again = parse_machine(text, "again");
  EXPECT_EQ(to_toml(again), text);
  ASSERT_EQ(again.effects.laws.size(), 1u);
  const Law &a = machine.effects.laws[0], &b = again.effects.laws[0];
  EXPECT_EQ(a.label, b.label);
  EXPECT_EQ(a.at, b.at);
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.over, b.over);
  EXPECT_EQ(a.times_axis, b.times_axis);
}

// ----------------------------------------------------------------------------- deviations

const std::string kTrunnion = std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml";

/// The controller goes on with the declared inertia: its feed-forward lacks the difference, and
/// the loop's stiffness Kp Kv is the declared one. With Ti = 10 s, e = (J - J_declared) a / (Kp
/// Kv).
TEST(Deviation, OfALoadIsInThePlantAndNotInTheController) {
  Machine machine =
      load_machine(kTrunnion, {"axes.Y.integral_time_ms=10000"}, {"axes.Y.load_kg=550"});
  const double declared_load = machine.axes[kY].mechanics.load;
  EXPECT_EQ(actual(machine).axes[kY].mechanics.load, 550);
  ASSERT_GT(550 - declared_load, 40);
  AxisDrive drive(machine, kY, 1), as_declared(declared(machine), kY, 1);
  constexpr double a = 1;
  AxisCycle cycle, ideal;
  double target = 0;
  for (int k = 1; k <= 300; ++k) {
    const double t = kCycleTime * k;
    target = machine.axes[kY].limits.start + 0.5 * a * t * t;
    cycle = drive.follow({target, a * t});
    ideal = as_declared.follow({target, a * t});
  }
  const MechanicsParams& mass = machine.axes[kY].mechanics;
  const double inertia = mass.total_inertia() + 550 - declared_load;
  EXPECT_NEAR(cycle.force * mass.force_limit, inertia * a, 1e-3 * inertia * a);
  EXPECT_NEAR(ideal.measured, target, 1e-9);
  const double kp = 2 * kPi * machine.axes[kY].servo.velocity_bandwidth * mass.total_inertia();
  const double error = (550 - declared_load) * a / (kp * machine.axes[kY].servo.kv_per_s);
  const double kv = machine.axes[kY].servo.kv_per_s;
  const double fading = std::exp(-0.3 * kv / (kv * 10 + 1));
  EXPECT_NEAR(target - cycle.measured, error * fading, 5e-3 * error);
}

/// The table's C axis is where the probe finds it; what the NC unit has stays.
TEST(Deviation, OfTheKinematicsIsInTheProbeModuleOnly) {
  constexpr double kOff = 20e-6;
  PieceParams plane;
  plane.kind = PieceParams::Kind::plane;
  plane.centre = Vec3::Zero();
  plane.direction = Vec3::UnitX();
  Machine machine;
  machine.setup.work_offset[0] = Vec3::Zero();
  machine.effects.deviations.push_back({"kinematics.c_axis_point_mm.x", kOff * 1e3});
  EXPECT_EQ(actual(machine).kinematics.p_MC.x(), kOff * 1e3 * 1e-3);
  EXPECT_EQ(as_nc_believes(machine).kinematics.p_MC.x(), 0);
  EXPECT_EQ(declared(machine).kinematics.p_MC.x(), 0);
  // From the free probe, 4 mm off, slowly enough for its 20 um periods to be counted.
  const auto reading = [&](Machine m, double x, double c) {
    m.axes[kX].limits.start = std::copysign(4e-3, x);
    m.axes[kZ].limits.start = m.probe.length;
    m.axes[kC].limits.start = c;
    ProbeBench bench(m, make_piece(plane));
    ProbeSample last;
    for (int k = 0; k <= 300; ++k) {
      const double share = std::min(1.0, k / 200.0);
      const double from = m.axes[kX].limits.start;
      last = bench.at({from + share * (x - from), 0, m.probe.length, 0, c});
    }
    return Vec3(last.deflection.data());
  };
  // At C = 0 nothing has turned; at C = 180 deg the surface is 2 * kOff further towards +x.
  const double near = 2.6e-3;
  EXPECT_NEAR((reading(machine, near, 0) - reading(declared(machine), near, 0)).norm(), 0, 2e-9);
  const Vec3 moved = reading(machine, -near, kPi) - reading(declared(machine), -near, kPi);
  EXPECT_NEAR(std::abs(moved.x()), 2 * kOff, 2e-9);  // the converter resolves 0.3 nm
  EXPECT_NEAR(moved.tail<2>().norm(), 0, 2e-9);
}

TEST(Deviation, OfTheNcUnitsOwnSettingsGoesToTheNcUnit) {
  const Machine machine =
      load_machine(kTrunnion, {},
                   {"nc.rapid_limit=0.5", "axes.X.velocity_mm_s=123", "axes.C.jerk_deg_s3=4567",
                    "axes.Y.load_kg=550", "axes.X.kv_per_s=33", "probe.ball_radius_mm=2.5"});
  ASSERT_EQ(machine.effects.deviations.size(), 6u);
  EXPECT_EQ(to_toml(declared(machine)), to_toml(declared(load_machine(kTrunnion))));
  const Machine nc = as_nc_believes(machine);
  EXPECT_EQ(nc.nc.rapid_limit, 0.5);
  EXPECT_EQ(nc.axes[kX].limits.velocity, 123 * 1e-3);
  EXPECT_EQ(nc.axes[kC].limits.jerk, 4567 * kDegree);
  EXPECT_EQ(nc.axes[kY].mechanics.load, machine.axes[kY].mechanics.load);
  EXPECT_EQ(nc.axes[kX].servo.kv_per_s, machine.axes[kX].servo.kv_per_s);
  EXPECT_EQ(nc.probe.ball_radius, machine.probe.ball_radius);
  EXPECT_TRUE(nc.effects.deviations.empty());
  const Machine is = actual(machine);
  EXPECT_EQ(is.axes[kX].servo.kv_per_s, 33);
  EXPECT_EQ(is.probe.ball_radius, 2.5 * 1e-3);
}

TEST(Deviation, SurvivesTheFileThatARunLeaves) {
  const Machine machine =
      load_machine(kTrunnion, {}, {"axes.Y.load_kg=550", "X.backlash.gap_um=3"});
  const Machine again = parse_machine(to_toml(machine), "again");
  ASSERT_EQ(again.effects.deviations.size(), 1u);
  EXPECT_EQ(again.effects.deviations[0].key, "axes.Y.load_kg");
  EXPECT_EQ(again.effects.deviations[0].value, 550);
  EXPECT_EQ(again.axes[kY].mechanics.load, machine.axes[kY].mechanics.load);
  EXPECT_EQ(again.effects.axis[kX].get<Backlash>().gap, 3 * 1e-6);
}

TEST(Deviation, BadOnesAreRefusedWithTheKeyAndWhatIsAllowed) {
  const auto refusal = [](const std::string& injection) -> std::string {
    try {
      load_machine(kTrunnion, {}, {injection});
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_NE(refusal("axes.Y.load_kg=-5").find("load_kg=-5: expected a number, 0.0001 .. 100000 kg"),
            std::string::npos);
  EXPECT_NE(refusal("axes.Y.load_kg=heavy").find("--inject axes.Y.load_kg=heavy"),
            std::string::npos);
  EXPECT_NE(refusal("axes.Y.load_kg=true").find("expected a number"), std::string::npos);
  EXPECT_NE(refusal("axes.Y.load_lb=5").find("did you mean axes.Y.load_kg?"), std::string::npos);
  EXPECT_NE(refusal("squareness.xy_urad=5").find("geometry.squareness.xy_urad"), std::string::npos);
  EXPECT_NE(refusal("axes.Y.load_kg=nan").find("load_kg=nan: expected a number"),
            std::string::npos);
  EXPECT_NE(refusal("X.backlsh.gap_um=5")
                .find("--inject X.backlsh.gap_um=5: effects.X.backlsh: unknown key; did you mean "
                      "backlash?"),
            std::string::npos)
      << refusal("X.backlsh.gap_um=5");
  EXPECT_NE(refusal("X.backlash.gap_um=5000").find("out of range, allowed 0 .. 2000 um"),
            std::string::npos);
  EXPECT_NE(refusal("load").find("--inject load: expected key=value"), std::string::npos);
  EXPECT_NE(refusal("=3").find("expected key=value"), std::string::npos);
  // A true value that contradicts another one of the machine.
  EXPECT_NE(refusal("axes.X.min_mm=900").find("lower travel limit must be below"),
            std::string::npos);
  const auto in_file = [](const std::string& key) -> std::string {
    try {
      parse_machine("[[effects.deviation]]\nkey = \"" + key + "\"\nvalue = 1\n", "m");
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_EQ(
      in_file("effects.X.backlash.gap_um"),
      "m: effects.deviation: effects.X.backlash.gap_um: an effect is given under its own key");
  EXPECT_EQ(in_file("axes.W.load_kg"),
            "m: effects.deviation: axes.W.load_kg: is not a number of a machine file");
}

}  // namespace
}  // namespace vcnc::law_test
