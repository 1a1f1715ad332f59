// The SDO server of a device (CiA 301): read and write its objects, frames in, frames out.
//
//   600h+id  request   expedited (up to 4 bytes) and segmented upload and download, abort
//   580h+id  answer    one for each request; none to an abort or to a frame that is not 8 bytes
//
// A segmented transfer ends by its last segment, by an abort of either side, by a wrong toggle bit
// (05030000h), by a new request to begin one, or when the client lets kTimeout cycles pass
// (05040000h, the only frame that answers nothing). Block transfer is refused (05040001h), which
// sends a client back to segments. Source: CiA 301 4.2, 7.2.4.3.
#pragma once

#include <optional>

#include "bus/frame.hpp"
#include "bus/object_dictionary.hpp"
#include "bus/tick.hpp"

namespace vcnc {

class SdoServer {
 public:
  static constexpr Tick kTimeout = 1000;  ///< cycles between two frames of a client

  /// `objects` outlives the server.
  SdoServer(int node, const ObjectDictionary& objects) : node_(node), objects_(objects) {}

  /// Whether the frame is a request to this server.
  bool concerns(const Frame& frame) const;
  /// The answer to a request that came before cycle k.
  std::optional<Frame> serve(const Frame& request, Tick k = 0);
  /// The abort of a transfer whose client has gone, once per cycle.
  std::optional<Frame> expire(Tick k);
  bool transferring() const { return transfer_ != Transfer::none; }
  void reset() { transfer_ = Transfer::none; }

 private:
  enum class Transfer { none, upload, download };

  Frame begin_download(const Frame& request);
  Frame download_segment(const Frame& request);
  Frame begin_upload();
  Frame upload_segment(const Frame& request);
  Frame abort(SdoAbort why);

  int node_;
  const ObjectDictionary& objects_;
  Transfer transfer_ = Transfer::none;
  std::uint16_t index_ = 0;  ///< of the transfer
  std::uint8_t sub_ = 0;
  ObjectBytes bytes_;
  std::size_t sent_ = 0;                  ///< upload: bytes the client has
  std::optional<std::size_t> announced_;  ///< download: size the client said
  bool toggle_ = false;                   ///< that the next segment must have
  Tick last_ = 0;
};

}  // namespace vcnc
