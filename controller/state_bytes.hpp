// States as bytes: little-endian integers, IEEE 754 doubles.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vcnc {

class StateWriter {
 public:
  void number(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  void real(double value) { number(std::bit_cast<std::uint64_t>(value), 8); }
  template <class Range>
  void bytes(const Range& range) {
    bytes_.insert(bytes_.end(), range.begin(), range.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads until something does not fit; from then on everything is zero and whole() says so.
class StateReader {
 public:
  explicit StateReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  std::span<const std::uint8_t> take(std::size_t count) {
    bad_ = bad_ || count > rest_.size();
    if (bad_) return {};
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  std::uint64_t number(std::size_t count) {
    const auto bytes = take(count);
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i > 0; --i) value = value << 8 | bytes[i - 1];
    return value;
  }
  double real() {
    const double value = std::bit_cast<double>(number(8));
    bad_ = bad_ || !std::isfinite(value);
    return value;
  }
  template <class Enum>
  Enum one_of(Enum last) {
    const std::uint64_t value = number(1);
    bad_ = bad_ || value > static_cast<std::uint64_t>(last);
    return static_cast<Enum>(value);
  }
  void require(bool holds) { bad_ = bad_ || !holds; }
  bool bad() const { return bad_; }
  bool whole() const { return !bad_ && rest_.empty(); }

 private:
  std::span<const std::uint8_t> rest_;
  bool bad_ = false;
};

}  // namespace vcnc
