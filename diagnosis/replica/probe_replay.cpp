#include "diagnosis/replica/probe_replay.hpp"

#include <cmath>
#include <optional>

#include "diagnosis/candidates/effect_stage.hpp"
#include "model/fingerprint.hpp"
#include "model/probe/heydemann.hpp"
#include "model/probe/probe_sensor.hpp"

namespace vcnc {
namespace {

constexpr std::uint64_t kProbeSeed = 1;   // of noise that a replica does not have
constexpr double kProbeStep = 1e-3;       // [s]
constexpr double kRadiusChange = 1e-3;    // [m] effects change the radius by less than this
constexpr double kSignalAmplitude = 0.5;  // [V]

Moment moment_of(std::size_t cycle) {
  return {static_cast<double>(cycle) * kProbeStep, kProbeStep, static_cast<std::int64_t>(cycle)};
}

/// True motion of the axes at the end of a cycle, as the probe module finds it from its samples.
void read_motions(const AxisReplays& axes, std::size_t cycle, Motions<double>& motions) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double* const x = axes[i]->end_of(cycle);
    if (cycle == 0) {
      motions[i] = {x[0], 0, 0};
      continue;
    }
    const double v = (x[0] - x[-1]) / kProbeSampleTime, u = (x[-1] - x[-2]) / kProbeSampleTime;
    motions[i] = {x[0], v, (v - u) / kProbeSampleTime};
  }
}

/// Of one axis at the end of a cycle.
double position_at(const AxisReplays& axes, std::size_t axis, std::size_t cycle) {
  return *axes[axis]->end_of(cycle);
}

AxisVector positions(const Motions<double>& motions) {
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = motions[i].position;
  return q;
}

/// The ball in steps of a cycle.
class CoarseContact {
 public:
  CoarseContact(const Machine& actual, const Piece* piece)
      : probe_(actual.probe),
        effects_(machine_chain<TouchPort>(actual.effects, kProbeSeed)),
        ball_{.radius = probe_.ball_radius},
        piece_(piece),
        mass_(probe_.moving_mass + probe_.stylus_mass) {
    const double w = std::sqrt(probe_.spring_rate / mass_), b = probe_.damping_ratio * w;
    const double square = w * w - b * b;  // of the damped frequency; negative: aperiodic
    const double w_d = std::sqrt(std::abs(square));
    const double fade = std::exp(-b * kProbeStep);
    const double c = square > 0 ? std::cos(w_d * kProbeStep) : std::cosh(w_d * kProbeStep);
    double s = kProbeStep;
    if (w_d > 0) s = (square > 0 ? std::sin(w_d * kProbeStep) : std::sinh(w_d * kProbeStep)) / w_d;
    rr_ = fade * (c + b * s);
    rv_ = fade * s;
    vr_ = -fade * w * w * s;
    vv_ = fade * (c - b * s);
  }

  Vec3 step(const ToolPose& pose, std::size_t cycle) {
    if (!effects_.empty()) feel(pose, cycle);
    if (!placed_) place(pose);
    const Vec3 v_tool = (pose.p_WT - p_tool_) / kProbeStep;
    const Vec3 r = p_ - p_tool_, w = v_ - v_tool;
    Vec3 p = pose.p_WT + rr_ * r + rv_ * w, v = v_tool + vr_ * r + vv_ * w;
    if (piece_ != nullptr) touch(p, v);
    p_ = p;
    v_ = v;
    p_tool_ = pose.p_WT;
    return pose.R_WT.transpose() * (p_ - pose.p_WT);
  }

 private:
  void place(const ToolPose& pose) {
    p_ = p_tool_ = pose.p_WT;
    placed_ = true;
    if (piece_ == nullptr) return;
    surface_ = piece_->nearest(p_, surface_);
    if (surface_.valid && surface_.distance < ball_.radius)
      p_ += (ball_.radius - surface_.distance) * surface_.n;
  }

  /// What the ball and its contact are like at this step, as in ProbeContact.
  void feel(const ToolPose& pose, std::size_t cycle) {
    ball_ = {.radius = probe_.ball_radius};
    TouchPort::Context<double> context{.moment = moment_of(cycle)};
    if (surface_.valid) {
      context.normal_W = surface_.n;
      context.normal_T = pose.R_WT.transpose() * surface_.n;
    }
    effects_.step(ball_, context);
  }

