#include "probe_sim/probe_node.hpp"

#include <algorithm>

#include "bus/fault.hpp"
#include "bus/heartbeat.hpp"
#include "bus/object_dictionary.hpp"

namespace vcnc {

ProbeNode::ProbeNode(const Machine& machine, std::unique_ptr<Piece> piece, std::uint64_t seed,
                     TruthPort& truth)
    : ProbeNode(vcnc::actual(machine), std::move(piece), seed, truth, machine.probe) {}

ProbeNode::ProbeNode(const Machine& machine, std::unique_ptr<Piece> piece, std::uint64_t seed,
                     TruthPort& truth, const ProbeParams& declared)
    : probe_(machine.probe),
      profile_{kNoProfile, kProbeProduct, heartbeat_cycles(machine.bus.heartbeat_time)},
      range_(usable_range(declared)),
      piece_(std::move(piece)),
      sensor_(machine, piece_.get(), seed),
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

void ProbeNode::sample(std::size_t j, const AxisVector& q) {
  sensor_.sample(q);
  felt_[j] = sensor_.deflection();
}

ProbeSample ProbeNode::reading(Tick k) const {
  ProbeSample reading{.tick = low16(k)};
  const std::array<ChannelSample, 3>& channels = sensor_.channels();
  for (std::size_t c = 0; c < channels.size(); ++c) {
    reading.deflection[c] = channels[c].deflection;
    reading.adc[2 * c] = channels[c].cos_code;
    reading.adc[2 * c + 1] = channels[c].sin_code;
    if (channels[c].slip) reading.flags |= ProbeSample::kSlip;
    if (channels[c].fault) reading.flags |= ProbeSample::kSignalFault;
  }
  const Vec3 deflection(reading.deflection.data());
  if (deflection.norm() >= probe_.min_deflection) reading.flags |= ProbeSample::kContact;
  if (!range_.contains(deflection)) reading.flags |= ProbeSample::kOutOfRange;
  if (sensor_.overtravelled()) reading.flags |= ProbeSample::kOvertravel;
  return reading;
}

void ProbeNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  for (std::size_t c = 0; c < broken_.size(); ++c) {
    sensor_.suffer(c, broken_[c]);
    sensor_.miscount(c, miscounted_[c]);
  }
  broken_.fill(ChannelFault::none);
  miscounted_.fill(0);
  if (k == 0) {
    sample(kLoopStepsPerCycle - 1, start_);
  } else {
    std::array<TruthCycle, kTruthAxes> truth;
    if (!truth_.collect(k - 1, truth)) hold_missing(k - 1, inputs, truth);
    for (std::size_t j = 0; j < kLoopStepsPerCycle; ++j) {
      for (std::size_t i = 0; i < kAxisCount; ++i) last_known_[i] = truth[i].position[j];
      sample(j, last_known_);
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
