#include "probe_sim/overtravel_node.hpp"

#include <bit>
#include <cmath>

#include "bus/heartbeat.hpp"
#include "bus/object_dictionary.hpp"

namespace vcnc {

namespace {

constexpr std::uint8_t kLatchVersion = 1;
constexpr std::size_t kLatchSize = 11;

}  // namespace

std::vector<std::uint8_t> encode_protection_latch(const ProtectionLatch& latch) {
  std::vector<std::uint8_t> bytes{kLatchVersion, static_cast<std::uint8_t>(latch.state),
                                  static_cast<std::uint8_t>(latch.cause)};
  const auto bits = std::bit_cast<std::uint64_t>(latch.deflection);
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
  return bytes;
}

std::optional<ProtectionLatch> decode_protection_latch(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kLatchSize || bytes[0] != kLatchVersion ||
      bytes[1] > static_cast<std::uint8_t>(ProtectionState::hard) ||
      bytes[2] > static_cast<std::uint8_t>(ProtectionCause::runaway))
    return std::nullopt;
  std::uint64_t bits = 0;
  for (std::size_t i = kLatchSize; i > 3; --i) bits = bits << 8 | bytes[i - 1];
  const auto deflection = std::bit_cast<double>(bits);
  if (!std::isfinite(deflection)) return std::nullopt;
  return ProtectionLatch{static_cast<ProtectionState>(bytes[1]),
                         static_cast<ProtectionCause>(bytes[2]), deflection};
}

OvertravelNode::OvertravelNode(const Machine& machine, NodeMemory* memory)
    : probe_(machine.probe),
      profile_{kNoProfile, kOvertravelProduct, heartbeat_cycles(machine.bus.heartbeat_time)},
      protection_(machine.probe),
      memory_(memory) {
  if (memory_ == nullptr) return;
  const std::vector<std::uint8_t> kept = memory_->load();
  if (kept.empty()) return;
  const auto latch = decode_protection_latch(kept);
  if (!latch) refuse_state("overtravel module");
  protection_.restore(*latch);
  kept_ = protection_.latch();
}

/// Keeps the latch where it has changed.
void OvertravelNode::remember() {
  if (memory_ == nullptr || protection_.latch() == kept_) return;
  kept_ = protection_.latch();
  memory_->save(encode_protection_latch(kept_));
}

// clang-format off
void OvertravelNode::declare(ObjectDictionary& objects) {
  using enum ObjectAccess;
  using enum ObjectType;
  const UsableRange range = usable_range(probe_);
  const auto fixed = [](double value, double per_unit) {
    return [n = counts(value, per_unit)] { return n; };
  };
  objects.add({0x2100, 0, "State of the protection", u8, read_only,
               "0 normal, 1 warn, 2 soft stop, 3 hard",
               [this] { return static_cast<std::int64_t>(protection_.state()); }});
  objects.add({0x2101, 0, "Cause of the latched state", u8, read_only, "as in OvertravelState",
               [this] { return static_cast<std::int64_t>(protection_.cause()); }});
  objects.add({0x2102, 0, "Deflection", u32, read_only, "0.1 um",
               [this] { return counts(protection_.deflection(), 1e7); }});
  objects.record(0x2110, "Thresholds");
  objects.add({0x2110, 1, "Warning", u8, constant, "percent of the usable range",
               fixed(Protection::kWarnShare, 100)});
  objects.add({0x2110, 2, "Runaway", u8, constant, "percent of the usable range",
               fixed(Protection::kRunawayShare, 100)});
  objects.add({0x2110, 3, "Lateral limit", u32, constant, "0.1 um", fixed(probe_.overtravel_lateral, 1e7)});
  objects.add({0x2110, 4, "Axial limit", u32, constant, "0.1 um", fixed(probe_.overtravel_axial, 1e7)});
  objects.add({0x2110, 5, "Lateral force limit", u32, constant, "mN", fixed(probe_.overtravel_force_lateral, 1e3)});
  objects.add({0x2110, 6, "Axial force limit", u32, constant, "mN", fixed(probe_.overtravel_force_axial, 1e3)});
  objects.record(0x2111, "Usable range");
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    const auto component = static_cast<Eigen::Index>(i);
    objects.add({0x2111, static_cast<std::uint8_t>(2 * i + 1), axis + " positive side", u32,
                 constant, "0.1 um", fixed(range.positive[component], 1e7)});
    objects.add({0x2111, static_cast<std::uint8_t>(2 * i + 2), axis + " negative side", u32,
                 constant, "0.1 um", fixed(std::abs(range.negative[component]), 1e7)});
  }
  objects.add({0x2112, 0, "Probe in the spindle", boolean, constant, "", fixed(probe_.in_spindle, 1)});
}
// clang-format on

bool OvertravelNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kStatusBase + kProbeNode || cob_id == kCommandId;
}

void OvertravelNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  ProtectionEvidence seen;
  bool pressed = false;
  for (const Frame& frame : inputs) {
    if (const auto sample = decode_probe_sample(frame); sample && is_finite(*sample))
      seen = {.sampled = true,
              .deflection = Vec3(sample->deflection.data()),
              .overtravel = (sample->flags & ProbeSample::kOvertravel) != 0,
              .signal_fault = (sample->flags & ProbeSample::kSignalFault) != 0,
              .slip = (sample->flags & ProbeSample::kSlip) != 0,
              .tick = sample->tick};
    if (const auto command = decode_group_command(frame))
      pressed = (command->flags & kResetLatch) != 0;
  }
  const ProtectionState before = protection_.state();
  protection_.step(seen, reset_.step(pressed));
  remember();

  const OvertravelState state{.tick = low16(k),
                              .state = static_cast<OvertravelState::State>(protection_.state()),
                              .cause = static_cast<OvertravelState::Cause>(protection_.cause()),
                              .deflection = protection_.deflection()};
  out.push_back(encode(state));
  if (protection_.latched() && protection_.state() > before)
    out.push_back(encode(Emergency{.node = id(),
                                   .code = kOvertravelEmergency,
                                   .error_register = 0x81,
                                   .detail = {static_cast<std::uint8_t>(state.cause)}}));
  else if (before >= ProtectionState::soft_stop && !protection_.latched())
    out.push_back(encode(Emergency{.node = id(), .code = kErrorReset}));
}

}  // namespace vcnc