  void touch(Vec3& p, Vec3& v) {
    if ((p - searched_).norm() < clearance_) return;
    surface_ = piece_->nearest(p, surface_);
    const double gap = surface_.distance - ball_.radius;
    searched_ = p;
    clearance_ = surface_.valid ? gap - (effects_.empty() ? 0 : kRadiusChange) : 0;
    if (!surface_.valid || gap >= 0) return;
    const Vec3& n = surface_.n;
    p -= gap * n;
    const double push = n.dot(p - p_) / kProbeStep - n.dot(v);
    v += push * n;
    if (ball_.friction > 0 && push > 0) {
      const Vec3 sliding = v - n * n.dot(v);
      const double speed = sliding.norm();
      if (!(speed > 0)) return;
      const Vec3 change = sliding * -std::min(1.0, ball_.friction * push / speed);
      v += change;
      p += 0.5 * kProbeStep * change;
    }
  }

  ProbeParams probe_;
  Chain<TouchPort> effects_;
  TouchPort::Signal<double> ball_;
  const Piece* piece_;
  double mass_;
  double rr_, rv_, vr_, vv_;  ///< free motion over a step
  bool placed_ = false;
  Vec3 p_ = Vec3::Zero(), v_ = Vec3::Zero(), p_tool_ = Vec3::Zero();
  SurfacePoint surface_;
  Vec3 searched_ = Vec3::Zero();
  double clearance_ = 0;
};

/// What a bar reads, in the first channel, or a sensor.
template <class PosesOfCycles>
Deflections table_readings(const Machine& actual, const Counterpart::OnTable& of,
                           PosesOfCycles& poses) {
  Chain<TouchPort> effects = machine_chain<TouchPort>(actual.effects, kProbeSeed);
  Deflections reading;
  for (std::vector<double>& r : reading) r.assign(poses.size(), 0.0);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vec3 p = of.R_SW * (poses[k].p_WT - of.p_W0);
    if (!(of.bar_length > 0)) {
      for (std::size_t c = 0; c < 3; ++c) reading[c][k] = p[static_cast<Eigen::Index>(c)];
      continue;
    }
    TouchPort::Signal<double> ball{.radius = actual.probe.ball_radius};
    effects.step(ball, {.moment = moment_of(k)});  // its balls are held, not felt on one side
    reading[0][k] = p.norm() - of.bar_length + ball.radius - actual.probe.ball_radius;
  }
  return reading;
}

bool corrects_signals(const Machine& actual) {
  return actual.probe.correction == ProbeParams::Correction::heydemann;
}

/// The sin/cos signals of one channel, once per cycle.
class CoarseSignals {
 public:
  CoarseSignals(const Machine& actual, int channel)
      : errors_(machine_chain<AnaloguePort>(actual.effects, kProbeSeed)),
        channel_(channel),
        period_(actual.probe.signal_period),
        corrects_(corrects_signals(actual)) {}

  bool ideal() const { return errors_.empty(); }

  /// What the channel reads too much where the ball is at x [m].
  double error(double x, std::size_t cycle) {
    const double phase = 2 * kPi / period_ * x;
    const SinCos signal = corrects_ ? corrected(phase, cycle) : raw(phase, cycle);
    const double shift = std::atan2(signal.w, signal.u) - phase;
    return (shift - 2 * kPi * std::round(shift / (2 * kPi))) * period_ / (2 * kPi);
  }

 private:
  SinCos raw(double phase, std::size_t cycle) {
    const SinCos ideal = Lissajous{.amplitude = kSignalAmplitude}.signals(phase);
    AnaloguePort::Signal<double> signal{ideal.u, ideal.w};
    errors_.step(signal, {moment_of(cycle), channel_, kSignalAmplitude});
    return {signal.cosine, signal.sine};
  }

  SinCos corrected(double phase, std::size_t cycle) {
    if (!corrector_.ellipse() && cycle > 0)
      for (std::size_t i = 1; i < kTruthPerCycle; ++i)
        corrector_.correct(
            raw(std::lerp(phase_, phase, static_cast<double>(i) / kTruthPerCycle), cycle));
    phase_ = phase;
    return corrector_.correct(raw(phase, cycle));
  }

