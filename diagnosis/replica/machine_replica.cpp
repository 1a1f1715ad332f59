#include "diagnosis/replica/machine_replica.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <list>
#include <map>
#include <mutex>
#include <stdexcept>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/effect_stage.hpp"
#include "diagnosis/parallel.hpp"
#include "diagnosis/records/late_velocity.hpp"
#include "diagnosis/records/series.hpp"
#include "model/parameters.hpp"

namespace vcnc {

namespace {

constexpr double kCycleTime = 1e-3;     // [s]
constexpr double kUnknownForce = 0.05;  // standard deviation, of a force that a healthy run tells
constexpr std::size_t kSlowly = 50;     // of a mean to either side [cycles]
constexpr double kStill = 1e-4;         // an axis across the plane of a bar moves by less [m]
constexpr std::size_t kAxisReplays = 6, kWatched = 1, kPoses = 4, kBalls = 8;

/// The commands at 1 ms.
CommandedMotion at_cycles(const CommandedMotion& motion, double period) {
  if (std::abs(period - kCycleTime) < 1e-9) return motion;
  CommandedMotion result;
  result.told = motion.told;
  result.followed = motion.followed;
  const std::size_t samples = motion.known.size();
  const double duration = static_cast<double>(samples - 1) * period;
  const auto cycles = static_cast<std::size_t>(std::floor(duration / kCycleTime + 1e-9)) + 1;
  result.known.assign(cycles, true);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const std::vector<double>&x = motion.position[axis], &v = motion.velocity[axis];
    if (x.empty()) continue;
    for (std::size_t k = 0; k < cycles; ++k) {
      const double at = static_cast<double>(k) * kCycleTime / period;
      const auto i = std::min(static_cast<std::size_t>(at), samples - 2);
      const double s = at - static_cast<double>(i);
      const double b = v[i] * period, b_end = v[i + 1] * period, way = x[i + 1] - x[i];
      const double c = 3 * way - 2 * b - b_end, d = b + b_end - 2 * way;
      result.position[axis].push_back(x[i] + s * (b + s * (c + s * d)));
      result.velocity[axis].push_back((b + s * (2 * c + s * 3 * d)) / period);
      if (const std::vector<KnownForce>& f = motion.force[axis]; !f.empty())
        result.force[axis].push_back({std::lerp(f[i].added, f[i + 1].added, s),
                                      std::lerp(f[i].applied, f[i + 1].applied, s)});
    }
  }
  return result;
}

/// What was recorded, at 1 ms by straight lines.
std::vector<double> at_cycles(const std::vector<double>& value, double period, std::size_t cycles) {
  std::vector<double> result(cycles, kMissing);
  for (std::size_t k = 0; k < cycles; ++k) {
    const double at = static_cast<double>(k) * kCycleTime / period;
    const auto i = static_cast<std::size_t>(at + 1e-9);
    const double part = std::max(0.0, at - static_cast<double>(i));
    if (i >= value.size()) break;
    result[k] = i + 1 < value.size() && part > 1e-9 ? value[i] + part * (value[i + 1] - value[i])
                                                    : value[i];
  }
  return result;
}

/// Whether something else tells where the motor of an axis is.
bool motor_is_told(const Record& record, const Machine& declared, std::size_t axis) {
  return record.find(SignalKind::twist, axis) ||
         (record.find(SignalKind::position, axis) &&
          declared.axes[axis].servo.feedback == ServoParams::Feedback::motor);
}

std::vector<ComparedChannel> channels_of(const Record& record, const CommandedMotion& motion,
                                         const Machine& declared) {
  std::vector<ComparedChannel> channels;
  for (const MeasuredSignal& signal : record.signals) {
    if (!is_compared(signal.kind)) continue;
    if (signal.kind == SignalKind::position && motion.followed[signal.axis]) continue;
    if (signal.kind == SignalKind::velocity && motor_is_told(record, declared, signal.axis))
      continue;
    if (is_reading(signal.kind) || motion.told[signal.axis] == CommandedMotion::Told::command)
      channels.push_back({signal.kind, signal.axis});
  }
  return channels;
}

SignalKind reading_kind(const Record& record) {
  if (!record.on_table) return SignalKind::deflection;
  return record.on_table->is_bar() ? SignalKind::bar : SignalKind::tool_position;
}

/// Of a drive that goes where its axis was measured, more closely than any that is recorded: its
/// loops cross over as high as keeps them stable with what turns at the motor alone.
ServoParams follower(const MechanicsParams& m) {
  constexpr double kLeastHz = 80, kMostHz = 300, kMotorHz = 1000;
  const double of_motor = 1 - m.load / m.total_inertia();
  ServoParams servo;
  servo.kv_per_s = 200;
  servo.velocity_bandwidth = std::clamp(kMotorHz * of_motor, kLeastHz, kMostHz);
  servo.integral_time = 5e-3;
  servo.feedback = ServoParams::Feedback::motor;
  return servo;
}

/// a + factor b
Deflections sum(const Deflections& a, const Deflections& b, double factor) {
  Deflections result = a;
  for (std::size_t c = 0; c < a.size(); ++c)
    for (std::size_t k = 0; k < a[c].size(); ++k) result[c][k] += factor * b[c][k];
  return result;
}

}  // namespace

