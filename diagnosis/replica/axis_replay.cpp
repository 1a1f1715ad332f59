#include "diagnosis/replica/axis_replay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "diagnosis/candidates/effect_stage.hpp"
#include "diagnosis/parallel.hpp"
#include "diagnosis/records/record.hpp"
#include "model/drive/axis_drive.hpp"
#include "model/fingerprint.hpp"
#include "model/probe/probe_sensor.hpp"

namespace vcnc {

static_assert(kTruthPerCycle == kDriveLoopSteps);

namespace {

constexpr std::uint64_t kSeed = 1;  // of noise that a replica does not have

/// An axis of which no command is known: it is where it was measured.
AxisReplay as_measured(const std::vector<double>& position, std::size_t cycles, double start) {
  AxisReplay replay;
  replay.measured = replay.twist = replay.force = std::vector<double>(cycles, kMissing);
  replay.truth.resize(cycles * kTruthPerCycle, start);
  if (position.empty()) return replay;
  for (std::size_t k = 0; k < cycles; ++k) {
    const double from = position[k > 0 ? k - 1 : 0], way = position[k] - from;
    for (std::size_t j = 0; j < kTruthPerCycle; ++j)
      replay.truth[k * kTruthPerCycle + j] =
          from + way * static_cast<double>(j + 1) / static_cast<double>(kTruthPerCycle);
  }
  return replay;
}

/// Commands of all axes for the end of a cycle.
struct Command {
  AxisVector position, velocity;
};

class Commands {
 public:
  Commands(const Machine& actual, const CommandedMotion& motion) : motion_(motion) {
    for (std::size_t i = 0; i < kAxisCount; ++i) start_[i] = actual.axes[i].limits.start;
    start_ = motion.start(start_);
  }
  const AxisVector& start() const { return start_; }
  Command at(std::size_t cycle) const {
    Command c{start_, {}};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (motion_.position[i].empty()) continue;
      c.position[i] = motion_.position[i][cycle];
      c.velocity[i] = motion_.velocity[i][cycle];
    }
    return c;
  }

 private:
  const CommandedMotion& motion_;
  AxisVector start_;
};

/// Says when a drive has come to rest: its set-point stands, and in a while nothing that it tells
/// has changed by more than rounding does.
template <class Real>
class Rest {
 public:
  bool comes(const Command& command, const AxisCycleOf<Real>& cycle, std::size_t axis) {
    const bool stands = command.velocity[axis] == 0 && command.position[axis] == commanded_;
    const bool still = stands && same(cycle.measured, last_.measured, kPosition) &&
                       same(cycle.second, last_.second, kPosition) &&
                       same(cycle.truth.back(), last_.truth.back(), kPosition) &&
                       same(cycle.force, last_.force, kForce);
    commanded_ = command.position[axis];
    last_ = cycle;
    cycles_ = still ? cycles_ + 1 : 0;
    return cycles_ >= kCycles;
  }
  /// Whether the drive, at rest, is told nothing new.
  bool lasts(const Command& command, std::size_t axis) const {
    return command.velocity[axis] == 0 && command.position[axis] == commanded_;
  }

 private:
  static constexpr double kPosition = 1e-14;  // [m or rad]
  static constexpr double kForce = 1e-10;     // share of the limit
  static constexpr std::size_t kCycles = 20;

  static bool same(const Real& a, const Real& b, double within) {
    using std::abs;
    return all(abs(a - b) < Real(within));
  }

