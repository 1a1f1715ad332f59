// The SDO client: one transfer with one device, frames in, frames out.
//
// upload() or download() gives the first request; feed() takes every frame of the bus and gives
// the next request, if one is due. The transfer is over when done(); it failed if aborted() is not
// SdoAbort::none. Waiting, and what to do when no answer comes, is the caller's.
#pragma once

#include <optional>

#include "bus/frame.hpp"
#include "bus/object_dictionary.hpp"

namespace vcnc {

class SdoClient {
 public:
  static constexpr std::size_t kLongest = 65536;  ///< bytes that a device may send

  explicit SdoClient(int node) : node_(node) {}

  Frame upload(std::uint16_t index, std::uint8_t sub);
  Frame download(std::uint16_t index, std::uint8_t sub, ObjectBytes bytes);
  std::optional<Frame> feed(const Frame& frame);

  bool done() const { return phase_ == Phase::idle; }
  SdoAbort aborted() const { return aborted_; }
  const ObjectBytes& bytes() const { return bytes_; }  ///< what was read
  std::uint32_t number() const;                        ///< its first four bytes

 private:
  enum class Phase { idle, begin_upload, upload, begin_download, download };

  Frame request(std::uint8_t command) const;
  Frame give_up(SdoAbort why);
  Frame next_upload();
  Frame next_download();

  int node_;
  Phase phase_ = Phase::idle;
  SdoAbort aborted_ = SdoAbort::none;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  ObjectBytes bytes_;
  std::size_t sent_ = 0;                  ///< download
  std::optional<std::size_t> announced_;  ///< upload
  bool toggle_ = false;
};

}  // namespace vcnc
