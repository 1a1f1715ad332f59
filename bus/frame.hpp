// A CAN or CAN FD data frame with an 11-bit identifier, as a value.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vcnc {

struct Frame {
  std::uint16_t id = 0;  ///< 11-bit identifier (COB-ID)
  std::uint8_t len = 0;  ///< payload bytes; FD allows 0..8, 12, 16, 20, 24, 32, 48, 64
  bool fd = false;       ///< CAN FD with bit-rate switch
  std::array<std::uint8_t, 64> data{};

  std::span<const std::uint8_t> payload() const { return {data.data(), len}; }
  bool operator==(const Frame& other) const {
    return id == other.id && len == other.len && fd == other.fd &&
           std::equal(data.begin(), data.begin() + len, other.data.begin());
  }
};

/// Whether `len` is a payload length a frame of this kind can carry.
constexpr bool valid_length(int len, bool fd) {
  if (len >= 0 && len <= 8) return true;
  return fd &&
         (len == 12 || len == 16 || len == 20 || len == 24 || len == 32 || len == 48 || len == 64);
}

using Frames = std::vector<Frame>;

/// Order in which frames of one cycle act and are logged: by identifier; equal ones keep their
/// order. Does not allocate.
void sort_by_id(Frames& frames);

}  // namespace vcnc
