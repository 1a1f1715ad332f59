#include "bus/sdo_client.hpp"

#include <algorithm>

#include "bus/messages.hpp"
#include "bus/sdo.hpp"

namespace vcnc {

Frame SdoClient::request(std::uint8_t command) const {
  return encode_sdo_request({.node = node_, .command = command, .index = index_, .sub = sub_});
}

Frame SdoClient::upload(std::uint16_t index, std::uint8_t sub) {
  index_ = index;
  sub_ = sub;
  aborted_ = SdoAbort::none;
  bytes_.clear();
  announced_.reset();
  phase_ = Phase::begin_upload;
  return request(0x40);
}

Frame SdoClient::download(std::uint16_t index, std::uint8_t sub, ObjectBytes bytes) {
  index_ = index;
  sub_ = sub;
  aborted_ = SdoAbort::none;
  bytes_ = std::move(bytes);
  sent_ = 0;
  phase_ = Phase::begin_download;
  SdoMessage m{.node = node_, .command = 0x21, .index = index, .sub = sub};
  if (!bytes_.empty() && bytes_.size() <= kSdoExpeditedBytes) {
    m.command = static_cast<std::uint8_t>(0x23 | (kSdoExpeditedBytes - bytes_.size()) << 2);
    std::copy(bytes_.begin(), bytes_.end(), m.data.begin());
    sent_ = bytes_.size();
  } else {
    for (std::size_t i = 0; i < 4; ++i)
      m.data[i] = static_cast<std::uint8_t>(bytes_.size() >> (8 * i));
  }
  return encode_sdo_request(m);
}

Frame SdoClient::give_up(SdoAbort why) {
  phase_ = Phase::idle;
  aborted_ = why;
  SdoMessage m{.node = node_, .command = 0x80, .index = index_, .sub = sub_};
  for (std::size_t i = 0; i < 4; ++i)
    m.data[i] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(why) >> (8 * i));
  return encode_sdo_request(m);
}

Frame SdoClient::next_upload() {
  Frame frame = encode_sdo_request({.node = node_, .command = 0x60});
  if (toggle_) frame.data[0] |= kSdoToggle;
  return frame;
}

Frame SdoClient::next_download() {
  const std::size_t size = std::min(kSdoSegmentBytes, bytes_.size() - sent_);
  Frame frame = encode_sdo_request({.node = node_});
  frame.data[0] = static_cast<std::uint8_t>((kSdoSegmentBytes - size) << 1);
  if (toggle_) frame.data[0] |= kSdoToggle;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(sent_), size, frame.data.begin() + 1);
  sent_ += size;
  if (sent_ == bytes_.size()) frame.data[0] |= kSdoLast;
  return frame;
}

std::optional<Frame> SdoClient::feed(const Frame& frame) {
  const auto answer = decode_sdo_answer(frame);
  if (done() || !answer || answer->node != node_) return std::nullopt;
  const int command = answer->command >> 5;
  if (command == 4) {
    std::uint32_t code = 0;
    for (std::size_t i = 0; i < 4; ++i) code |= std::uint32_t{answer->data[i]} << (8 * i);
    aborted_ =
        static_cast<SdoAbort>(code == 0 ? static_cast<std::uint32_t>(SdoAbort::access) : code);
    phase_ = Phase::idle;
    return std::nullopt;
  }
  const bool other = answer->index != index_ || answer->sub != sub_;
  const bool toggled = (answer->command & kSdoToggle) != 0;
  switch (phase_) {
    case Phase::begin_upload: {
      if (command != 2 || other) return give_up(SdoAbort::command);
      if (answer->command & 0x02) {
        const std::size_t size = kSdoExpeditedBytes - ((answer->command >> 2) & 0x03);
        bytes_.assign(answer->data.begin(),
                      answer->data.begin() + static_cast<std::ptrdiff_t>(size));
        phase_ = Phase::idle;
        return std::nullopt;
      }
      if (answer->command & 0x01) {
        announced_ = 0;
        for (std::size_t i = 0; i < 4; ++i) *announced_ |= std::size_t{answer->data[i]} << (8 * i);
      }
      phase_ = Phase::upload;
      toggle_ = false;
      return next_upload();
    }
    case Phase::upload: {
      if (command != 0) return give_up(SdoAbort::command);
      if (toggled != toggle_) return give_up(SdoAbort::toggle);
      const std::size_t size = kSdoSegmentBytes - ((answer->command >> 1) & 0x07);
      bytes_.insert(bytes_.end(), frame.data.begin() + 1,
                    frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(size));
      if (bytes_.size() > announced_.value_or(kLongest)) return give_up(SdoAbort::too_long);
      toggle_ = !toggle_;
      if (!(answer->command & kSdoLast)) return next_upload();
      if (announced_ && bytes_.size() != *announced_) return give_up(SdoAbort::length);
      phase_ = Phase::idle;
      return std::nullopt;
    }
    case Phase::begin_download:
      if (command != 3 || other) return give_up(SdoAbort::command);
      if (!bytes_.empty() && sent_ == bytes_.size()) {
        phase_ = Phase::idle;
        return std::nullopt;
      }
      phase_ = Phase::download;
      toggle_ = false;
      return next_download();
    case Phase::download:
      if (command != 1) return give_up(SdoAbort::command);
      if (toggled != toggle_) return give_up(SdoAbort::toggle);
      toggle_ = !toggle_;
      if (sent_ < bytes_.size()) return next_download();
      phase_ = Phase::idle;
      return std::nullopt;
    case Phase::idle:
      break;
  }
  return std::nullopt;
}

std::uint32_t SdoClient::number() const {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, bytes_.size()); ++i)
    number |= std::uint32_t{bytes_[i]} << (8 * i);
  return number;
}

}  // namespace vcnc
