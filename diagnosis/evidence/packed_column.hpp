// A column of a long record in half the memory: 16 bits a sample and one scale for every 256 of
// them. One of a short record stays as it is.
//
// A sample is off by 1/65534 of the largest of its 256 at most, so that of the squares of a column
// some 1e-9 are rounding: enough for what is kept by the hundred to say what is worth a closer
// look.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

class PackedColumn {
 public:
  PackedColumn() = default;
  explicit PackedColumn(const Column& column);

  /// Samples from which on a column is long.
  static constexpr std::size_t kLong = 100000;

  Column unpacked() const;
  bool known() const { return channels_ || whole_.size() > 0; }
  bool zero() const;

 private:
  struct Channel {
    std::vector<float> scale;
    std::vector<std::int16_t> value;
  };
  Column whole_;                                          ///< of a short record
  std::shared_ptr<const std::vector<Channel>> channels_;  ///< of a long one; copies share them
};

}  // namespace vcnc
