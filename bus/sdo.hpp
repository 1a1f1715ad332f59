// What client and server of a service data object have in common: how many bytes a message carries
// and the bits of its command. Source: CiA 301 V4.2.0, 7.2.4.3.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vcnc {

inline constexpr std::size_t kSdoExpeditedBytes = 4, kSdoSegmentBytes = 7;
inline constexpr std::uint8_t kSdoToggle = 0x10, kSdoLast = 0x01;

}  // namespace vcnc
