#include "bus/sdo_server.hpp"

#include <algorithm>

#include "bus/messages.hpp"
#include "bus/sdo.hpp"

namespace vcnc {

namespace {

// Command specifiers of the client (upper three bits) and answers of the server.
constexpr int kDownloadSegment = 0, kBeginDownload = 1, kBeginUpload = 2, kUploadSegment = 3,
              kClientAborts = 4;
constexpr std::uint8_t kDownloadBegun = 0x60, kSegmentTaken = 0x20, kUploadBegun = 0x41,
                       kExpedited = 0x43, kAborted = 0x80;

}  // namespace

bool SdoServer::concerns(const Frame& frame) const {
  return frame.id == kSdoRequestBase + node_ && frame.len == 8;
}

Frame SdoServer::abort(SdoAbort why) {
  transfer_ = Transfer::none;
  const auto code = static_cast<std::uint32_t>(why);
  SdoMessage message{.node = node_, .command = kAborted, .index = index_, .sub = sub_};
  for (std::size_t i = 0; i < 4; ++i) message.data[i] = static_cast<std::uint8_t>(code >> (8 * i));
  return encode_sdo_answer(message);
}

Frame SdoServer::begin_download(const Frame& request) {
  const SdoMessage m = *decode_sdo_request(request);
  const bool expedited = m.command & 0x02, sized = m.command & 0x01;
  const ObjectEntry* entry = objects_.find(index_, sub_);
  announced_.reset();
  bytes_.clear();
  if (expedited) {
    std::size_t size = kSdoExpeditedBytes - ((m.command >> 2) & 0x03);
    if (!sized && entry != nullptr)  // then the object says how many of the four bytes count
      size =
          std::min<std::size_t>(kSdoExpeditedBytes, static_cast<std::size_t>(size_of(entry->type)));
    bytes_.assign(m.data.begin(), m.data.begin() + static_cast<std::ptrdiff_t>(size));
    const SdoAbort refused = objects_.write(index_, sub_, bytes_);
    if (refused != SdoAbort::none) return abort(refused);
  } else {
    if (sized) {
      std::size_t size = 0;
      for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{m.data[i]} << (8 * i);
      announced_ = size;
    }
    const std::size_t hoped = announced_ ? *announced_
                              : entry    ? static_cast<std::size_t>(size_of(entry->type))
                                         : 0;
    const SdoAbort refused = objects_.may_write(index_, sub_, hoped);
    if (refused != SdoAbort::none) return abort(refused);
    transfer_ = Transfer::download;
    toggle_ = false;
  }
  return encode_sdo_answer(
      {.node = node_, .command = kDownloadBegun, .index = index_, .sub = sub_});
}

Frame SdoServer::download_segment(const Frame& request) {
  if (transfer_ != Transfer::download) return abort(SdoAbort::command);
  const std::uint8_t command = request.data[0];
  if (((command & kSdoToggle) != 0) != toggle_) return abort(SdoAbort::toggle);
  const std::size_t size = kSdoSegmentBytes - ((command >> 1) & 0x07);
  bytes_.insert(bytes_.end(), request.data.begin() + 1,
                request.data.begin() + 1 + static_cast<std::ptrdiff_t>(size));
  if (bytes_.size() > announced_.value_or(ObjectDictionary::kLongestText))
    return abort(SdoAbort::too_long);
  if (command & kSdoLast) {
    if (announced_ && bytes_.size() != *announced_) return abort(SdoAbort::length);
    const SdoAbort refused = objects_.write(index_, sub_, bytes_);
    if (refused != SdoAbort::none) return abort(refused);
    transfer_ = Transfer::none;
  }
  Frame answer = encode_sdo_answer({.node = node_, .command = kSegmentTaken});
  if (toggle_) answer.data[0] |= kSdoToggle;
  toggle_ = !toggle_;
  return answer;
}

Frame SdoServer::begin_upload() {
  const SdoAbort refused = objects_.read(index_, sub_, bytes_);
  if (refused != SdoAbort::none) return abort(refused);
  SdoMessage answer{.node = node_, .command = kUploadBegun, .index = index_, .sub = sub_};
  if (!bytes_.empty() && bytes_.size() <= kSdoExpeditedBytes) {
    answer.command =
        static_cast<std::uint8_t>(kExpedited | (kSdoExpeditedBytes - bytes_.size()) << 2);
    std::copy(bytes_.begin(), bytes_.end(), answer.data.begin());
  } else {
    answer.data[0] = static_cast<std::uint8_t>(bytes_.size());
    answer.data[1] = static_cast<std::uint8_t>(bytes_.size() >> 8);
    transfer_ = Transfer::upload;
    sent_ = 0;
    toggle_ = false;
  }
  return encode_sdo_answer(answer);
}

Frame SdoServer::upload_segment(const Frame& request) {
  if (transfer_ != Transfer::upload) return abort(SdoAbort::command);
  if (((request.data[0] & kSdoToggle) != 0) != toggle_) return abort(SdoAbort::toggle);
  const std::size_t size = std::min(kSdoSegmentBytes, bytes_.size() - sent_);
  Frame answer = encode_sdo_answer({.node = node_});
  answer.data[0] = static_cast<std::uint8_t>((kSdoSegmentBytes - size) << 1);
  if (toggle_) answer.data[0] |= kSdoToggle;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(sent_), size, answer.data.begin() + 1);
  sent_ += size;
  toggle_ = !toggle_;
  if (sent_ == bytes_.size()) {
    answer.data[0] |= kSdoLast;
    transfer_ = Transfer::none;
  }
  return answer;
}

std::optional<Frame> SdoServer::serve(const Frame& request, Tick k) {
  if (!concerns(request)) return std::nullopt;
  const int command = request.data[0] >> 5;
  last_ = k;
  if (command == kClientAborts) {
    transfer_ = Transfer::none;
    return std::nullopt;
  }
  if (command == kDownloadSegment || command == kUploadSegment) {
    if (transfer_ == Transfer::none) index_ = sub_ = 0;
    return command == kDownloadSegment ? download_segment(request) : upload_segment(request);
  }
  transfer_ = Transfer::none;
  const SdoMessage m = *decode_sdo_request(request);
  index_ = m.index;
  sub_ = m.sub;
  if (command == kBeginDownload) return begin_download(request);
  if (command == kBeginUpload) return begin_upload();
  return abort(SdoAbort::command);
}

std::optional<Frame> SdoServer::expire(Tick k) {
  if (transfer_ == Transfer::none || k - last_ < kTimeout) return std::nullopt;
  return abort(SdoAbort::timed_out);
}

}  // namespace vcnc
