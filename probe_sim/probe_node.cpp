#include "probe_sim/probe_node.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

namespace {

AxisVector start_position(const Machine& machine) {
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = machine.axes[i].limits.start;
  return q;
}

/// The probe's own protection unit, a mechanical switch: it feels the true travel and force,
/// whatever the scales count.
bool overtravelled(const ProbeParams& probe, const Vec3& deflection) {
  const double lateral = deflection.head<2>().norm(), axial = std::abs(deflection.z());
  return lateral >= std::min(probe.overtravel_lateral,
                             probe.overtravel_force_lateral / probe.spring_rate) ||
         axial >=
             std::min(probe.overtravel_axial, probe.overtravel_force_axial / probe.spring_rate);
}

}  // namespace

ProbeNode::ProbeNode(const Machine& machine, std::unique_ptr<Piece> piece, std::uint64_t seed,
                     TruthPort& truth)
    : probe_(machine.probe),
      range_(usable_range(machine.probe)),
      kinematics_(machine.kinematics, machine.probe.length, machine.setup.work_offset[0]),
      piece_(std::move(piece)),
      contact_(machine.probe, machine.effects.probe, piece_.get()),
      channels_{SignalChannel(machine.probe, machine.effects.probe, 0, seed),
                SignalChannel(machine.probe, machine.effects.probe, 1, seed),
                SignalChannel(machine.probe, machine.effects.probe, 2, seed)},
      truth_(truth),
      start_(start_position(machine)) {}

ToolPose ProbeNode::pose(const std::array<TruthCycle, kTruthAxes>& truth,
                         std::size_t sample) const {
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = truth[i].position[sample];
  return kinematics_.forward(q);
}

void ProbeNode::sample(const ToolPose& pose) {
  const Vec3 deflection = contact_.step(pose);
  overtravelled_ = overtravelled(probe_, deflection);
  for (std::size_t c = 0; c < channels_.size(); ++c)
    last_[c] = channels_[c].sample(deflection[static_cast<Eigen::Index>(c)]);
}

ProbeSample ProbeNode::reading(Tick k) const {
  ProbeSample reading{.tick = low16(k)};
  for (std::size_t c = 0; c < last_.size(); ++c) {
    reading.deflection[c] = last_[c].deflection;
    reading.adc[2 * c] = last_[c].cos_code;
    reading.adc[2 * c + 1] = last_[c].sin_code;
    if (last_[c].slip) reading.flags |= ProbeSample::kSlip;
    if (last_[c].fault) reading.flags |= ProbeSample::kSignalFault;
  }
  const Vec3 deflection(reading.deflection.data());
  if (deflection.norm() >= probe_.min_deflection) reading.flags |= ProbeSample::kContact;
  if (!range_.contains(deflection)) reading.flags |= ProbeSample::kOutOfRange;
  if (overtravelled_) reading.flags |= ProbeSample::kOvertravel;
  return reading;
}

void ProbeNode::step(Tick k, std::span<const Frame>, Frames& out) {
  if (k == 0) {
    sample(kinematics_.forward(start_));
  } else {
    std::array<TruthCycle, kTruthAxes> truth;
    if (!truth_.collect(k - 1, truth))  // a failure of the host, not of the machine
      throw TruthError("the true motion of cycle " + std::to_string(k - 1) + " did not arrive");
    for (std::size_t j = 0; j < kLoopStepsPerCycle; ++j) sample(pose(truth, j));
  }
  out.push_back(encode(reading(k)));
}

}  // namespace vcnc
