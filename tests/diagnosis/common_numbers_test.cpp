#include "diagnosis/healthy/common_numbers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc::common_numbers_test {
namespace {

/// d (1 + s) with the damping d of the probe and a squareness of s rad; the load of X, which has
/// nothing to do with either.
class ProductReplica : public Replica {
 public:
  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    const double product = m.probe.damping_ratio * (1 + m.effects.get<Squareness>().xy);
    if (m.axes[kX].mechanics.load != load_) load_ = m.axes[kX].mechanics.load, of_load_ = series();
    return {SharedSeries(std::vector<double>{product}), of_load_};
  }

  /// As many as there are deviations: a whole machine knows nothing of common numbers.
  std::vector<std::vector<double>> rounding(const Machine& m) const override {
    return {std::vector<double>(m.effects.deviations.size())};
  }

 private:
  SharedSeries series() const { return SharedSeries(std::vector<double>{load_}); }

  std::vector<ComparedChannel> channels_{{SignalKind::deflection, 0}, {SignalKind::force, 0}};
  mutable double load_ = 0;
  mutable SharedSeries of_load_;
};

constexpr const char* kDamping = "common:probe.damping_ratio";

/// `common`: how much more damping both runs have.
Machine machine(double damping, double squareness, double common = 0) {
  Machine m;
  m.probe.damping_ratio = damping;
  m.effects.get<Squareness>().xy = squareness;
  if (common != 0) move_number(m, kDamping, common);
  return m;
}

std::vector<FreedNumber> damping_alone() {
  std::vector<FreedNumber> all = common_numbers(machine(0.3, 0));
  std::erase_if(all, [](const auto& n) { return n.number.key != kDamping; });
  return all;
}

TEST(CommonNumbers, DoNothingToWhatEncodersRoundOff) {
  ProductReplica product;
  const ReplicaOfChange change(product, machine(0.3, 0), damping_alone());
  ASSERT_EQ(machine(0.3, 0, 0.1).effects.deviations.size(), 1U);
  EXPECT_TRUE(change.rounding(machine(0.3, 0, 0.1)).front().empty());
}

TEST(CommonNumbers, AreWhatHasATolerance) {
  Machine m = machine(0.3, 0);
  m.axes[kX].servo.current_lag = 0;
  m.axes[kY].servo.current_lag = 200e-6;
  m.effects.axis[kY].get<Presliding>().stiffness = 30e6;
  m.effects.axis[kZ].get<Windup>().compliance = 8e-9;
  const std::vector<FreedNumber> all = common_numbers(m);
  const auto of = [&](const std::string& key) {
    for (const FreedNumber& n : all)
      if (n.number.key == "common:" + key) return n.tolerance;
    return 0.0;
  };
  EXPECT_DOUBLE_EQ(of("probe.damping_ratio"), 0.15);
  EXPECT_DOUBLE_EQ(of("axes.Y.current_lag_us"), 60);
  EXPECT_EQ(of("axes.X.current_lag_us"), 0);  // there is none to be wrong about
  EXPECT_EQ(of("axes.X.position_lag_us"), 500);
  EXPECT_EQ(of("axes.X.velocity_lag_us"), 500);
  EXPECT_DOUBLE_EQ(of("effects.Y.presliding.stiffness_N_per_um"), 15);
  EXPECT_DOUBLE_EQ(of("effects.Z.windup.compliance_nm_per_N"), 0.8);
  EXPECT_EQ(of("effects.X.presliding.stiffness_N_per_um"), 0);
  for (const FreedNumber& n : all) EXPECT_TRUE(n.common());
}

/// Counts what it is asked, and knows where it stands.
class CountingReplica : public ProductReplica {
 public:
  Prediction predict(const Machine& m) const override {
    ++asked;
    return ProductReplica::predict(m);
  }
  bool anchor(const Machine& m) override {
    const double now = m.effects.get<Squareness>().xy;
    return std::exchange(at_, now) != now;
  }
  mutable int asked = 0;

 private:
  double at_ = std::nan("");
};

TEST(CommonNumbers, AreDerivedAnewOnlyWhereTheReplicaHasMoved) {
  CountingReplica inner;
  ReplicaOfChange replica(inner, machine(0.3, 0), damping_alone());
  const auto asked = [&](double squareness) {
    const int before = inner.asked;
    replica.predict(machine(0.3, squareness, 0.2));
    return inner.asked - before;
  };
  replica.anchor(machine(0.3, 0.2));
  EXPECT_EQ(asked(0.2), 3);  // where it stands, and there with the number moved
  EXPECT_EQ(asked(0.2), 1);
  replica.anchor(machine(0.3, 0.2));
  EXPECT_EQ(asked(0.2), 1);
  replica.anchor(machine(0.3, 0.4));
  EXPECT_EQ(asked(0.4), 3);
}

