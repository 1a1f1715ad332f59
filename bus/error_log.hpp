// The errors of one device: those that hold (error register, object 1001h) and those that came
// (pre-defined error field, object 1003h: the newest first, eight of them).
//
// Register bits (CiA 301): 0 generic, set with every error; 1 current, 2 voltage, 3 temperature,
// 4 communication, 5 device profile, 7 manufacturer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "bus/messages.hpp"

namespace vcnc {

class ErrorLog {
 public:
  static constexpr std::size_t kEntries = 8;

  void enter(const Emergency& emergency) {
    std::copy_backward(history_.begin(), history_.end() - 1, history_.end());
    history_[0] = static_cast<std::uint32_t>(emergency.code) |
                  static_cast<std::uint32_t>(emergency.detail[0]) << 16 |
                  static_cast<std::uint32_t>(emergency.detail[1]) << 24;
    count_ = std::min(count_ + 1, kEntries);
  }
  std::size_t count() const { return count_; }
  /// Code in the lower, the first two bytes of detail in the upper half; 0: none.
  std::uint32_t entry(std::size_t i) const { return i < count_ ? history_[i] : 0; }
  std::uint16_t last_code() const { return static_cast<std::uint16_t>(entry(0)); }
  void clear() { count_ = 0; }

 private:
  std::array<std::uint32_t, kEntries> history_{};
  std::size_t count_ = 0;
};

}  // namespace vcnc