template <class T>
class MachineReplica::Memory {
 public:
  explicit Memory(std::size_t capacity) : capacity_(capacity) {}

  void clear() { kept_.clear(); }

  /// What is kept under `print`; null: nothing.
  std::shared_ptr<const T> find(const std::string& print) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const auto& entry) { return entry.first == print; });
    if (found == kept_.end()) return nullptr;
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front().second;
  }

  /// What is kept under `print`, or what `make` makes of it now.
  template <class Make>
  std::shared_ptr<const T> find_or_make(const std::string& print, Make&& make) {
    if (auto kept = find(print)) return kept;
    auto made = std::make_shared<const T>(make());  // two threads may make the same
    const std::lock_guard lock(mutex_);
    kept_.emplace_front(print, made);
    if (kept_.size() > capacity_) kept_.pop_back();
    return made;
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<const T>>> kept_;  ///< last used first
};

/// A machine as the replica takes it.
struct MachineReplica::Hypothesis {
  Machine machine;                   ///< without chance, starting where the record does
  Machine actual;                    ///< with its deviations applied
  PerAxis<std::string> drive, axis;  ///< fingerprints, without and with displacements
  std::string contact;               ///< without the axes
  std::string ball, sensing, only_in_full;
};

struct MachineReplica::Anchor {
  Anchor(const Hypothesis& h, const AxisReplays& axes)
      : contact(h.contact),
        ball(h.ball),
        sensing(h.sensing),
        only_in_full(h.only_in_full),
        lifts(vcnc::lifts(h.actual)),
        poses(h.actual, axes) {}

  /// Whether the probe of a machine is computed in full.
  bool needs_full(const Hypothesis& h) const {
    return lifts || vcnc::lifts(h.actual) || h.only_in_full != only_in_full;
  }

  std::string contact, ball, sensing, only_in_full;
  bool lifts;
  NearbyPoses poses;
  ProbeReplay full;
  Deflections off_record;
  Deflections ball_offset;     ///< full less quick
  Deflections reading_offset;  ///< the same, both of the full ball
  Deflections reading;         ///< of the anchor, with signal errors where they were measured
};

