#include "model/probe/probe_sensor.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

AxisVector start_position(const Machine& actual, std::uint64_t seed) {
  Motions<double> motions{};
  for (std::size_t i = 0; i < kAxisCount; ++i) motions[i].position = actual.axes[i].limits.start;
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    q[i] = motions[i].position;
    Chain<DisplacementPort> displacing = axis_chain<DisplacementPort>(actual.effects, i, seed);
    if (displacing.empty()) continue;
    DisplacementPort::Signal<double> signal;
    displacing.step(
        signal,
        {.moment = {0, kProbeSampleTime, 0}, .load = motions[i], .force = 0, .axes = &motions});
    q[i] += signal.displacement;
  }
  return q;
}

ProbeSensor::ProbeSensor(const Machine& actual, const Piece* piece, std::uint64_t seed)
    : probe_(actual.probe),
      kinematics_(actual.kinematics, actual.probe.length, actual.setup.work_offset[0]),
      contact_(actual.probe, machine_chain<TouchPort>(actual.effects, seed), piece),
      channels_{SignalChannel(actual.probe, 0, machine_chain<AnaloguePort>(actual.effects, seed)),
                SignalChannel(actual.probe, 1, machine_chain<AnaloguePort>(actual.effects, seed)),
                SignalChannel(actual.probe, 2, machine_chain<AnaloguePort>(actual.effects, seed))},
      errors_(machine_chain<PosePort>(actual.effects, seed)),
      feeling_(machine_chain<DeflectionPort>(actual.effects, seed)),
      counting_(machine_chain<ReadingPort>(actual.effects, seed)) {}

/// Positions, velocities and accelerations of the axes from the last samples.
void ProbeSensor::follow_motion(const AxisVector& q) {
  motion_.moment = {static_cast<double>(samples_) * kProbeSampleTime, kProbeSampleTime, samples_};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    Motion<double>& m = motion_.axes[i];
    const double velocity = samples_ > 0 ? (q[i] - m.position) / kProbeSampleTime : 0;
    m = {q[i], velocity, samples_ > 1 ? (velocity - m.velocity) / kProbeSampleTime : 0};
  }
}

ToolPose ProbeSensor::pose(const AxisVector& q) {
  if (!errors_.empty() || !counting_.empty()) follow_motion(q);
  if (errors_.empty()) return kinematics_.forward(q);
  motion_.arm = kinematics_.arms(q);
  GeometryErrors<double> errors;
  errors_.step(errors, motion_);
  return kinematics_.forward(q, errors);
}

void ProbeSensor::sample(const AxisVector& q) {
  const Moment now{static_cast<double>(samples_) * kProbeSampleTime, kProbeSampleTime, samples_};
  felt_ = contact_.step(pose(q));
  Vec3 deflection = felt_;
  if (!feeling_.empty()) {
    DeflectionPort::Signal<double> signal{deflection};
    feeling_.step(signal, {now, probe_.spring_rate});
    deflection = signal.deflection;
  }
  for (std::size_t c = 0; c < channels_.size(); ++c)
    last_[c] = channels_[c].sample(deflection[static_cast<Eigen::Index>(c)]);
  if (!counting_.empty()) {
    ReadingPort::Signal<double> signal{
        {last_[0].deflection, last_[1].deflection, last_[2].deflection}};
    counting_.step(signal, {now, probe_.signal_period, &motion_.axes});
    for (std::size_t c = 0; c < last_.size(); ++c)
      last_[c].deflection = signal.deflection[static_cast<Eigen::Index>(c)];
  }
  ++samples_;
}

bool ProbeSensor::overtravelled() const {
  const double lateral = felt_.head<2>().norm(), axial = std::abs(felt_.z());
  return lateral >= std::min(probe_.overtravel_lateral,
                             probe_.overtravel_force_lateral / probe_.spring_rate) ||
         axial >=
             std::min(probe_.overtravel_axial, probe_.overtravel_force_axial / probe_.spring_rate);
}

}  // namespace vcnc
