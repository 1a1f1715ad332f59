#include "controller/nc_record.hpp"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "controller/retract.hpp"

namespace vcnc {

namespace {

constexpr std::uint64_t kVersion = 1;
constexpr std::size_t kLongestPath = 4096;

class Writer {
 public:
  void number(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  void real(double value) { number(std::bit_cast<std::uint64_t>(value), 8); }
  template <class Range>
  void bytes(const Range& range) {
    bytes_.insert(bytes_.end(), range.begin(), range.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads until something does not fit; from then on everything is zero and bad() says so.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  std::span<const std::uint8_t> take(std::size_t count) {
    bad_ = bad_ || count > rest_.size();
    if (bad_) return {};
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  std::uint64_t number(std::size_t count) {
    const auto bytes = take(count);
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i > 0; --i) value = value << 8 | bytes[i - 1];
    return value;
  }
  double real() {
    const double value = std::bit_cast<double>(number(8));
    bad_ = bad_ || !std::isfinite(value);
    return value;
  }
  template <class Enum>
  Enum one_of(Enum last) {
    const std::uint64_t value = number(1);
    bad_ = bad_ || value > static_cast<std::uint64_t>(last);
    return static_cast<Enum>(value);
  }
  void hash(ContentHash& hash) {
    const auto bytes = take(hash.size());
    std::copy(bytes.begin(), bytes.end(), hash.begin());
  }
  void require(bool holds) { bad_ = bad_ || !holds; }
  bool whole() const { return !bad_ && rest_.empty(); }

 private:
  std::span<const std::uint8_t> rest_;
  bool bad_ = false;
};

}  // namespace

ContentHash hash_of(std::string_view content) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(content.data(), content.size()));
  ContentHash hash;
  std::copy(std::begin(canonical.digest), std::end(canonical.digest), hash.begin());
  return hash;
}

std::vector<std::uint8_t> encode_record(const NcRecord& r) {
  Writer out;
  out.number(kVersion, 1);
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
  Reader in(bytes);
  NcRecord r;
  in.require(in.number(1) == kVersion);
  r.stage = in.one_of(RunStage::done);
  r.protection.state = in.one_of(ProtectionState::hard);
  r.protection.cause = in.one_of(ProtectionCause::runaway);
  r.alarm = static_cast<int>(in.number(4));
  in.require(r.alarm >= 0);
  r.cycle = static_cast<Tick>(in.number(8));
  in.hash(r.program_hash);
  in.hash(r.machine_hash);
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
