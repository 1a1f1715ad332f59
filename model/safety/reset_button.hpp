// The operator's reset of latched protection, as it comes over a bus.
//
// It counts when three commands in a row hold it, and so until one does not: a single spoiled frame
// opens nothing.
#pragma once

namespace vcnc {

class ResetButton {
 public:
  static constexpr int kHeldCycles = 3;

  /// One cycle; a cycle without a command is not `pressed`. Whether it counts.
  bool step(bool pressed) {
    held_ = pressed ? held_ + 1 : 0;
    return held_ >= kHeldCycles;
  }

 private:
  int held_ = 0;
};

}  // namespace vcnc
