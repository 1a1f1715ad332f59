#include "bus/trace_hash.hpp"

#include <fmt/format.h>
#include <xxhash.h>

#include <new>

namespace vcnc {

void TraceHash::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

TraceHash::TraceHash() : state_(XXH3_createState()) {
  if (!state_) throw std::bad_alloc();
  XXH3_128bits_reset(state_.get());
}

void TraceHash::add(Tick k, std::span<const Frame> frames) {
  bytes_.clear();
  const auto put = [this](std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  put(static_cast<std::uint64_t>(k), 8);
  for (const Frame& frame : frames) {
    put(frame.id, 2);
    put(frame.len, 1);
    put(frame.fd ? 1 : 0, 1);
    bytes_.insert(bytes_.end(), frame.data.begin(), frame.data.begin() + frame.len);
  }
  XXH3_128bits_update(state_.get(), bytes_.data(), bytes_.size());
}

std::string TraceHash::hex() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace vcnc
