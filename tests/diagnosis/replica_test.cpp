#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <future>

#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/series.hpp"
#include "model/probe/noise.hpp"
#include "tests/diagnosis/recorded_run.hpp"

namespace vcnc::replica_test {
namespace {

bool same_bits(const Prediction& a, const Prediction& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t c = 0; c < a.size(); ++c)
    if (a[c].size() != b[c].size() ||
        std::memcmp(&*a[c].begin(), &*b[c].begin(), a[c].size() * sizeof(double)) != 0)
      return false;
  return true;
}

const RecordedRun& reversals() {
  static const RecordedRun run = [] {
    Effects effects;
    effects.axis[kX].get<Coulomb>() = Coulomb::nominal(false);
    return recorded_run(Showing::reversals, kX, effects);
  }();
  return run;
}

/// Hypotheses of all parts of the machine.
std::vector<Machine> hypotheses(const Machine& declared) {
  std::vector<Machine> all;
  const auto add = [&](auto&& change) {
    Machine machine = declared;
    change(machine);
    all.push_back(machine);
  };
  add([](Machine& m) { m.effects.axis[kX].get<Coulomb>() = Coulomb::nominal(false); });
  add([](Machine& m) { m.effects.axis[kX].get<ScaleError>() = ScaleError::nominal(); });
  add([](Machine& m) { m.effects.get<Squareness>() = Squareness::nominal(); });
  add([](Machine& m) { m.effects.get<ProbeGain>() = ProbeGain::nominal(); });
  add([](Machine& m) { m.effects.deviations.push_back({"axes.X.load_kg", 550}); });
  add([](Machine& m) { m.effects.axis[kY].get<Viscous>() = Viscous::nominal(false); });
  add([](Machine&) {});
  return all;
}

TEST(MachineReplica, MemoryChangesNothing) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  const std::vector<Machine> all = hypotheses(run.declared);
  for (int round = 0; round < 2; ++round)
    for (const Machine& machine : all)
      EXPECT_TRUE(same_bits(replica.predict(machine), run.replica().predict(machine)));
}

TEST(MachineReplica, SeveralAtATimeAreAsAlone) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  std::vector<Machine> all = hypotheses(run.declared);
  const auto on_x = [&](auto effect) {
    all.push_back(run.declared);
    all.back().effects.axis[kX].get<decltype(effect)>() = effect;
  };
  on_x(Viscous::nominal(false));
  on_x(Cogging::nominal(false));
  on_x(KvError::nominal(false));
  on_x(EncoderSubdivision::nominal(false));
  on_x(CommandDelay::nominal(false));
  on_x(BusLatency{.cycles = 2});
  on_x(Backlash::nominal(false));
  on_x(Windup::nominal(false));
  on_x(PitchPeriodic::nominal(false));  // move the tool centre, not the drive
  on_x(ThermalDrift::nominal(false));
  on_x(LoadPlay::nominal(false));  // remembers
  Law law;
  law.point = Law::Point::displacement;
  law.at = {0, 5};
  law.value = {1e-6, 3e-6};
  for (const Covariate over : {Covariate::time, Covariate::position}) {
    law.over = over;
    all.push_back(run.declared);
    all.back().effects.laws.push_back(law);
  }
  all.push_back(all.front());
  all.back().effects.get<ContactLoss>() = ContactLoss::nominal();  // needs the probe in full
  const std::vector<Prediction> together = replica.predict_all(all);
  ASSERT_EQ(together.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    EXPECT_TRUE(same_bits(together[i], run.replica().predict(all[i]))) << i;
}

TEST(MachineReplica, ThreadsChangeNothing) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  const std::vector<Machine> all = hypotheses(run.declared);
  std::vector<std::future<Prediction>> answers;
  for (const Machine& machine : all)
    answers.push_back(std::async(std::launch::async, [&] { return replica.predict(machine); }));
  for (std::size_t i = 0; i < all.size(); ++i)
    EXPECT_TRUE(same_bits(answers[i].get(), run.replica().predict(all[i]))) << i;
}

TEST(MachineReplica, IsFullAtItsAnchor) {
  const RecordedRun& run = reversals();
  MachineReplica replica = run.replica();
  EXPECT_TRUE(same_bits(replica.predict(run.declared), replica.predict_in_full(run.declared)));
  EXPECT_FALSE(
      same_bits(replica.predict(run.true_machine), replica.predict_in_full(run.true_machine)));
  EXPECT_FALSE(replica.anchor(run.declared));
  EXPECT_TRUE(replica.anchor(run.true_machine));
  EXPECT_TRUE(
      same_bits(replica.predict(run.true_machine), replica.predict_in_full(run.true_machine)));
}

