// What hub and client have in common: the address and the first words.
#pragma once

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include "bus/transport.hpp"

namespace vcnc {

inline constexpr std::uint8_t kHubVersion = 1;
inline constexpr std::size_t kHelloSize = 5;  ///< 'V' 'C' 'H' version, node id
enum class Welcome : std::uint8_t { ok = 0, id_in_use = 1, wrong_version = 2 };

/// Hub to client: u64 number of frames lost, then the slot.
inline constexpr std::size_t kLostHeader = 8;

inline sockaddr_un hub_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw BusError(fmt::format("hub \"{}\": the path must have 1 to {} characters", path,
                               sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

inline int connect_to(int fd, const sockaddr_un& address) {
  return ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

inline std::array<std::uint8_t, kLostHeader> lost_header(std::uint64_t lost) {
  std::array<std::uint8_t, kLostHeader> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(lost >> (8 * i));
  return bytes;
}

}  // namespace vcnc