TEST(CommonNumbers, DoNothingAtTheHealthyMachineAndMultiplyWithAChange) {
  ProductReplica inner;
  ReplicaOfChange replica(inner, machine(0.3, 0), damping_alone());
  EXPECT_DOUBLE_EQ(replica.predict(machine(0.3, 0))[0][0], 0.3);
  EXPECT_NEAR(replica.predict(machine(0.3, 0, 0.2))[0][0], 0.3, 1e-12);
  // y_now - y_ref = 0.5 * 1.2 - 0.5 of machines that both have 0.5.
  replica.anchor(machine(0.3, 0.2, 0.2));
  EXPECT_NEAR(replica.predict(machine(0.3, 0.2, 0.2))[0][0] - 0.3, 0.5 * 1.2 - 0.5, 1e-12);
  EXPECT_NEAR(replica.predict(machine(0.3, 0.2))[0][0] - 0.3, 0.3 * 0.2, 1e-12);
}

TEST(CommonNumbers, AreNoneOfTheNumbersOfTheMachine) {
  // A damping of 0.4 instead of 0.3 in one run alone, beside 0.1 more in both.
  ProductReplica inner;
  ReplicaOfChange replica(inner, machine(0.3, 0), damping_alone());
  replica.anchor(machine(0.4, 0, 0.1));
  EXPECT_NEAR(replica.predict(machine(0.4, 0, 0.1))[0][0], 0.4, 1e-12);
  const Machine both = machine(0.4, 0.2, 0.1);
  EXPECT_DOUBLE_EQ(number_of(both, "probe.damping_ratio"), 0.4);
  EXPECT_DOUBLE_EQ(number_of(both, kDamping), 0.1);
  EXPECT_TRUE(without_common(both).effects.deviations.empty());
}

TEST(CommonNumbers, LeaveSharedWhatTheyDoNotConcern) {
  ProductReplica inner;
  ReplicaOfChange replica(inner, machine(0.3, 0), damping_alone());
  replica.anchor(machine(0.3, 0.2, 0.1));
  const Machine m = machine(0.3, 0.2, 0.1);
  const Prediction a = replica.predict(m), b = replica.predict(m);
  EXPECT_TRUE(a[1].shares(b[1]));
  EXPECT_TRUE(a[1].shares(inner.predict(machine(0.3, 0))[1]));
}

/// A toy machine whose ball follows what squareness shifts it by with a lag of 10 ms times the
/// damping of the probe.
class LaggingReplica : public toy::ToyReplica {
 public:
  explicit LaggingReplica(const Record& commands) : ToyReplica(commands), commands_(commands) {}
  Prediction predict(const Machine& m) const override {
    const Prediction all = ToyReplica::predict(m);
    const std::vector<double>& y = commands_.find(SignalKind::command, 1)->value;
    const double behind = 10 * m.probe.damping_ratio * m.effects.get<Squareness>().xy;
    std::vector<double> reading = all[2];
    for (std::size_t k = 1; k < reading.size(); ++k)
      if (std::abs(y[k] - y[k - 1]) < 1e-3) reading[k] -= behind * (y[k] - y[k - 1]);
    return {all[0], all[1], SharedSeries(std::move(reading))};
  }

 private:
  const Record& commands_;
};

TEST(CommonNumbers, KeepAFaultFromBeingToldTwice) {
  Record healthy = toy::commands(2048, 4), now = healthy;
  const auto measured = [](Record& record, const Machine& truth, std::uint64_t seed) {
    toy::measure(record, truth, seed);
    const Prediction lagging = LaggingReplica(record).predict(truth),
                     plain = toy::ToyReplica(record).predict(truth);
    MeasuredSignal& reading =
        *std::find_if(record.signals.begin(), record.signals.end(),
                      [](const MeasuredSignal& s) { return s.kind == SignalKind::deflection; });
    for (std::size_t k = 0; k < reading.value.size(); ++k)
      reading.value[k] += lagging[2][k] - plain[2][k];
  };
  measured(healthy, machine(0.5, 0), 1);
  measured(now, machine(0.5, 500e-6), 2);
  LaggingReplica of_healthy(healthy), of_now(now);
  const Machine declared = machine(0.3, 0);
  const Diagnosis d = diagnose({now, of_now, declared, toy::candidates()},
                               less_healthy(now, healthy_run(healthy, of_healthy, declared)));
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "squareness");
  EXPECT_NEAR(d.effects[0].numbers[0].value, 500, 1);
  EXPECT_TRUE(d.laws.empty());
  EXPECT_EQ(d.found.probe.damping_ratio, declared.probe.damping_ratio);
}

}  // namespace
}  // namespace vcnc::common_numbers_test
