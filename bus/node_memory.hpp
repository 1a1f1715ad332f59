// What a module keeps while it is switched off: the seam between a node, which owns no file, and
// whoever owns one.
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace vcnc {

/// What was kept cannot be used: a sentence that names it and says what to do.
class MemoryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class NodeMemory {
 public:
  virtual ~NodeMemory() = default;
  /// What was saved last; empty: nothing ever was, or the operator has cleared it. Throws
  /// MemoryError.
  virtual std::vector<std::uint8_t> load() = 0;
  /// Returns when it would survive the loss of power at once. Whatever interrupts it, load() gives
  /// the old state or the new one. Throws MemoryError.
  virtual void save(std::span<const std::uint8_t> state) = 0;
};

/// load() in the sentence of a module whose state cannot be understood.
[[noreturn]] inline void refuse_state(const char* module) {
  throw MemoryError(std::string("what the memory holds of the ") + module +
                    " is of another version of this program; `vcnc reset` clears it");
}

}  // namespace vcnc