MachineReplica::MachineReplica(const Record& record, const Machine& declared,
                               const std::optional<PieceParams>& piece)
    : declared_(declared), period_(record.period), samples_(record.samples()) {
  if (samples_ < 2) throw std::invalid_argument("holds no motion");
  const CommandedMotion motion = commanded_motion(record);
  channels_ = channels_of(record, motion, declared);
  for (const ComparedChannel& c : channels_)
    if (c.kind == SignalKind::velocity)
      late_velocity_[c.axis] = lateness_of_velocity(record, c.axis).value_or(0);
  probes_ = std::any_of(channels_.begin(), channels_.end(),
                        [](const ComparedChannel& c) { return is_reading(c.kind); });
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (const MeasuredSignal* twist = record.find(SignalKind::twist, axis);
        twist && twist->relative)
      relative_twist_[axis] = twist->value;
  known_ = motion.known;
  motion_ = at_cycles(motion, period_);
  for (std::size_t c = 0; c < measured_.size(); ++c)
    if (const MeasuredSignal* signal = record.find(reading_kind(record), c))
      measured_[c] = at_cycles(signal->value, period_, motion_.known.size());
  if (piece) piece_ = make_piece(*piece);
  against_.piece = piece_.get();
  if (record.on_table) hold_against(*record.on_table, record);
  for (auto& memory : axis_memory_) memory = std::make_unique<Memory<AxisReplay>>(kAxisReplays);
  for (auto& memory : watched_) memory = std::make_unique<Memory<WatchedReplay>>(kWatched);
  pose_memory_ = std::make_unique<Memory<Poses>>(kPoses);
  ball_memory_ = std::make_unique<Memory<Deflections>>(kBalls);
  anchor(declared);
}

MachineReplica::~MachineReplica() = default;

/// Where the tool is when the linear axes bring it there, the rotary ones as they begin.
void MachineReplica::hold_against(const OnTable& it, const Record& record) {
  AxisVector stands;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    stands[axis] = declared_.axes[axis].limits.start;
  AxisVector q = motion_.start(stands);
  std::vector<std::size_t> still;
  for (const std::size_t axis : {kX, kY, kZ}) {
    q[axis] = it.zero[static_cast<Eigen::Index>(axis)];
    const std::vector<double>& x = motion_.position[axis];
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    if (x.empty() || *high - *low < kStill) still.push_back(axis);
  }
  const Kinematics kinematics(declared_.kinematics, declared_.probe.length,
                              declared_.setup.work_offset[0]);
  const Eigen::Matrix3d R_WS = kinematics.jacobian(q).leftCols<3>();  // X, Y, Z in the table
  against_.on_table = {kinematics.forward(q).p_WT, it.bar_length, R_WS.transpose()};
  if (still.size() == 1 && (it.is_bar() || !record.find(SignalKind::tool_position, still.front())))
    across_ = R_WS.col(static_cast<Eigen::Index>(still.front())).normalized();
}

bool MachineReplica::knows_forces() const {
  return std::any_of(motion_.unknown.begin(), motion_.unknown.end(),
                     [](const UnknownForce& of) { return !of.slow.empty(); });
}

void MachineReplica::apply(const PerAxis<std::vector<double>>& unknown) {
  const auto is_none = [](const std::vector<double>& force) { return force.empty(); };
  if (!knows_forces() && std::all_of(unknown.begin(), unknown.end(), is_none)) return;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    UnknownForce& of = motion_.unknown[axis] = {};
    if (!unknown[axis].empty()) {
      of.quick = at_cycles(unknown[axis], period_, motion_.known.size());
      const double size = std::sqrt(mean_square(of.quick));
      of.slow = moving_mean(of.quick, kSlowly);
      for (std::size_t k = 0; k < of.slow.size(); ++k) of.quick[k] -= of.slow[k];
      const double dry = actual(declared_).effects.axis[axis].get<Coulomb>().level;
      if (dry > size) of.dry_friction = dry;
    }
    axis_memory_[axis]->clear();
    watched_[axis]->clear();
  }
  pose_memory_->clear();
  ball_memory_->clear();
  const Hypothesis h = hypothesis_of(declared_);
  parallel_for(kAxisCount, [&](std::size_t axis) {
    UnknownForce& of = motion_.unknown[axis];
    if (of.slow.empty()) return;
    const AxisReplay replay = replay_axis(h.machine, h.actual, axis, motion_);
    of.velocity.assign(replay.measured.size(), 0.0);
    for (std::size_t k = 1; k < of.velocity.size(); ++k)
      of.velocity[k] = (replay.measured[k] - replay.measured[k - 1]) / kCycleTime;
  });
  anchored_.clear();
  anchor(declared_);
}

