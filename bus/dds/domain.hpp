// The DDS domain of this process, and the error that everything about DDS throws.
//
// One configuration for publisher and subscribers: pinned to the loopback interface, no multicast,
// writer caches large enough that a reader that stands still for a while stalls nobody. The
// environment can change it: VCNC_DDS_TAG (only equal tags meet, so runs side by side stay apart),
// and for other hosts VCNC_DDS_IF, VCNC_DDS_PEER, VCNC_DDS_MAXMSG, VCNC_DDS_FRAG,
// VCNC_DDS_MULTICAST.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

namespace vcnc {

class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class DdsDomain {
 public:
  /// At most one per process and id. Throws DdsError.
  explicit DdsDomain(std::uint32_t id = 0);
  ~DdsDomain();
  DdsDomain(const DdsDomain&) = delete;
  DdsDomain& operator=(const DdsDomain&) = delete;

  std::uint32_t id() const { return id_; }

 private:
  std::uint32_t id_;
  std::int32_t handle_;
};

}  // namespace vcnc
