// How a message table is written: fields with position, width and scale, and the generic codec.
//
// messages.cpp holds one constexpr table per message; nothing else knows byte positions.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "bus/frame.hpp"

namespace vcnc::wire {

/// A number of a message M: `bytes` little-endian bytes at `offset`, `per_unit` counts per SI unit.
template <class M>
struct Field {
  std::string_view name;
  std::string_view unit;
  int offset, bytes;
  bool is_signed;
  double per_unit;
  double (*get)(const M&);
  void (*set)(M&, double);
};

/// The raw code of "not a number", outside the range of values: the most negative one.
constexpr std::int64_t invalid_code(int bytes) { return -(std::int64_t{1} << (8 * bytes - 1)); }
constexpr std::int64_t largest_code(int bytes, bool is_signed) {
  return (std::int64_t{1} << (8 * bytes - (is_signed ? 1 : 0))) - 1;
}

template <class M>
void put(const Field<M>& field, const M& message, Frame& frame) {
  const double counts = field.get(message) * field.per_unit;
  const std::int64_t largest = largest_code(field.bytes, field.is_signed);
  std::int64_t code = 0;
  if (std::isnan(counts))
    code = field.is_signed ? invalid_code(field.bytes) : 0;
  else if (counts >= static_cast<double>(largest))
    code = largest;
  else if (const std::int64_t least = field.is_signed ? -largest : 0;
           counts <= static_cast<double>(least))
    code = least;
  else
    code = std::llrint(counts);
  for (int i = 0; i < field.bytes; ++i)
    frame.data[static_cast<std::size_t>(field.offset + i)] =
        static_cast<std::uint8_t>(static_cast<std::uint64_t>(code) >> (8 * i));
}

template <class M>
void take(const Field<M>& field, const Frame& frame, M& message) {
  std::uint64_t bits = 0;
  for (int i = 0; i < field.bytes; ++i)
    bits |= std::uint64_t{frame.data[static_cast<std::size_t>(field.offset + i)]} << (8 * i);
  auto code = static_cast<std::int64_t>(bits);
  if (field.is_signed) {
    const int unused = 64 - 8 * field.bytes;
    code = static_cast<std::int64_t>(bits << unused) >> unused;
    if (code == invalid_code(field.bytes)) {
      field.set(message, std::numeric_limits<double>::quiet_NaN());
      return;
    }
  }
  field.set(message, static_cast<double>(code) / field.per_unit);
}

/// All fields of a table that is a compile-time constant, so that its accessors are inlined.
template <const auto& kTable, class M>
void put_all(const M& message, Frame& frame) {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (put(kTable[i], message, frame), ...); }
  (std::make_index_sequence<std::tuple_size_v<std::remove_cvref_t<decltype(kTable)>>>{});
}
template <const auto& kTable, class M>
void take_all(const Frame& frame, M& message) {
  [&]<std::size_t... i>(std::index_sequence<i...>) { (take(kTable[i], frame, message), ...); }
  (std::make_index_sequence<std::tuple_size_v<std::remove_cvref_t<decltype(kTable)>>>{});
}

}  // namespace vcnc::wire
