// One of the two slots in which a module keeps its state, as bytes.
//
//   8   "VCNCSLOT"
//   4   version (1)
//   4   length n of the state, at most kLargestState
//   8   sequence number of the write
//   n   state
//   16  XXH3 (128 bit, canonical) of everything before
//
// Integers are little-endian. Writes alternate: the older slot is overwritten, the newer one stays
// untouched, so a write that is torn anywhere leaves the state before it. Both slots exist from the
// beginning on; a missing file is a damaged slot. With both damaged nobody knows whether something
// was locked, so there is no default: newest_slot() says what is wrong and the caller refuses.
//
// The checksum finds damage, not forgery.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vcnc {

inline constexpr std::size_t kLargestState = 256 * 1024;

struct MemorySlot {
  std::uint64_t sequence = 0;
  std::vector<std::uint8_t> state;
};

/// Throws std::length_error beyond kLargestState.
std::vector<std::uint8_t> encode_slot(const MemorySlot& slot);

/// A slot, or in `why` what is wrong with the bytes: "is empty", "is cut off", ...
std::optional<MemorySlot> decode_slot(std::span<const std::uint8_t> bytes, std::string& why);

/// Which of two slots counts, and where the next write goes.
struct SlotChoice {
  std::optional<MemorySlot> newest;  ///< none: both are damaged
  std::size_t write_to = 0;          ///< index of the older or damaged one
  std::array<std::string, 2> why;    ///< what is wrong with a damaged one
};
SlotChoice newest_slot(std::span<const std::uint8_t> first, std::span<const std::uint8_t> second);

}  // namespace vcnc