/// A follower has loops of its own.
void MachineReplica::forget_loops_of_followed(Machine& machine) const {
  std::erase_if(machine.effects.deviations, [&](const Deviation& d) {
    const auto number = find_parameter(machine, d.key);
    for (std::size_t axis = 0; number && axis < kAxisCount; ++axis) {
      const auto* servo = reinterpret_cast<const std::byte*>(&machine.axes[axis].servo);
      const auto* at = reinterpret_cast<const std::byte*>(number->value);
      if (motion_.followed[axis] && at >= servo && at < servo + sizeof(ServoParams)) return true;
    }
    return false;
  });
}

MachineReplica::Hypothesis MachineReplica::hypothesis_of(const Machine& machine,
                                                         Encoders encoders) const {
  Hypothesis h;
  h.machine = as_hypothesis(declared_, machine);
  for_each_effect_of(h.machine.effects, [&]<class Effect>(Effect& effect, std::size_t axis) {
    const bool stays =
        std::is_same_v<Effect, EncoderQuantisation> && encoders == Encoders::rounding;
    // What sets loops and set-points says nothing of a drive that is followed.
    const bool unseen = is_of_loops<Effect>() && axis < kAxisCount && motion_.followed[axis];
    if ((is_chance<Effect>() && !stays) || unseen) effect = Effect();
    if constexpr (is_of_touch<Effect>())  // it is declared of another device
      if (against_.on_table && !declared_.effects.get<Effect>().null()) effect = Effect();
  });
  forget_loops_of_followed(h.machine);
  if (!across_.isZero()) {
    Vec3& shift = h.machine.effects.get<PieceOffset>().shift;
    shift -= across_ * across_.dot(shift);
    Vec3& tilt = h.machine.effects.get<PieceTilt>().tilt;
    tilt =
        against_.on_table->bar_length > 0 ? Vec3(Vec3::Zero()) : Vec3(across_ * across_.dot(tilt));
  }
  h.actual = vcnc::actual(h.machine);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (motion_.followed[axis])
      h.machine.axes[axis].servo = h.actual.axes[axis].servo =
          follower(declared_.axes[axis].mechanics);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (!motion_.position[axis].empty())
      h.machine.axes[axis].limits.start = h.actual.axes[axis].limits.start =
          motion_.position[axis].front();
  h.ball = h.contact = fingerprint_of_contact(h.actual);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const AxisFingerprint print = fingerprint_of_axis(h.machine, h.actual, axis);
    h.drive[axis] = print.drive;
    h.axis[axis] = print.drive + "|" + print.displacement;
    h.ball += h.axis[axis];
  }
  h.sensing = fingerprint_of_sensing(h.actual);
  h.only_in_full = fingerprint_of_full_probe(h.actual);
  return h;
}

AxisReplays MachineReplica::axes_of(const Hypothesis& h) const {
  AxisReplays replays;
  parallel_for(kAxisCount, [&](std::size_t axis) {
    replays[axis] =
        axis_memory_[axis]->find_or_make(h.axis[axis], [&] { return replayed(h, axis); });
  });
  return replays;
}

/// With its signals at the record's samples.
AxisReplay MachineReplica::replayed(const Hypothesis& h, std::size_t axis) const {
  AxisReplay replay = replay_axis(h.machine, h.actual, axis, motion_);
  sample_as_recorded(replay, axis);
  return replay;
}

void MachineReplica::sample_as_recorded(AxisReplay& replay, std::size_t axis) const {
  if (const auto& late = late_velocity_[axis])
    replay.velocity = as_recorded(motor_velocity(replay, axis), *late);
  for (SharedSeries* s : {&replay.measured, &replay.twist, &replay.force}) *s = as_recorded(*s);
  if (const auto& counted = relative_twist_[axis])
    replay.twist = with_mean_of(*counted, replay.twist);
}