  Chain<AnaloguePort> errors_;
  int channel_;
  double period_;
  bool corrects_;
  OnlineCorrector corrector_;
  double phase_ = 0;  ///< of the last cycle, while there is no ellipse
};

/// Adds the effects of one stage.
void add_effects(Fingerprint& print, const Machine& actual, EffectStage stage) {
  for_each_effect_of(actual.effects, [&]<class Effect>(const Effect& effect, std::size_t axis) {
    if (stage_of<typename Effect::Port>() == stage && !effect.null())
      add_effect(print, effect, axis);
  });
}

}  // namespace

ProbeReplay replay_probe(const Machine& actual, const Counterpart& against,
                         const AxisReplays& axes) {
  if (against.on_table) {
    const Poses poses = replay_poses(actual, axes);
    ProbeReplay replay{table_readings(actual, *against.on_table, poses), {}};
    replay.reading = replay_sensing(actual, replay.ball, axes);
    return replay;
  }
  const std::size_t samples = axes[0]->truth.size(), cycles = samples / kTruthPerCycle;
  ProbeReplay replay;
  for (std::size_t c = 0; c < 3; ++c) {
    replay.ball[c].resize(cycles);
    replay.reading[c].resize(cycles);
  }
  ProbeSensor sensor(actual, against.piece, kProbeSeed);
  for (std::size_t s = kTruthPerCycle - 1; s < samples; ++s) {  // the first is that of instant 0
    AxisVector q;
    for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = axes[i]->truth[s];
    sensor.sample(q);
    if (s % kTruthPerCycle != kTruthPerCycle - 1) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      replay.ball[c][s / kTruthPerCycle] = sensor.deflection()[static_cast<Eigen::Index>(c)];
      replay.reading[c][s / kTruthPerCycle] = sensor.channels()[c].deflection;
    }
  }
  return replay;
}

Poses replay_poses(const Machine& actual, const AxisReplays& axes) {
  const std::size_t cycles = axes[0]->cycles();
  Poses poses(cycles);
  const Kinematics kinematics(actual.kinematics, actual.probe.length, actual.setup.work_offset[0]);
  Chain<PosePort> errors = machine_chain<PosePort>(actual.effects, kProbeSeed);
  PosePort::Context<double> context;
  for (std::size_t k = 0; k < cycles; ++k) {
    read_motions(axes, k, context.axes);
    const AxisVector q = positions(context.axes);
    if (errors.empty()) {
      poses[k] = kinematics.forward(q);
      continue;
    }
    context.moment = moment_of(k);
    context.arm = kinematics.arms(q);
    GeometryErrors<double> error;
    errors.step(error, context);
    poses[k] = kinematics.forward(q, error);
  }
  return poses;
}

NearbyPoses::NearbyPoses(const Machine& actual, const AxisReplays& axes)
    : axes_(axes), poses_(replay_poses(actual, axes)), changes_(poses_.size()) {
  const Kinematics kinematics(actual.kinematics, actual.probe.length, actual.setup.work_offset[0]);
  const double a_sign = actual.kinematics.a_reversed ? -1 : 1,
               c_sign = actual.kinematics.c_reversed ? -1 : 1;
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    AxisVector q;
    for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = position_at(axes, i, k);
    // Whatever turns the pose against the ideal one turns its changes, too.
    const Mat3 turned = poses_[k].R_WT * kinematics.forward(q).R_WT.transpose();
    const double c = c_sign * q[kC];
    changes_[k] = {turned * kinematics.jacobian(q),
                   turned * (a_sign * Vec3(std::cos(c), std::sin(c), 0)),
                   turned * (c_sign * Vec3::UnitZ())};
  }
}

NearbyPoses::Course::Course(const NearbyPoses& near, const Poses& poses, const AxisReplays& axes)
    : near_(near), poses_(poses), axes_(axes) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (axes[i] != near.axes_[i]) moved_.push_back(i);
}