  double commanded_ = std::numeric_limits<double>::quiet_NaN();
  AxisCycleOf<Real> last_;
  std::size_t cycles_ = 0;
};

/// The force on the load that no effect makes, taken from where the healthy machine was when it was
/// as fast: friction turns over where an axis does, however late that is. Of an axis that moves as
/// the healthy one did by tau ago,
///
///   v0 - v = tau a0,
///
/// so tau comes from the mean products of both sides with a0, over some 50 ms. What dry friction
/// does that its model has not grows with it.
template <class Real>
class LateForce {
 public:
  LateForce(const UnknownForce& of, std::size_t axis, const PerLane<Real, AxisVariant>& variants)
      : of_(of) {
    for (std::size_t n = 0; n < kLanesOf<Real>; ++n) {
      const double dry = variants[n].actual.effects.axis[axis].template get<Coulomb>().level;
      times_[n] = of.dry_friction > 0 ? std::clamp(dry / of.dry_friction, 0.0, kMostTimes) : 1;
    }
    double most = 0;
    for (std::size_t k = 1; k < of.velocity.size(); ++k)
      most = std::max(most, std::pow(gain(k), 2));
    least_ = kLeast * most;
  }
  bool some() const { return !of_.slow.empty(); }
  /// Whether it is the same at the end of a cycle as at its beginning.
  bool lasts(std::size_t cycle) const {
    return !some() ||
           (of_.slow[cycle] == of_.slow[cycle - 1] && of_.quick[cycle] == of_.quick[cycle - 1]);
  }
  /// At the end of a cycle, of a drive that measured these positions at the ends of those before.
  Real at(std::size_t cycle, const Real& position, const Real& before) {
    Real force{};
    const bool moves = cycle > 1 && !of_.velocity.empty();
    const double a0 = moves ? gain(cycle - 1) : 0, v0 = moves ? of_.velocity[cycle - 1] : 0;
    own_ = kKept * own_ + a0 * a0;
    for (std::size_t n = 0; n < kLanesOf<Real>; ++n) {
      const double v = (lane(position, n) - lane(before, n)) / kCycle;
      products_[n] = kKept * products_[n] + (moves ? (v0 - v) * a0 : 0);
      const double late = own_ > 0 ? products_[n] / (own_ + least_) : 0;
      const double then = static_cast<double>(cycle) - std::clamp(late, -kMost, kMost);
      set_lane(force, n, times_[n] * told(then));
    }
    return force;
  }

 private:
  static constexpr double kCycle = 1e-3;  // [s]
  static constexpr double kKept = 0.98;   // from cycle to cycle
  static constexpr double kMost = 20;     // cycles
  static constexpr double kLeast = 0.2;   // of the largest square of a0
  static constexpr double kMostTimes = 3;

  /// Of velocity within a cycle.
  double gain(std::size_t cycle) const { return of_.velocity[cycle] - of_.velocity[cycle - 1]; }
  double told(double cycle) const {
    const double last = static_cast<double>(of_.slow.size() - 1), at = std::clamp(cycle, 0.0, last);
    const auto i = static_cast<std::size_t>(at), next = std::min(i + 1, of_.slow.size() - 1);
    const double part = at - static_cast<double>(i);
    return std::lerp(of_.slow[i] + of_.quick[i], of_.slow[next] + of_.quick[next], part);
  }

