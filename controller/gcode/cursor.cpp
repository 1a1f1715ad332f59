#include "controller/gcode/cursor.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

namespace vcnc {
namespace {

constexpr double kLargestNumber = 1e7;
constexpr std::array<double, 19> kTen{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                                      1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};
constexpr int kExactDigits = 15;  ///< so many digits are a double without rounding

}  // namespace

bool Cursor::take_word(std::string_view word) {
  if (static_cast<std::size_t>(end_ - p_) < word.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i)
    if (upper(p_[i]) != word[i]) return false;
  if (is_letter(peek(word.size()))) return false;
  p_ += word.size();
  return true;
}

std::string Cursor::letters() const {
  std::string word;
  for (const char* p = p_; p != end_ && is_letter(*p); ++p) word += upper(*p);
  return word;
}

void Cursor::take_comment() {
  const int at = column();
  for (++p_; p_ != end_; ++p_) {
    if (*p_ == '(') throw LineError("comment within a comment", column());
    if (*p_ == ')') {
      ++p_;
      return;
    }
  }
  throw LineError("comment without closing ')'", at);
}

void Cursor::malformed(const char* from) const {
  const char* to = from;
  while (to != end_ && (is_digit(*to) || *to == '.' || *to == '+' || *to == '-')) ++to;
  throw LineError(
      fmt::format("malformed number {}; allowed are digits with at most one sign and one point",
                  std::string_view(from, static_cast<std::size_t>(to - from))),
      static_cast<int>(from - begin_) + 1);
}

double Cursor::number() {
  const char* const from = p_;
  bool negative = false;
  if (p_ != end_ && (*p_ == '+' || *p_ == '-')) negative = *p_++ == '-';
  const char* const first = p_;
  std::uint64_t digits = 0;
  int count = 0, decimals = 0;
  for (; p_ != end_ && is_digit(*p_); ++p_, ++count)
    if (count < kExactDigits) digits = 10 * digits + static_cast<std::uint64_t>(*p_ - '0');
  if (p_ != end_ && *p_ == '.')
    for (++p_; p_ != end_ && is_digit(*p_); ++p_, ++count, ++decimals)
      if (count < kExactDigits) digits = 10 * digits + static_cast<std::uint64_t>(*p_ - '0');
  if (p_ != end_ && (*p_ == ' ' || *p_ == '\t')) {
    const char* next = p_;
    while (next != end_ && (*next == ' ' || *next == '\t')) ++next;
    if (next != end_ && (is_digit(*next) || *next == '.')) return spaced_number(from);
  }
  if (count == 0 || peek() == '.') malformed(from);
  double value = 0;
  if (count <= kExactDigits) {
    // Both are exact, so their quotient is rounded once, like that of from_chars.
    value = static_cast<double>(digits) / kTen[static_cast<std::size_t>(decimals)];
  } else {
    if (std::from_chars(first, p_, value, std::chars_format::fixed).ec != std::errc())
      value = std::numeric_limits<double>::infinity();
  }
  if (!(value <= kLargestNumber))
    throw LineError(
        fmt::format("number too large: {}; allowed is up to {:.0f}",
                    std::string_view(from, static_cast<std::size_t>(p_ - from)), kLargestNumber),
        static_cast<int>(from - begin_) + 1);
  return negative ? -value : value;
}

/// A number with blanks inside, which mean nothing.
double Cursor::spaced_number(const char* from) {
  std::string digits;
  const char* to = from;
  for (const char* p = from; p != end_; ++p) {
    const bool blank = *p == ' ' || *p == '\t';
    if (!blank && !is_digit(*p) && *p != '.' && !(digits.empty() && (*p == '+' || *p == '-')))
      break;
    if (blank) continue;
    digits += *p;
    to = p + 1;
  }
  p_ = to;
  try {
    return Cursor(digits).number();
  } catch (const LineError& error) {
    throw LineError(error.what(), static_cast<int>(from - begin_) + 1);
  }
}

void skip_number(Cursor& at) {
  at.skip_blanks();
  if (at.peek() == '/') at.advance();
  at.skip_blanks();
  if (upper(at.peek()) != 'N' || !is_digit(at.peek(1))) return;
  at.advance();
  while (is_digit(at.peek())) at.advance();
  at.skip_blanks();
}

int whole_number(double value) {
  const double whole = std::round(value);
  return value >= -1e-6 && value < 1e9 && std::abs(value - whole) < 1e-6 ? static_cast<int>(whole)
                                                                         : -1;
}

}  // namespace vcnc
