// How much of the scan path has been measured, and whether the measurement may be believed.
//
// The path is cut into bins of setup.bin_length. Each step from one sample to the next covers the
// arc between them with the worse verdict of the two. A bin is covered when believable arc adds up
// to half of its length and its latest pass has no other; a later clean pass (a local rescan)
// replaces an earlier bad one, never the other way round.
#pragma once

#include <cstdint>
#include <vector>

#include "analysis/dynamic_error.hpp"

namespace vcnc {

class Coverage {
 public:
  enum class Bin : std::uint8_t { ok, no_contact, out_of_range, invalid, not_visited };

  Coverage() = default;
  Coverage(double length, double bin_length);

  /// The arc from station `from`, `step` long (negative: against the line), seen as `contact`.
  void add(double from, double step, Contact contact);

  std::size_t size() const { return cells_.size(); }
  double bin_length() const { return bin_length_; }
  Bin bin(std::size_t i) const;
  std::int64_t count(Bin kind) const;
  double percent() const;  ///< share of bins that are ok

 private:
  struct Cell {
    double ok_length = 0;
    Bin worst = Bin::ok;   ///< of the pass going on
    bool covered = false;  ///< by this or an earlier pass
    bool touched = false;
    std::uint32_t pass = 0;
  };
  void cover(std::size_t index, double length, Contact contact);

  double length_ = 0, bin_length_ = 0;
  std::vector<Cell> cells_;
  std::size_t current_ = static_cast<std::size_t>(-1);
  std::uint32_t pass_ = 0;
};

}  // namespace vcnc
