#include "diagnosis/healthy/unknown_force.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "tests/diagnosis/stroke_run.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::unknown_force_test {
namespace {

using stroke_run::declared, stroke_run::recorded, stroke_run::signal_of_x;

/// Another friction besides: what a model of dry friction alone leaves of oil and seals.
Machine with_oil(double share = 1) {
  Machine machine = declared();
  Law oil;
  oil.axis = Law::OfAxis::X;
  oil.point = Law::Point::table_force;
  oil.over = Covariate::velocity;
  for (const double v : {-0.3, -0.1, -0.03, -0.01, -0.003, 0.0, 0.003, 0.01, 0.03, 0.1, 0.3}) {
    oil.at.push_back(v);
    oil.value.push_back(-40 * share * std::asinh(v / 0.01));
  }
  machine.effects.laws.push_back(oil);
  return machine;
}

double rms(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

TEST(UnknownForce, IsThatOfAFrictionThatIsNotDeclared) {
  const Record record = recorded(with_oil(), 1);
  const ForceOfAxes force = unknown_force(record, declared());
  ASSERT_EQ(force[kX].size(), record.samples());
  EXPECT_TRUE(force[kY].empty());
  std::vector<double> wrong, all;
  for (std::size_t k = 1; k + 1 < record.samples(); ++k) {
    const std::vector<double>& x = record.signals[0].value;
    const double v = (x[k + 1] - x[k - 1]) / 2e-3;
    if (std::abs(v) < 0.01) continue;  // turning over
    const double oil = -40 * std::asinh(v / 0.01);
    wrong.push_back(force[kX][k] - oil);
    all.push_back(oil);
  }
  EXPECT_LT(rms(wrong), 0.05 * rms(all));
}

TEST(UnknownForce, IsNoneWhereTheModelIsRightOrNoForceIsRecorded) {
  EXPECT_TRUE(unknown_force(recorded(declared(), 2), declared())[kX].empty());
  EXPECT_TRUE(unknown_force(recorded(with_oil(), 2, false), declared())[kX].empty());
}

TEST(UnknownForce, IsNotMadeOfAnotherController) {
  Machine other = declared();
  other.effects.deviations.push_back({"axes.X.position_lag_us", 400});
  EXPECT_TRUE(unknown_force(recorded(other, 3), declared())[kX].empty());
}

TEST(UnknownForce, IsNoneBesideAForceOfTheTest) {
  Record record = recorded(with_oil(), 4);
  record.signals.push_back(
      signal_of_x(SignalKind::applied_force, std::vector<double>(record.samples(), 0.0)));
  EXPECT_TRUE(unknown_force(record, declared())[kX].empty());
}

TEST(UnknownForce, HoldsWhatWasBeforeAGap) {
  std::vector<double> series{kMissing, 3, kMissing, kMissing, 5, kMissing};
  hold_over_gaps(series);
  EXPECT_EQ(series, (std::vector<double>{3, 3, 3, 3, 5, 5}));
  std::vector<double> nothing{kMissing, kMissing};
  hold_over_gaps(nothing);
  EXPECT_EQ(nothing, (std::vector<double>{0, 0}));
}

// An axis that is told everything later does all of it later, what friction does to it included.
TEST(UnknownForce, TurnsOverWhereTheAxisDoes) {
  const Record record = recorded(with_oil(), 5);
  MachineReplica replica(record, declared(), std::nullopt);
  replica.apply(unknown_force(record, declared()));
  Machine late = declared();
  late.effects.axis[kX].get<CommandDelay>().delay = 4e-3;
  const Prediction now = replica.predict(declared()), then = replica.predict(late);
  const std::size_t force = 1;
  ASSERT_EQ(replica.channels()[force].kind, SignalKind::force);
  std::vector<double> off, if_not;
  for (std::size_t k = 100; k + 4 < record.samples(); ++k) {
    off.push_back(then[force][k + 4] - now[force][k]);
    if_not.push_back(now[force][k + 4] - now[force][k]);
  }
  EXPECT_LT(rms(off), 0.02 * rms(if_not));
}

/// Servo loops and friction of X only, so that it takes seconds.
Diagnosis change(const Machine& healthy, const Machine& now, bool with_unknown = true) {
  const Record reference = recorded(healthy, 6), record = recorded(now, 7);
  MachineReplica of_reference(reference, declared(), std::nullopt),
      replica(record, declared(), std::nullopt);
  const HealthyRun run = with_unknown ? healthy_run_with_forces(reference, of_reference, declared())
                                      : healthy_run(reference, of_reference, declared());
  const DifferentialRecord difference = less_healthy(record, run);
  replica.apply(difference.unknown);
  std::vector<Candidate> all = candidates(declared());
  std::erase_if(all, [](const Candidate& c) {
    static constexpr std::array<std::string_view, 8> tried{
        "kv_error", "velocity_gain_error", "integral_time_error", "torque_constant_error",
        "viscous",  "grease_drag",         "nonlinear_viscous",   "presliding"};
    return c.place != "X" || std::find(tried.begin(), tried.end(), c.effect) == tried.end();
  });
  return diagnose({record, replica, declared(), all}, difference);
}

TEST(UnknownForce, LetsAGainBeToldOfAnAxisWhoseFrictionIsAnotherLaw) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Machine quick = with_oil();
  quick.effects.axis[kX].get<KvError>().deviation = 0.15;
  const auto off = [](const Diagnosis& d) {
    return std::abs(number_of(d.found, "effects.X.kv_error.deviation_percent") - 15);
  };
  const Diagnosis d = change(with_oil(), quick);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "kv_error");
  EXPECT_LT(off(d), 1);
  const Diagnosis without = change(with_oil(), quick, false);
  EXPECT_TRUE(without.effects.size() != 1 || off(without) > 3 * off(d));
}

TEST(UnknownForce, OfAnotherDayIsNoDeviation) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  const Diagnosis d = change(with_oil(), with_oil(1.04));
  EXPECT_EQ(d.verdict, DiagnosisVerdict::no_deviation);
  EXPECT_TRUE(d.effects.empty());
}

/// Dry friction that takes a way to turn over, which nobody declared.
Machine with_bristles(double level) {
  Machine machine = with_oil();
  machine.effects.axis[kX].get<Coulomb>().level = level;
  machine.effects.axis[kX].get<Presliding>().stiffness = 15e6;
  return machine;
}

TEST(UnknownForce, MoreFrictionOfAnotherLawIsNoGain) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  const Diagnosis d = change(with_bristles(100), with_bristles(150), false);
  EXPECT_NE(d.verdict, DiagnosisVerdict::no_deviation);
  for (const FoundEffect& e : d.effects) {
    EXPECT_NE(e.name, "kv_error");
    EXPECT_NE(e.name, "velocity_gain_error");
    EXPECT_NE(e.name, "integral_time_error");
  }
}

}  // namespace
}  // namespace vcnc::unknown_force_test