/// A force that is known moves the axis as a law of the machine does.
TEST(MachineReplica, KnownForcesAct) {
  const RecordedRun& run = reversals();
  Law law;
  law.over = Covariate::time;
  Record record = run.record;
  std::vector<double> force(record.samples(), 0.0);
  for (std::size_t n = 0; n < 5; ++n) {
    const auto at = static_cast<double>(200 + 350 * n);
    for (const auto& [ms, newtons] :
         {std::pair{at, 0.0}, {at + 10, 80.0}, {at + 60, 80.0}, {at + 70, 0.0}}) {
      law.at.push_back(ms * 1e-3);
      law.value.push_back(newtons);
    }
    for (std::size_t k = 0; k <= 70; ++k)
      force.at(200 + 350 * n + k) =
          std::min({80.0, 8.0 * static_cast<double>(k), 8.0 * static_cast<double>(70 - k)});
  }
  Machine pushed = run.true_machine;
  pushed.effects.laws.push_back(law);
  record.signals.push_back({SignalKind::applied_force, kX, "push", force, 0});
  const Prediction expected = run.replica().predict_in_full(pushed),
                   without = run.replica().predict_in_full(run.true_machine),
                   known = MachineReplica(record, run.declared, run.piece)
                               .predict_in_full(run.true_machine);
  ASSERT_EQ(known.size(), expected.size());
  for (std::size_t c = 0; c < known.size(); ++c) {
    double moved = 0, off = 0;
    for (std::size_t k = 0; k < known[c].size(); ++k) {
      if (std::isnan(expected[c][k])) continue;
      moved = std::max(moved, std::abs(expected[c][k] - without[c][k]));
      off = std::max(off, std::abs(expected[c][k] - known[c][k]));
    }
    EXPECT_LE(off, 0.02 * moved) << c;
    const bool of_x = run.replica().channels()[c] == ComparedChannel{SignalKind::position, kX};
    EXPECT_TRUE(!of_x || moved > 1e-7);
  }
}

/// A piece that lies a quarter of a wave of the error elsewhere than the model knows, wherever a
/// hypothesis lets it lie.
TEST(MachineReplica, SignalErrorsAreThoseOfTheDeflectionThatWasMeasured) {
  Effects effects;
  effects.get<PieceOffset>() = {Vec3(2.5e-6, 0, 0)};
  const RecordedRun run = recorded_run(Showing::circle, kX, effects);
  const MachineReplica replica = run.replica();
  const auto change = [&](const Machine& machine, auto&& predict) {
    Machine with = machine;
    with.effects.get<SignalPhase>() = SignalPhase::nominal();
    const Prediction before = predict(machine), after = predict(with);
    std::vector<double> d;
    for (std::size_t c = 0; c < before.size(); ++c)
      if (replica.channels()[c].kind == SignalKind::deflection && replica.channels()[c].axis == 0)
        for (std::size_t k = 0; k < before[c].size(); ++k) d.push_back(after[c][k] - before[c][k]);
    return d;
  };
  const auto full = [&](const Machine& m) { return replica.predict_in_full(m); };
  const auto quickly = [&](const Machine& m) { return replica.predict(m); };
  Machine farther = run.declared;
  farther.effects.get<PieceOffset>() = {Vec3(5e-6, 0, 0)};
  const std::vector<double> actual = change(run.true_machine, full),
                            elsewhere = change(run.declared, full),
                            found = change(run.declared, quickly), moved = change(farther, quickly);
  ASSERT_EQ(found.size(), actual.size());
  double size = 0, off = 0, off_moved = 0, off_elsewhere = 0;
  for (std::size_t k = 0; k < actual.size(); ++k) {
    size += actual[k] * actual[k];
    off += std::pow(found[k] - actual[k], 2);
    off_moved += std::pow(moved[k] - actual[k], 2);
    off_elsewhere += std::pow(elsewhere[k] - actual[k], 2);
  }
  EXPECT_GT(size, 0);
  EXPECT_LT(std::sqrt(off / size), 0.1);
  EXPECT_LT(std::sqrt(off_moved / size), 0.1);
  EXPECT_GT(std::sqrt(off_elsewhere / size), 0.4);
}

