// Codecs: any bytes as a slot, any frame as any message. What decodes is written back with the same
// value, and a slot with the same bytes.
#include "bus/messages.hpp"
#include "bus/slot_codec.hpp"
#include "fuzz.hpp"

namespace {

using namespace vcnc;

/// Encoding what was decoded, and doing so once more, gives the same frame.
template <class Decode>
void check(const Frame& frame, const Decode& decode) {
  const auto message = decode(frame);
  if (!message) return;
  const Frame once = encode(*message);
  fuzz::require(once.id == frame.id && once.len == frame.len);
  const auto again = decode(once);
  fuzz::require(again.has_value());
  fuzz::require(encode(*again) == once);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Frames frames;
  const std::span<const std::uint8_t> slot(data, size);
  const auto count = count_frames(slot);
  const bool valid = parse_slot(slot, frames);
  fuzz::require(count.has_value() == valid);
  if (valid) {
    fuzz::require(*count == frames.size());
    std::vector<std::uint8_t> bytes;
    append_slot(frames, bytes);
    fuzz::require(std::equal(bytes.begin(), bytes.end(), slot.begin(), slot.end()));
  }
  for (const Frame& frame : frames) {
    check(frame, decode_nmt);
    check(frame, decode_sync);
    check(frame, decode_heartbeat);
    check(frame, decode_emergency);
    check(frame, decode_group_command);
    check(frame, decode_drive_status);
    check(frame, decode_probe_sample);
    check(frame, decode_overtravel_state);
  }
  sort_by_id(frames);
  return 0;
}