/// At every cycle, from the two beside it.
std::vector<double> MachineReplica::motor_velocity(const AxisReplay& replay,
                                                   std::size_t axis) const {
  const bool of_load = declared_.axes[axis].servo.feedback == ServoParams::Feedback::load;
  const auto motor = [&](std::size_t k) {
    return replay.measured[k] - (of_load ? replay.twist[k] : 0);
  };
  const std::size_t cycles = replay.measured.size();
  std::vector<double> velocity(cycles, 0.0);
  for (std::size_t k = 1; k + 1 < cycles; ++k)
    velocity[k] = (motor(k + 1) - motor(k - 1)) / (2 * kCycleTime);
  return velocity;
}

/// On the anchor's axes.
std::shared_ptr<const Poses> MachineReplica::poses_of(const Hypothesis& h) const {
  if (h.contact == anchor_->contact) return {std::shared_ptr<void>(), &anchor_->poses.poses()};
  return pose_memory_->find_or_make(h.contact,
                                    [&] { return replay_poses(h.actual, anchor_->poses.axes()); });
}

/// Quickly.
std::shared_ptr<const Deflections> MachineReplica::ball_of(const Hypothesis& h,
                                                           const AxisReplays& axes) const {
  return ball_memory_->find_or_make(h.ball, [&] {
    if (h.contact != anchor_->contact && poses_follow_dynamics(h.actual)) {
      const Poses poses = replay_poses(h.actual, axes);
      return replay_contact(h.actual, against_, {anchor_->poses, poses, anchor_->poses.axes()});
    }
    const auto poses = poses_of(h);
    return replay_contact(h.actual, against_, {anchor_->poses, *poses, axes});
  });
}

bool MachineReplica::anchor(const Machine& machine) {
  const Hypothesis h = hypothesis_of(machine);
  std::string print = h.ball + "|" + h.sensing;
  if (print == anchored_) return false;
  if (!probes_) {
    anchored_ = std::move(print);
    return true;
  }
  const AxisReplays axes = axes_of(h);
  std::unique_ptr<Anchor> anchor;
  ProbeReplay full;
  Deflections quick;
  parallel_for(2, [&](std::size_t i) {
    if (i == 0) {
      full = replay_probe(h.actual, against_, axes);
      return;
    }
    anchor = std::make_unique<Anchor>(h, axes);
    quick = replay_contact(h.actual, against_,
                           {anchor->poses, anchor->poses.poses(), anchor->poses.axes()});
  });
  anchor->off_record = off_record(full.reading);
  anchor->ball_offset = sum(full.ball, quick, -1);
  anchor->reading_offset = sum(full.reading, replay_sensing(h.actual, full.ball, axes), -1);
  anchor->reading = signals_err(h.actual) && !anchor->lifts
                        ? sum(replay_sensing(h.actual, full.ball, axes, &anchor->off_record),
                              anchor->reading_offset, 1)
                        : full.reading;
  anchor->full = std::move(full);
  anchor_ = std::move(anchor);
  anchored_ = std::move(print);
  pose_memory_->clear();  // they hold what was seen from another anchor
  ball_memory_->clear();
  return true;
}

Deflections MachineReplica::reading_of(const Hypothesis& h, const AxisReplays& axes) const {
  if (h.ball == anchor_->ball && h.sensing == anchor_->sensing) return anchor_->reading;
  if (anchor_->needs_full(h)) return replay_probe(h.actual, against_, axes).reading;
  const Deflections ball = sum(*ball_of(h, axes), anchor_->ball_offset, 1);
  // Where in their period the signals are is known from the record, wherever the ball is held to
  // be.
  const Deflections at = signals_err(h.actual)
                             ? sum(sum(anchor_->full.ball, ball, -1), anchor_->off_record, 1)
                             : Deflections{};
  return sum(replay_sensing(h.actual, ball, axes, signals_err(h.actual) ? &at : nullptr),
             anchor_->reading_offset, 1);
}