/// What only the full probe tells need not be computed again where both machines have it.
TEST(MachineReplica, HysteresisAndCorrectedSignalsAreThoseOfTheAnchor) {
  Effects effects;
  effects.get<ReturnToZero>() = {0.5e-6};
  effects.get<SignalGain>() = SignalGain::nominal();
  Experiment e = experiment(Showing::circle, kX, ideal_machine());
  e.machine.probe.correction = ProbeParams::Correction::heydemann;
  e.machine.effects = effects;
  const Observation seen = observe(e);
  RunBegin begin;
  begin.run_id = "test";
  begin.declared_toml = to_toml(e.machine);
  begin.piece_toml = to_toml(*e.piece);
  const Record record = record_from(begin, seen.rows, seen.alarms);
  const MachineReplica replica(record, e.machine, e.piece);
  // Sizes of what a machine makes of the readings, and of what is wrong about that [m].
  const auto change = [&](const Machine& machine) {
    const Prediction before = replica.predict_in_full(e.machine),
                     full = replica.predict_in_full(machine), quick = replica.predict(machine);
    double size = 0, off = 0;
    for (std::size_t c = 0; c < full.size(); ++c)
      for (std::size_t k = 0; k < full[c].size(); ++k) {
        if (replica.channels()[c].kind != SignalKind::deflection) continue;
        size += std::pow(full[c][k] - before[c][k], 2);
        off += std::pow(quick[c][k] - full[c][k], 2);
      }
    return std::pair(std::sqrt(size), std::sqrt(off));
  };
  Machine moved = e.machine;
  moved.effects.get<PieceOffset>() = {Vec3(2e-6, 1e-6, 0)};
  moved.effects.axis[kX].get<ScaleError>() = ScaleError::nominal();
  const auto [size, off] = change(moved);
  EXPECT_GT(size, 1e-6);
  EXPECT_LT(off, 0.03 * size);
  Machine rubbing = e.machine;
  rubbing.effects.get<ReturnToZero>() = {1e-6};
  EXPECT_GT(change(rubbing).first, 0);
  EXPECT_EQ(change(rubbing).second, 0);

  Machine even = e.machine, distorted = e.machine;
  even.effects.get<SignalGain>() = {};
  distorted.effects.get<SignalHarmonics>() = SignalHarmonics::nominal();
  for (const Machine& other : {even, distorted}) {
    const auto [made, missed] = change(other);
    EXPECT_GT(made, 0);
    EXPECT_LT(missed, 0.05 * made);
  }
}

TEST(MachineReplica, ChanceIsNotPredicted) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  Machine noisy = run.declared;
  noisy.effects.get<AdcNoise>() = AdcNoise::nominal();
  noisy.effects.axis[kX].get<BusJitter>() = BusJitter::nominal(false);
  EXPECT_TRUE(same_bits(replica.predict(noisy), replica.predict(run.declared)));
}

TEST(MachineReplica, WhatEncodersRoundOffIsToldAsNoise) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  EXPECT_TRUE(replica.rounding(run.declared).empty());
  Machine coarse = run.declared;
  coarse.effects.axis[kX].get<EncoderQuantisation>().quantum = 0.1e-6;
  EXPECT_TRUE(same_bits(replica.predict(coarse), replica.predict(run.declared)));
  const std::vector<std::vector<double>> rounding = replica.rounding(coarse);
  ASSERT_EQ(rounding.size(), replica.channels().size());
  for (std::size_t c = 0; c < rounding.size(); ++c) {
    const ComparedChannel& channel = replica.channels()[c];
    if (channel.kind != SignalKind::position) continue;
    double sum = 0, n = 0;
    for (const double x : rounding[c])
      if (std::isfinite(x)) sum += x * x, n += 1;
    const double rms = std::sqrt(sum / n), even = 0.1e-6 / std::sqrt(12.0);
    if (channel.axis == kX) {
      // The control moves the axis about as well: between once and twice an even rounding.
      EXPECT_GT(rms, 0.7 * even);
      EXPECT_LT(rms, 2 * even);
    } else {
      EXPECT_EQ(rms, 0);
    }
  }
}

/// The controllers keep what is declared, the bodies are as given.
TEST(MachineReplica, AnotherDeclaredNumberIsADeviation) {
  const RecordedRun& run = reversals();
  const MachineReplica replica = run.replica();
  Machine deviating = run.declared, other = run.declared;
  deviating.effects.deviations.push_back({"axes.X.load_kg", 550});
  other.axes[kX].mechanics.load = 550;
  EXPECT_TRUE(same_bits(replica.predict(deviating), replica.predict(other)));
  EXPECT_FALSE(same_bits(replica.predict(deviating), replica.predict(run.declared)));
}

