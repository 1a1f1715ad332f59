#include "bus/memory_slot.hpp"

#include <xxhash.h>

#include <algorithm>
#include <stdexcept>

namespace vcnc {

namespace {

constexpr std::array<std::uint8_t, 8> kMagic{'V', 'C', 'N', 'C', 'S', 'L', 'O', 'T'};
constexpr std::uint64_t kVersion = 1;
constexpr std::size_t kHeaderSize = 24, kChecksumSize = 16;

using Checksum = std::array<std::uint8_t, kChecksumSize>;

Checksum checksum_of(std::span<const std::uint8_t> bytes) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(bytes.data(), bytes.size()));
  Checksum checksum;
  std::copy(std::begin(canonical.digest), std::end(canonical.digest), checksum.begin());
  return checksum;
}

void put(std::vector<std::uint8_t>& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint64_t get(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) value = value << 8 | bytes[i - 1];
  return value;
}

}  // namespace

std::vector<std::uint8_t> encode_slot(const MemorySlot& slot) {
  if (slot.state.size() > kLargestState) throw std::length_error("a state too large for its slot");
  std::vector<std::uint8_t> bytes(kMagic.begin(), kMagic.end());
  put(bytes, kVersion, 4);
  put(bytes, slot.state.size(), 4);
  put(bytes, slot.sequence, 8);
  bytes.insert(bytes.end(), slot.state.begin(), slot.state.end());
  const Checksum checksum = checksum_of(bytes);
  bytes.insert(bytes.end(), checksum.begin(), checksum.end());
  return bytes;
}

std::optional<MemorySlot> decode_slot(std::span<const std::uint8_t> bytes, std::string& why) {
  const auto bad = [&](const char* reason) {
    why = reason;
    return std::nullopt;
  };
  if (bytes.empty()) return bad("is missing or empty");
  if (bytes.size() < kHeaderSize + kChecksumSize) return bad("is cut off");
  if (!std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) return bad("is not a memory slot");
  const std::uint64_t length = get(bytes.subspan(12, 4));
  if (length != bytes.size() - kHeaderSize - kChecksumSize || length > kLargestState)
    return bad("is cut off or half written");
  const auto content = bytes.first(bytes.size() - kChecksumSize);
  const Checksum checksum = checksum_of(content);
  if (!std::equal(checksum.begin(), checksum.end(), bytes.end() - kChecksumSize))
    return bad("has a wrong checksum");
  if (get(bytes.subspan(8, 4)) != kVersion) return bad("is of another version");
  const auto state = content.subspan(kHeaderSize);
  return MemorySlot{get(bytes.subspan(16, 8)), {state.begin(), state.end()}};
}

SlotChoice newest_slot(std::span<const std::uint8_t> first, std::span<const std::uint8_t> second) {
  SlotChoice choice;
  std::optional<MemorySlot> a = decode_slot(first, choice.why[0]);
  std::optional<MemorySlot> b = decode_slot(second, choice.why[1]);
  const bool first_counts = a && (!b || a->sequence > b->sequence);
  choice.write_to = first_counts ? 1 : 0;
  choice.newest = first_counts ? std::move(a) : std::move(b);
  return choice;
}

}  // namespace vcnc
