#include "controller/nc_record.hpp"

#include <xxhash.h>

#include <algorithm>

#include "controller/retract.hpp"
#include "controller/state_bytes.hpp"

namespace vcnc {

namespace {

constexpr std::uint64_t kRecordVersion = 1;
constexpr std::size_t kLongestPath = 4096;

void take_hash(StateReader& in, ContentHash& hash) {
  const auto bytes = in.take(hash.size());
  std::copy(bytes.begin(), bytes.end(), hash.begin());
}

}  // namespace

ContentHash hash_of(std::string_view content) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(content.data(), content.size()));
  ContentHash hash;
  std::copy(std::begin(canonical.digest), std::end(canonical.digest), hash.begin());
  return hash;
}

std::vector<std::uint8_t> encode_record(const NcRecord& r) {
  StateWriter out;
  out.number(kRecordVersion, 1);
  out.number(static_cast<std::uint64_t>(r.stage), 1);
  out.number(static_cast<std::uint64_t>(r.protection.state), 1);
  out.number(static_cast<std::uint64_t>(r.protection.cause), 1);
  out.number(static_cast<std::uint64_t>(r.alarm), 4);
  out.number(static_cast<std::uint64_t>(r.cycle), 8);
  out.bytes(r.program_hash);
  out.bytes(r.machine_hash);
  out.number(static_cast<std::uint64_t>(r.held.cycles), 8);
  out.real(r.held.on_path);
  for (const double q : r.position) out.real(q);
  for (const double q : r.path_point) out.real(q);
  for (const double d : r.deflection) out.real(d);
  out.real(r.protection.deflection);
  const std::string_view path = std::string_view(r.program).substr(0, kLongestPath);
  out.number(path.size(), 2);
  out.bytes(path);
  return out.take();
}

std::optional<NcRecord> decode_record(std::span<const std::uint8_t> bytes) {
  StateReader in(bytes);
  NcRecord r;
  in.require(in.number(1) == kRecordVersion);
  r.stage = in.one_of(RunStage::done);
  r.protection.state = in.one_of(ProtectionState::hard);
  r.protection.cause = in.one_of(ProtectionCause::runaway);
  r.alarm = static_cast<int>(in.number(4));
  in.require(r.alarm >= 0);
  r.cycle = static_cast<Tick>(in.number(8));
  take_hash(in, r.program_hash);
  take_hash(in, r.machine_hash);
  r.held.cycles = static_cast<Tick>(in.number(8));
  in.require(r.cycle >= 0 && r.held.cycles >= 0);
  r.held.on_path = in.real();
  in.require(r.held.on_path >= 0);
  for (double& q : r.position) q = in.real();
  for (double& q : r.path_point) q = in.real();
  for (double& d : r.deflection) d = in.real();
  r.protection.deflection = in.real();
  const auto path = in.take(in.number(2));
  r.program.assign(path.begin(), path.end());
  if (!in.whole()) return std::nullopt;
  return r;
}

const char* text_of(RunStage stage) {
  switch (stage) {
    case RunStage::none:
      return "no program has run";
    case RunStage::running:
      return "the program was running";
    case RunStage::holding:
      return "mains lost, the axes were braking on the path";
    case RunStage::held:
      return "mains lost, the axes stood on the path";
    case RunStage::retracting:
      return "mains lost, the probe was being retracted";
    case RunStage::retracted:
      return "mains lost, the probe was off the piece";
    case RunStage::returning:
      return "mains lost, the axes were on their way back to the path";
    case RunStage::alarm:
      return "the program stopped in an alarm";
    case RunStage::done:
      return "the program came to its end";
  }
  return "";
}

bool driven_off_by_hand(const Machine& machine, const NcRecord& record) {
  return machine.probe.in_spindle && record.deflection.norm() >= machine.probe.min_deflection;
}

AxisVector position_at_switch_on(const Machine& machine, const NcRecord& record) {
  if (!driven_off_by_hand(machine, record)) return record.position;
  const Retract retract(machine, record.position, record.deflection);
  return retract.position(retract.duration());
}

}  // namespace vcnc