TEST(MachineReplica, OneAxisAloneIsPredictedAsInTheWhole) {
  const RecordedRun& run = reversals();
  Record alone = run.record;
  std::erase_if(alone.signals, [](const MeasuredSignal& s) {
    return s.axis != kX || (s.kind != SignalKind::command && s.kind != SignalKind::position);
  });
  const MachineReplica whole = run.replica(), one(alone, run.declared, std::nullopt);
  ASSERT_EQ(one.channels().size(), 1u);
  const Prediction expected = whole.predict(run.true_machine),
                   found = one.predict(run.true_machine);
  for (std::size_t c = 0; c < expected.size(); ++c)
    if (whole.channels()[c].kind == SignalKind::position && whole.channels()[c].axis == kX) {
      EXPECT_EQ(found[0], expected[c]);
    }
}

TEST(MachineReplica, AnAxisWithoutCommandIsWhereItWasMeasured) {
  const RecordedRun& run = reversals();
  Record record = run.record;
  std::erase_if(record.signals, [](const MeasuredSignal& s) {
    return s.kind == SignalKind::command && s.axis == kX;
  });
  const MachineReplica replica(record, run.declared, run.piece);
  for (const ComparedChannel& c : replica.channels())
    EXPECT_TRUE(c.kind == SignalKind::deflection || c.axis != kX);
  const Prediction found = replica.predict_in_full(run.declared);
  EXPECT_LT(misfit(run, replica, found, SignalKind::deflection).rms, 20e-9);
}

/// A joint of which motor, twist and force were recorded and no command: what its drive is like is
/// not seen, what it carries is.
TEST(MachineReplica, AnAxisWithoutCommandThatHasForceAndTwistIsFollowed) {
  Machine machine = ideal_machine();
  machine.axes[kC].servo.feedback = ServoParams::Feedback::motor;
  auto& effects = machine.effects.axis[kC];
  effects.get<Coulomb>() = Coulomb::nominal(true);
  effects.get<Windup>() = Windup::nominal(true);
  Record commanded;
  MeasuredSignal told{SignalKind::command, kC, "", {}, 0};
  for (int i = 0; i < 3000; ++i) told.value.push_back(0.5 * (1 - std::cos(2 * kPi * i / 1000)));
  const std::vector<double> any(told.value.size(), 0.0);
  commanded.signals = {told,
                       {SignalKind::position, kC, "", any, 0},
                       {SignalKind::force, kC, "", any, 0},
                       {SignalKind::twist, kC, "", any, 0}};
  const Prediction seen = MachineReplica(commanded, machine, std::nullopt).predict(machine);
  Record record;
  for (std::size_t c = 0; c < seen.size(); ++c)
    record.signals.push_back({commanded.signals[c + 1].kind, kC, "", seen[c], 0});
  ASSERT_TRUE(is_followed(record, kC));

  Machine declared = machine;
  declared.axes[kC].servo.kv_per_s = 17;  // nobody knows
  const MachineReplica replica(record, declared, std::nullopt);
  ASSERT_EQ(replica.channels(),
            (std::vector<ComparedChannel>{{SignalKind::force, kC}, {SignalKind::twist, kC}}));
  const auto rms_off = [&](const Prediction& p, std::size_t c) {
    double sum = 0, square = 0;
    for (std::size_t k = 400; k < any.size(); ++k) {  // it may begin in motion
      sum += std::pow(p[c][k] - seen[c + 1][k], 2);
      square += std::pow(seen[c + 1][k], 2);
    }
    return std::sqrt(sum / square);
  };
  const Prediction as_it_is = replica.predict(declared);
  EXPECT_LT(rms_off(as_it_is, 0), 0.05);
  EXPECT_LT(rms_off(as_it_is, 1), 0.05);
  Machine other_loops = declared;
  other_loops.effects.axis[kC].get<KvError>() = KvError::nominal(true);
  other_loops.effects.axis[kC].get<CommandDelay>() = CommandDelay::nominal(true);
  EXPECT_TRUE(same_bits(replica.predict(other_loops), as_it_is));
  Machine without_friction = declared;
  without_friction.effects.axis[kC].get<Coulomb>() = {};
  EXPECT_GT(rms_off(replica.predict(without_friction), 0), 0.1);
  // Noise of the encoder does not become force.
  Record noisy = record;
  for (std::size_t k = 0; k < any.size(); ++k)
    noisy.signals[0].value[k] += 1e-5 * gaussian_noise(1, 2, k)[0];
  EXPECT_LT(rms_off(MachineReplica(noisy, declared, std::nullopt).predict(declared), 0), 0.05);
  record.signals.push_back({SignalKind::deflection, 0, "", any, 0});
  EXPECT_FALSE(is_followed(record, kC)) << "the pose is known better from the positions";
}