/// What was measured less `reading`, as a moving mean, a period of the signals at most. A sample's
/// own noise is not in its mean: some of it would be foretold then.
Deflections MachineReplica::off_record(const Deflections& reading) const {
  constexpr std::size_t kReach = 10;  // cycles
  const double most = declared_.probe.signal_period;
  Deflections off;
  for (std::size_t c = 0; c < off.size(); ++c) {
    const std::size_t n = reading[c].size();
    off[c].assign(n, 0.0);
    if (measured_[c].size() != n) continue;
    std::vector<double> sum(n + 1, 0.0), count(n + 1, 0.0);
    for (std::size_t k = 0; k < n; ++k) {
      const double d = measured_[c][k] - reading[c][k];
      const bool known = std::isfinite(d);
      sum[k + 1] = sum[k] + (known ? d : 0);
      count[k + 1] = count[k] + (known ? 1 : 0);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t first = k > kReach ? k - kReach : 0, last = std::min(n, k + kReach + 1);
      const double known = count[last] - count[first] - (count[k + 1] - count[k]);
      const double others = sum[last] - sum[first] - (sum[k + 1] - sum[k]);
      if (known > 0) off[c][k] = std::clamp(others / known, -most, most);
    }
  }
  return off;
}

/// Values at the record's samples of what is known at every cycle, and was recorded late [s].
std::vector<double> MachineReplica::as_recorded(const std::vector<double>& per_cycle,
                                                double late) const {
  std::vector<double> result(samples_, kMissing);
  const bool same = late == 0 && std::abs(period_ - kCycleTime) < 1e-9;
  for (std::size_t i = 0; i < samples_; ++i) {
    if (!known_[i]) continue;
    if (same) {
      result[i] = per_cycle[i];
      continue;
    }
    const double at = std::max(0.0, (static_cast<double>(i) * period_ - late) / kCycleTime);
    const auto k = static_cast<std::size_t>(at);
    if (k + 1 < per_cycle.size())
      result[i] = per_cycle[k] + (per_cycle[k + 1] - per_cycle[k]) * (at - static_cast<double>(k));
  }
  return result;
}

Prediction MachineReplica::assembled(const AxisReplays& axes, const Deflections& reading) const {
  Prediction all;
  for (const ComparedChannel& channel : channels_) {
    switch (channel.kind) {
      case SignalKind::position:
        all.push_back(axes[channel.axis]->measured);
        break;
      case SignalKind::twist:
        all.push_back(axes[channel.axis]->twist);
        break;
      case SignalKind::velocity:
        all.push_back(axes[channel.axis]->velocity);
        break;
      case SignalKind::force:
        all.push_back(axes[channel.axis]->force);
        break;
      default:
        all.push_back(as_recorded(reading[channel.axis]));
        break;
    }
  }
  return all;
}

Prediction MachineReplica::predict(const Machine& machine) const {
  const Hypothesis h = hypothesis_of(machine);
  return predict(h, axes_of(h));
}

std::vector<std::vector<double>> MachineReplica::rounding(const Machine& machine) const {
  const Hypothesis exact = hypothesis_of(machine),
                   rounded = hypothesis_of(machine, Encoders::rounding);
  if (exact.axis == rounded.axis) return {};
  const Prediction before = predict(exact, axes_of(exact)),
                   after = predict(rounded, axes_of(rounded));
  std::vector<std::vector<double>> change;
  for (std::size_t c = 0; c < before.size(); ++c) {
    change.push_back(after[c]);
    for (std::size_t k = 0; k < change[c].size(); ++k) change[c][k] -= before[c][k];
  }
  return change;
}

