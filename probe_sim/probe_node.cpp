#include "probe_sim/probe_node.hpp"

#include <algorithm>
#include <cmath>

#include "bus/fault.hpp"
#include "bus/heartbeat.hpp"
#include "bus/object_dictionary.hpp"

namespace vcnc {

namespace {

constexpr double kSampleTime = kCycle / kLoopStepsPerCycle;

/// Where the axes truly stand at switch-on: off their scales by what the drives will say from the
/// first cycle on, so that the probe does not see a jump.
AxisVector start_position(const Machine& machine, std::uint64_t seed) {
  Motions<double> motions{};
  for (std::size_t i = 0; i < kAxisCount; ++i) motions[i].position = machine.axes[i].limits.start;
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    q[i] = motions[i].position;
    Chain<DisplacementPort> displacing = axis_chain<DisplacementPort>(machine.effects, i, seed);
    if (displacing.empty()) continue;
    DisplacementPort::Signal<double> signal;
    displacing.step(
        signal, {.moment = {0, kSampleTime, 0}, .load = motions[i], .force = 0, .axes = &motions});
    q[i] += signal.displacement;
  }
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
    : ProbeNode(vcnc::actual(machine), std::move(piece), seed, truth, machine.probe) {}

ProbeNode::ProbeNode(const Machine& machine, std::unique_ptr<Piece> piece, std::uint64_t seed,
                     TruthPort& truth, const ProbeParams& declared)
    : probe_(machine.probe),
      profile_{kNoProfile, kProbeProduct, heartbeat_cycles(machine.bus.heartbeat_time)},
      range_(usable_range(declared)),
      kinematics_(machine.kinematics, machine.probe.length, machine.setup.work_offset[0]),
      piece_(std::move(piece)),
      contact_(machine.probe, machine_chain<TouchPort>(machine.effects, seed), piece_.get()),
      channels_{
          SignalChannel(machine.probe, 0, machine_chain<AnaloguePort>(machine.effects, seed)),
          SignalChannel(machine.probe, 1, machine_chain<AnaloguePort>(machine.effects, seed)),
          SignalChannel(machine.probe, 2, machine_chain<AnaloguePort>(machine.effects, seed))},
      errors_(machine_chain<PosePort>(machine.effects, seed)),
      feeling_(machine_chain<DeflectionPort>(machine.effects, seed)),
      counting_(machine_chain<ReadingPort>(machine.effects, seed)),
      truth_(truth),
      start_(start_position(machine, seed)),
      last_known_(start_) {
  felt_.fill(Vec3::Zero());
}

// clang-format off
void ProbeNode::declare(ObjectDictionary& objects) {
  using enum ObjectAccess;
  using enum ObjectType;
  const auto fixed = [](double value, double per_unit) {
    return [n = counts(value, per_unit)] { return n; };
  };
  objects.add({0x2100, 0, "Flags of the last sample", u16, read_only,
               "bit 0 contact, 1 out of range, 2 slip, 3 signal fault, 4 overtravel",
               [this] { return told_.flags; }});
  objects.array(0x2101, "Deflection");
  for (std::size_t i = 0; i < 3; ++i)
    objects.add({0x2101, static_cast<std::uint8_t>(i + 1), std::string(1, "xyz"[i]), i32, read_only,
                 "0.1 um", [this, i] { return counts(told_.deflection[i], 1e7); }});
  objects.add({0x2102, 0, "Smallest deflection that is contact", u32, constant, "0.1 um",
               fixed(probe_.min_deflection, 1e7)});
  objects.add({0x2103, 0, "Measuring range each side", u32, constant, "0.1 um", fixed(probe_.range, 1e7)});
  objects.add({0x2104, 0, "Signal period", u32, constant, "nm", fixed(probe_.signal_period, 1e9)});
  objects.add({0x2105, 0, "Converter resolution", u8, constant, "bit", fixed(probe_.adc_bits, 1)});
  objects.add({0x2106, 0, "Spring rate", u32, constant, "N/m", fixed(probe_.spring_rate, 1)});
}
// clang-format on

void ProbeNode::suffer(const BusFault& fault) {
  ChannelFault& channel = broken_[static_cast<std::size_t>(fault.channel)];
  if (fault.kind == BusFault::Kind::wire_break) channel = ChannelFault::wire_break;
  if (fault.kind == BusFault::Kind::stuck_adc) channel = ChannelFault::stuck;
  if (fault.kind == BusFault::Kind::saturated) channel = ChannelFault::saturated;
  if (fault.kind == BusFault::Kind::slip)
    miscounted_[static_cast<std::size_t>(fault.channel)] += fault.count;
}

/// Positions, velocities and accelerations of the axes from the last samples.
void ProbeNode::follow_motion(const AxisVector& q) {
  motion_.moment = {static_cast<double>(samples_) * kSampleTime, kSampleTime, samples_};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    Motion<double>& m = motion_.axes[i];
    const double velocity = samples_ > 0 ? (q[i] - m.position) / kSampleTime : 0;
    m = {q[i], velocity, samples_ > 1 ? (velocity - m.velocity) / kSampleTime : 0};
  }
}

ToolPose ProbeNode::pose(const AxisVector& q) {
  if (!errors_.empty() || !counting_.empty()) follow_motion(q);
  if (errors_.empty()) return kinematics_.forward(q);
  motion_.arm = kinematics_.arms(q);
  GeometryErrors<double> errors;
  errors_.step(errors, motion_);
  return kinematics_.forward(q, errors);
}

void ProbeNode::sample(const AxisVector& q) {
  const Moment now{static_cast<double>(samples_) * kSampleTime, kSampleTime, samples_};
  Vec3 deflection = contact_.step(pose(q));
  felt_[static_cast<std::size_t>((samples_ + kLoopStepsPerCycle - 1) % kLoopStepsPerCycle)] =
      deflection;
  overtravelled_ = overtravelled(probe_, deflection);
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

void ProbeNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    channels_[c].suffer(broken_[c]);
    channels_[c].miscount(miscounted_[c]);
  }
  broken_.fill(ChannelFault::none);
  miscounted_.fill(0);
  if (k == 0) {
    sample(start_);
  } else {
    std::array<TruthCycle, kTruthAxes> truth;
    if (!truth_.collect(k - 1, truth)) hold_missing(k - 1, inputs, truth);
    for (std::size_t j = 0; j < kLoopStepsPerCycle; ++j) {
      for (std::size_t i = 0; i < kAxisCount; ++i) last_known_[i] = truth[i].position[j];
      sample(last_known_);
    }
  }
  told_ = reading(k);
  out.push_back(encode(told_));
}

void ProbeNode::hold_missing(Tick k, std::span<const Frame> inputs,
                             std::array<TruthCycle, kTruthAxes>& truth) const {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (truth[i].tick == k) continue;
    const auto from_it = [&](const Frame& f) { return f.id == kStatusBase + drive_node(i); };
    if (std::any_of(inputs.begin(), inputs.end(), from_it))
      throw TruthError("the true motion of axis " + std::string(kAxisNames[i]) + " in cycle " +
                       std::to_string(k) + " did not arrive");
    truth[i].position.fill(last_known_[i]);
  }
}

}  // namespace vcnc