/// Two encoders that count from anywhere: the prediction has the mean of what was measured.
TEST(SeriesWithMean, IsMovedWhereBothAreKnown) {
  const std::vector<double> moved = with_mean_of({5, kMissing, 7, 9}, {0, 100, 1, 2, 3});
  EXPECT_EQ(moved, (std::vector<double>{6, 106, 7, 8, 9}));
  EXPECT_EQ(with_mean_of({kMissing}, {1.0}), std::vector<double>{1});
}

TEST(MachineReplica, AGapStaysAGapUntilTheDriveHasForgotten) {
  const RecordedRun& run = reversals();
  Record record = run.record;
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::command && s.axis == kX)
      for (std::size_t k = 500; k < 510; ++k) s.value[k] = kMissing;
  const MachineReplica replica(record, run.declared, run.piece);
  const Prediction found = replica.predict(run.declared);
  for (const std::vector<double>& channel : found) {
    EXPECT_FALSE(std::isnan(channel[499]));
    EXPECT_TRUE(std::isnan(channel[500]) && std::isnan(channel[559]));
    EXPECT_FALSE(std::isnan(channel[560]));
  }
}

/// A slow sine, sampled at 2 ms and at 1 ms: the drive is the same.
TEST(MachineReplica, ARecordAtAnotherRateIsTheSameMotion) {
  const auto sampled = [](double period) {
    Record record;
    record.period = period;
    const auto n = static_cast<std::size_t>(std::lround(2 / period));
    MeasuredSignal command{SignalKind::command, kX, "x", {}, 0},
        position{SignalKind::position, kX, "y", {}, 0};
    for (std::size_t i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) * period;
      command.value.push_back(5e-3 * (1 - std::cos(2 * kPi * t)));
      position.value.push_back(0);
    }
    record.signals = {command, position};
    return record;
  };
  Machine machine = ideal_machine();
  machine.effects.axis[kX].get<VelocityFfError>() = {-0.05};
  const MachineReplica fast(sampled(1e-3), machine, std::nullopt),
      slow(sampled(2e-3), machine, std::nullopt);
  const Prediction a = fast.predict(machine), b = slow.predict(machine);
  double largest = 0;
  for (std::size_t i = 100; i + 1 < b[0].size(); ++i)
    largest = std::max(largest, std::abs(b[0][i] - a[0][2 * i]));
  EXPECT_LT(largest, 2e-9);
  EXPECT_GT(std::abs(a[0][250] - 5e-3), 1e-6);  // it lags
}

TEST(MachineReplica, ABeginInMotionIsNotPredicted) {
  Record record;
  MeasuredSignal command{SignalKind::command, kX, "x", {}, 0},
      position{SignalKind::position, kX, "y", {}, 0};
  for (int i = 0; i < 1000; ++i) command.value.push_back(2e-5 * i);
  position.value = command.value;
  record.signals = {command, position};
  const Machine machine = ideal_machine();
  const Prediction found = MachineReplica(record, machine, std::nullopt).predict(machine);
  EXPECT_TRUE(std::isnan(found[0][0]) && std::isnan(found[0][299]));
  EXPECT_NEAR(found[0][990], command.value[990], 1e-6);
}

TEST(SplineDerivative, IsExactForAParabolaInsideAndFourthOrderForASine) {
  std::vector<double> parabola, sine;
  for (int i = 0; i < 200; ++i) {
    parabola.push_back(3 + 2 * i * 0.01 + 5 * i * i * 1e-4);
    sine.push_back(std::sin(i * 0.1));
  }
  const std::vector<double> d = spline_derivative(parabola, 0.01);
  for (int i = 30; i < 170; ++i)
    EXPECT_NEAR(d[static_cast<std::size_t>(i)], 2 + 10 * i * 0.01, 1e-12);
  const std::vector<double> c = spline_derivative(sine, 0.1);
  double largest = 0;
  for (int i = 30; i < 170; ++i)
    largest = std::max(largest, std::abs(c[static_cast<std::size_t>(i)] - std::cos(i * 0.1)));
  EXPECT_LT(largest, 1.1 * std::pow(0.1, 4) / 180);  // h^4/180 f^(5)
  EXPECT_GT(largest, 0.9 * std::pow(0.1, 4) / 180);
}

}  // namespace
}  // namespace vcnc::replica_test