std::vector<SeriesOfChannels> MachineReplica::of_unknown_forces() const {
  std::vector<SeriesOfChannels> all;
  if (!knows_forces()) return all;
  const Hypothesis declared = hypothesis_of(declared_);
  const AxisReplays axes = axes_of(declared);
  const Prediction before = predict(declared, axes);
  const auto add = [&](std::size_t axis, std::vector<double> UnknownForce::*of, const char* part) {
    CommandedMotion motion = motion_;
    for (double& f : motion.unknown[axis].*of) f *= 1 + kUnknownForce;
    AxisReplay replay = replay_axis(declared.machine, declared.actual, axis, motion);
    sample_as_recorded(replay, axis);
    AxisReplays changed = axes;
    changed[axis] = std::make_shared<const AxisReplay>(std::move(replay));
    Hypothesis other = declared;
    other.ball += part + std::string(kAxisNames[axis]);
    const Prediction after = predict(other, changed);
    SeriesOfChannels& change = all.emplace_back(channels_.size());
    for (std::size_t c = 0; c < channels_.size(); ++c)
      for (std::size_t k = 0; !after[c].shares(before[c]) && k < samples_; ++k)
        change[c].push_back(after[c][k] - before[c][k]);
  };
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (motion_.unknown[axis].slow.empty()) continue;
    add(axis, &UnknownForce::slow, "|more slow force on ");
    add(axis, &UnknownForce::quick, "|more quick force on ");
  }
  return all;
}

Prediction MachineReplica::predict(const Hypothesis& h, const AxisReplays& axes) const {
  return assembled(axes, probes_ ? reading_of(h, axes) : Deflections{});
}

std::vector<Prediction> MachineReplica::predict_all(const std::vector<Machine>& machines) const {
  if (machines.size() == 1) return {predict(machines.front())};
  std::vector<Hypothesis> all(machines.size());
  parallel_for(all.size(), [&](std::size_t i) { all[i] = hypothesis_of(machines[i]); });
  std::vector<AxisReplays> axes(all.size());
  parallel_for(kAxisCount, [&](std::size_t axis) {
    std::map<std::string, std::vector<std::size_t>> alike;  // indices by drive, not known yet
    std::map<std::string, std::shared_ptr<const AxisReplay>> made;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Hypothesis& h = all[i];
      // The probe in full asks for the whole truth.
      const bool in_full = probes_ && anchor_->needs_full(h);
      axes[i][axis] = in_full ? axis_memory_[axis]->find_or_make(h.axis[axis],
                                                                 [&] { return replayed(h, axis); })
                              : axis_memory_[axis]->find(h.axis[axis]);
      if (!axes[i][axis] && made.try_emplace(h.axis[axis]).second)
        alike[h.drive[axis]].push_back(i);
    }
    std::vector<std::size_t> left;
    for (const auto& [print, group] : alike) {
      const Hypothesis& first = all[group.front()];
      auto watched = watched_[axis]->find(print);
      if (!watched && group.size() > 1)
        watched = watched_[axis]->find_or_make(print, [&] {
          WatchedReplay w = replay_watched(first.machine, first.actual, axis, motion_);
          sample_as_recorded(w.replay, axis);
          return w;
        });
      for (const std::size_t i : group) {
        auto replay =
            watched ? displaced(*watched, all[i].machine, all[i].actual, axis) : std::nullopt;
        if (replay)
          made[all[i].axis[axis]] = std::make_shared<const AxisReplay>(std::move(*replay));
        else
          left.push_back(i);
      }
    }
    std::vector<AxisVariant> variants;
    for (const std::size_t i : left) variants.push_back({all[i].machine, all[i].actual});
    std::vector<AxisReplay> replays = replay_variants(variants, axis, motion_);
    for (std::size_t n = 0; n < left.size(); ++n) {
      sample_as_recorded(replays[n], axis);
      made[all[left[n]].axis[axis]] = std::make_shared<const AxisReplay>(std::move(replays[n]));
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      if (!axes[i][axis]) axes[i][axis] = made.at(all[i].axis[axis]);
  });
  std::vector<Prediction> predictions(all.size());
  parallel_for(all.size(), [&](std::size_t i) {
    predictions[i] = predict(all[i], axes[i]);
    axes[i] = {};
  });
  return predictions;
}

Prediction MachineReplica::predict_in_full(const Machine& machine) const {
  const Hypothesis h = hypothesis_of(machine);
  AxisReplays axes;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    axes[axis] = std::make_shared<AxisReplay>(replayed(h, axis));
  return assembled(axes, probes_ ? replay_probe(h.actual, against_, axes).reading : Deflections{});
}

}  // namespace vcnc
