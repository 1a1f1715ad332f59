#include "bus/slot_codec.hpp"

#include <algorithm>

namespace vcnc {

namespace {

constexpr std::size_t kHeader = 4;
constexpr std::uint8_t kFd = 1;

/// Visits each frame as (header, payload); false if the bytes are not a row of valid frames.
template <class Visit>
bool walk(std::span<const std::uint8_t> bytes, const Visit& visit) {
  while (!bytes.empty()) {
    if (bytes.size() < kHeader) return false;
    const std::size_t len = bytes[2];
    if (bytes[1] > 0x07 || bytes[3] > kFd || !valid_length(bytes[2], bytes[3] == kFd) ||
        bytes.size() < kHeader + len)
      return false;
    visit(bytes.first(kHeader), bytes.subspan(kHeader, len));
    bytes = bytes.subspan(kHeader + len);
  }
  return true;
}

}  // namespace

void append_slot(std::span<const Frame> frames, std::vector<std::uint8_t>& bytes) {
  for (const Frame& frame : frames) {
    const std::uint8_t header[kHeader] = {static_cast<std::uint8_t>(frame.id & 0xff),
                                          static_cast<std::uint8_t>(frame.id >> 8), frame.len,
                                          frame.fd ? kFd : std::uint8_t{0}};
    bytes.insert(bytes.end(), header, header + kHeader);
    bytes.insert(bytes.end(), frame.data.begin(), frame.data.begin() + frame.len);
  }
}

bool parse_slot(std::span<const std::uint8_t> bytes, Frames& into) {
  return walk(bytes, [&](auto header, auto payload) {
    Frame& frame = into.emplace_back();
    frame.id = static_cast<std::uint16_t>(header[0] | header[1] << 8);
    frame.len = header[2];
    frame.fd = header[3] == kFd;
    std::copy(payload.begin(), payload.end(), frame.data.begin());
  });
}

std::optional<std::size_t> count_frames(std::span<const std::uint8_t> bytes) {
  std::size_t count = 0;
  if (!walk(bytes, [&](auto, auto) { ++count; })) return std::nullopt;
  return count;
}

}  // namespace vcnc