const ToolPose& NearbyPoses::Course::operator[](std::size_t k) {
  const ToolPose& here = poses_[k];
  if (moved_.empty()) return here;
  const Change& change = near_.changes_[k];
  pose_ = here;
  for (const std::size_t i : moved_) {
    const double dq = position_at(axes_, i, k) - position_at(near_.axes_, i, k);
    if (dq == 0) continue;
    pose_.p_WT += change.J.col(static_cast<Eigen::Index>(i)) * dq;
    if (!is_rotary(i)) continue;
    const Vec3 turn = (i == kA ? change.w_A : change.w_C) * dq;
    for (Eigen::Index c = 0; c < 3; ++c) pose_.R_WT.col(c) += turn.cross(here.R_WT.col(c));
  }
  return pose_;
}

Deflections replay_contact(const Machine& actual, const Counterpart& against,
                           NearbyPoses::Course poses) {
  if (against.on_table) return table_readings(actual, *against.on_table, poses);
  Deflections ball;
  for (std::vector<double>& b : ball) b.resize(poses.size());
  CoarseContact contact(actual, against.piece);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vec3 deflection = contact.step(poses[k], k);
    for (std::size_t c = 0; c < 3; ++c) ball[c][k] = deflection[static_cast<Eigen::Index>(c)];
  }
  return ball;
}

Deflections replay_sensing(const Machine& actual, const Deflections& ball, const AxisReplays& axes,
                           const Deflections* moved) {
  Chain<DeflectionPort> feeling = machine_chain<DeflectionPort>(actual.effects, kProbeSeed);
  std::array signals{CoarseSignals(actual, 0), CoarseSignals(actual, 1), CoarseSignals(actual, 2)};
  Chain<ReadingPort> counting = machine_chain<ReadingPort>(actual.effects, kProbeSeed);
  if (feeling.empty() && signals[0].ideal() && counting.empty()) return ball;
  Deflections reading = ball;
  for (std::size_t k = 0; k < ball[0].size(); ++k) {
    Vec3 x(ball[0][k], ball[1][k], ball[2][k]);
    if (!feeling.empty()) {
      DeflectionPort::Signal<double> signal{x};
      feeling.step(signal, {moment_of(k), actual.probe.spring_rate});
      x = signal.deflection;
    }
    for (std::size_t c = 0; c < 3 && !signals[0].ideal(); ++c) {
      double& felt = x[static_cast<Eigen::Index>(c)];
      felt += signals[c].error(felt + (moved ? (*moved)[c][k] : 0), k);
    }
    if (!counting.empty()) {
      Motions<double> motions;
      read_motions(axes, k, motions);
      ReadingPort::Signal<double> signal{x};
      counting.step(signal, {moment_of(k), actual.probe.signal_period, &motions});
      x = signal.deflection;
    }
    for (std::size_t c = 0; c < 3; ++c) reading[c][k] = x[static_cast<Eigen::Index>(c)];
  }
  return reading;
}

bool signals_err(const Machine& actual) {
  return !corrects_signals(actual) &&
         !machine_chain<AnaloguePort>(actual.effects, kProbeSeed).empty();
}

bool lifts(const Machine& actual) { return !actual.effects.get<ContactLoss>().null(); }

std::string fingerprint_of_full_probe(const Machine& actual) {
  Fingerprint print;
  if (const auto& guides = actual.effects.get<ReturnToZero>(); !guides.null())
    add_effect(print, guides, kAxisCount);
  return print.bytes();
}

bool poses_follow_dynamics(const Machine& actual) {
  return !actual.effects.get<CrossInertia>().null() ||
         machine_chain<PosePort>(actual.effects, kProbeSeed).remembers();
}

std::string fingerprint_of_contact(const Machine& actual) {
  Fingerprint print;
  KinematicsParams::fields(actual.kinematics, print);
  ProbeParams::fields(actual.probe, print);
  SetupParams::fields(actual.setup, print);
  add_effects(print, actual, EffectStage::contact);
  return print.bytes();
}

std::string fingerprint_of_sensing(const Machine& actual) {
  Fingerprint print;
  ProbeParams::fields(actual.probe, print);
  add_effects(print, actual, EffectStage::sensing);
  for (const Law& law : actual.effects.laws)
    if (law.point == Law::Point::reading) Law::fields(law, print);
  return print.bytes();
}

}  // namespace vcnc
