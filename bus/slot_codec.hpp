// Frames as bytes in a datagram of the hub: {u16 id, u8 length, u8 flags (1 = FD), payload}, ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/frame.hpp"

namespace vcnc {

/// Largest slot a client may send.
inline constexpr std::size_t kLargestSlot = 32768;

void append_slot(std::span<const Frame> frames, std::vector<std::uint8_t>& bytes);

/// Appends the frames to `into`. False if the bytes are not a row of valid frames.
bool parse_slot(std::span<const std::uint8_t> bytes, Frames& into);

/// Number of frames, or nothing if the bytes are not a row of valid frames.
std::optional<std::size_t> count_frames(std::span<const std::uint8_t> bytes);

}  // namespace vcnc