  const UnknownForce& of_;
  double least_ = 0, own_ = 0;
  PerLane<Real, double> products_{}, times_{};
};

/// Replays on any number of lanes with `per_cycle` truths; after_cycle(k) is called after each.
template <class Real, class F>
std::vector<AxisReplay> replay_lanes(AxisDriveOf<Real>& drive, std::size_t axis,
                                     const PerLane<Real, AxisVariant>& variants,
                                     const CommandedMotion& motion, std::size_t per_cycle,
                                     F&& after_cycle) {
  const std::size_t cycles = motion.known.size(), lanes = kLanesOf<Real>;
  const Commands commands(variants[0].actual, motion);
  std::vector<std::vector<double>> measured(lanes, std::vector<double>(cycles)), twist = measured,
                                                                                 force = measured;
  std::vector<AxisReplay> replays(lanes);
  for (std::size_t n = 0; n < lanes; ++n) {
    replays[n].per_cycle = per_cycle;
    replays[n].truth.resize(cycles * per_cycle, start_position(variants[n].actual, kSeed)[axis]);
    measured[n][0] = commands.start()[axis];
  }
  const double full_force = variants[0].hypothesis.axes[axis].mechanics.force_limit;
  const std::vector<KnownForce>& known = motion.force[axis];
  const bool can_rest = drive.can_rest() && known.empty();
  bool rests = false;
  Rest<Real> rest;
  LateForce<Real> unknown(motion.unknown[axis], axis, variants);
  AxisCycleOf<Real> cycle;
  for (std::size_t n = 0; n < lanes; ++n) set_lane(cycle.measured, n, commands.start()[axis]);
  Real before = cycle.measured;
  for (std::size_t k = 1; k < cycles; ++k) {
    const Command command = commands.at(k);
    if (rests && rest.lasts(command, axis) && unknown.lasts(k)) {
      drive.rest();
    } else {
      if (unknown.some()) {
        drive.tell_load_force(unknown.at(k, cycle.measured, before));
        before = cycle.measured;
      }
      drive.tell_commands(command.position, command.velocity);
      if (!known.empty()) drive.tell_force(known[k]);
      cycle = drive.follow({Real(command.position[axis]), Real(command.velocity[axis])});
      rests = rest.comes(command, cycle, axis) && can_rest;
    }
    for (std::size_t n = 0; n < lanes; ++n) {
      measured[n][k] = lane(cycle.measured, n);
      twist[n][k] = lane(cycle.second, n);
      force[n][k] = lane(cycle.force, n) * full_force;
      for (std::size_t j = 0; j < per_cycle; ++j)
        replays[n].truth[k * per_cycle + j] = lane(cycle.truth[kTruthPerCycle - per_cycle + j], n);
    }
    after_cycle(k);
  }
  for (std::size_t n = 0; n < lanes; ++n) {
    replays[n].measured = std::move(measured[n]);
    replays[n].twist = std::move(twist[n]);
    replays[n].force = std::move(force[n]);
  }
  return replays;
}

constexpr auto nothing = [](std::size_t) {};

/// f(0), f(1), ... as an array.
template <class Real, class F>
auto per_lane(F&& f) {
  return [&]<std::size_t... n>(std::index_sequence<n...>) {
    return PerLane<Real, decltype(f(std::size_t{0}))>{f(n)...};
  }
  (std::make_index_sequence<kLanesOf<Real>>());
}

/// The late truth of every cycle, whose others the drive need not know.
template <class Real>
std::vector<AxisReplay> replay_late(AxisDriveOf<Real> drive, std::size_t axis,
                                    const PerLane<Real, AxisVariant>& variants,
                                    const CommandedMotion& motion) {
  drive.skip_early_truth(kTruthPerCycle - kLateTruth);
  return replay_lanes<Real>(drive, axis, variants, motion, kLateTruth, nothing);
}

/// Fewer drives than this are stepped each alone: as many as there are lanes cost as much as five.
constexpr std::size_t kWorthLanes = 6;

}  // namespace

AxisReplay replay_axis(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                       const CommandedMotion& motion) {
  if (motion.told[axis] != CommandedMotion::Told::command)
    return as_measured(motion.position[axis], motion.known.size(), actual.axes[axis].limits.start);
  AxisDrive drive(hypothesis, axis, kSeed);
  return std::move(replay_lanes<double>(drive, axis, {AxisVariant{hypothesis, actual}}, motion,
                                        kTruthPerCycle, nothing)[0]);
}

WatchedReplay replay_watched(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                             const CommandedMotion& motion) {
  WatchedReplay watched;
  if (motion.told[axis] != CommandedMotion::Told::command) {
    watched.replay = replay_axis(hypothesis, actual, axis, motion);
    return watched;
  }
  AxisDrive drive(hypothesis, axis, kSeed);
  std::array<LoadMotion, kDriveLoopSteps> load;
  drive.watch(load);
  watched.late.resize(motion.known.size() * kLateTruth);
  watched.replay = std::move(replay_lanes<double>(
      drive, axis, {AxisVariant{hypothesis, actual}}, motion, kLateTruth, [&](std::size_t k) {
        std::copy_n(load.end() - kLateTruth, kLateTruth,
                    watched.late.begin() + static_cast<std::ptrdiff_t>(k * kLateTruth));
      })[0]);
  return watched;
}

