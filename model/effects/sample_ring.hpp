// The last values of a signal sampled at a constant rate, and what it was some samples ago.
#pragma once

#include <array>
#include <cstddef>

namespace vcnc {

/// The last `N` values; back() reaches from 0 to N - 2 samples.
template <class V, std::size_t N>
class SampleRing {
 public:
  /// The first value fills the ring: what was before the start is as at the start.
  void push(const V& value) {
    if (!filled_) values_.fill(value);
    filled_ = true;
    newest_ = newest_ + 1 == N ? 0 : newest_ + 1;
    values_[newest_] = value;
  }

  /// The signal `samples` before the newest value, linear between values.
  V back(double samples) const {
    const auto whole = static_cast<std::size_t>(samples);
    const double part = samples - static_cast<double>(whole);
    const V &newer = at(whole), &older = at(whole + 1);
    if (part == 0) return newer;
    return newer + (older - newer) * part;
  }

 private:
  const V& at(std::size_t ago) const {
    return values_[newest_ >= ago ? newest_ - ago : newest_ + N - ago];
  }

  std::array<V, N> values_;
  std::size_t newest_ = 0;
  bool filled_ = false;
};

}  // namespace vcnc