std::optional<AxisReplay> displaced(const WatchedReplay& drive, const Machine& hypothesis,
                                    const Machine& actual, std::size_t axis) {
  const bool of_motions = std::any_of(
      hypothesis.effects.laws.begin(), hypothesis.effects.laws.end(), [&](const Law& law) {
        return law.axis_index() == axis && law.point == Law::Point::displacement &&
               (law.over != Covariate::time || law.times != Covariate::time);
      });
  const Motions<double> unasked{};
  Chain<DisplacementPort> chain = axis_chain<DisplacementPort>(hypothesis.effects, axis, kSeed);
  if (of_motions || drive.late.empty() || chain.remembers()) return std::nullopt;
  AxisReplay replay = drive.replay;
  std::fill_n(replay.truth.begin(), kLateTruth, start_position(actual, kSeed)[axis]);
  for (std::size_t s = kLateTruth; s < drive.late.size(); ++s) {
    const LoadMotion& load = drive.late[s];
    const std::size_t cycle = s / kLateTruth - 1, after = s % kLateTruth + 1;  // from 1 ms on
    const auto count =
        static_cast<std::int64_t>(cycle * kTruthPerCycle + kTruthPerCycle - kLateTruth + after);
    DisplacementPort::Signal<double> signal;
    chain.step(signal,
               {.moment = {static_cast<double>(count) * kDriveLoopTime, kDriveLoopTime, count},
                .load = load.load,
                .force = load.force,
                .axes = &unasked});
    replay.truth[s] = load.load.position + signal.displacement;
  }
  return replay;
}

std::vector<AxisReplay> replay_variants(const std::vector<AxisVariant>& variants, std::size_t axis,
                                        const CommandedMotion& motion) {
  std::vector<AxisReplay> replays(variants.size());
  if (motion.told[axis] != CommandedMotion::Told::command) {
    for (std::size_t i = 0; i < variants.size(); ++i)
      replays[i] = replay_axis(variants[i].hypothesis, variants[i].actual, axis, motion);
    return replays;
  }
  std::vector<std::size_t> left;
  std::vector<AxisDrive> drives;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    left.push_back(i);
    drives.emplace_back(variants[i].hypothesis, axis, kSeed);
  }
  std::vector<std::vector<std::size_t>> groups, singles;
  while (!left.empty()) {
    std::vector<std::size_t> group, rest;
    for (const std::size_t i : left) {
      const bool joins =
          group.empty() || (group.size() < kLanes && drives[i].suits(drives[group.front()]));
      (joins ? group : rest).push_back(i);
    }
    left = std::move(rest);
    if (group.size() < kWorthLanes)
      for (const std::size_t i : group) singles.push_back({i});
    else
      groups.push_back(std::move(group));
  }
  groups.insert(groups.end(), singles.begin(), singles.end());  // what takes longest comes first
  parallel_for(groups.size(), [&](std::size_t g) {
    const std::vector<std::size_t>& group = groups[g];
    if (group.size() == 1) {
      const std::size_t i = group.front();
      replays[i] =
          std::move(replay_late<double>(std::move(drives[i]), axis, {variants[i]}, motion)[0]);
      return;
    }
    std::vector<AxisDrive> together;
    for (const std::size_t i : group) together.push_back(std::move(drives[i]));
    std::vector<AxisReplay> lanes = replay_late<Lanes>(
        AxisDriveLanes(std::move(together)), axis, per_lane<Lanes>([&](std::size_t n) {
          return variants[group[std::min(n, group.size() - 1)]];
        }),
        motion);
    for (std::size_t n = 0; n < group.size(); ++n) replays[group[n]] = std::move(lanes[n]);
  });
  return replays;
}

AxisFingerprint fingerprint_of_axis(const Machine& hypothesis, const Machine& actual,
                                    std::size_t axis) {
  Fingerprint drive, displacement;
  const bool rotary = is_rotary(axis);
  AxisParams::fields(hypothesis.axes[axis], drive, rotary);
  AxisParams::fields(actual.axes[axis], drive, rotary);
  for_each_effect_of(actual.effects, [&]<class Effect>(const Effect& effect, std::size_t of) {
    if (of != axis || stage_of<typename Effect::Port>() != EffectStage::drive || effect.null())
      return;
    Fingerprint& print =
        std::is_same_v<typename Effect::Port, DisplacementPort> ? displacement : drive;
    add_effect(print, effect, of);
  });
  for (const Law& law : actual.effects.laws)
    if (law.axis_index() == axis && law.point != Law::Point::reading)
      Law::fields(law, law.point == Law::Point::displacement ? displacement : drive);
  return {drive.bytes(), displacement.bytes()};
}

}  // namespace vcnc
