// A place in a line, and the numbers and names that begin there.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "controller/program_error.hpp"

namespace vcnc {

/// What is wrong in a line and where; the interpreter adds file and line.
class LineError : public ProgramError {
 public:
  LineError(const std::string& reason, int at) : ProgramError(reason), column(at) {}
  int column;  ///< from 1; 0: the line as a whole
};

inline bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
inline char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }
inline char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

class Cursor {
 public:
  explicit Cursor(std::string_view line)
      : begin_(line.data()), p_(line.data()), end_(line.data() + line.size()) {}

  void skip_blanks() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t')) ++p_;
  }
  bool at_end() const { return p_ == end_; }
  char peek() const { return p_ == end_ ? '\0' : *p_; }
  char peek(std::size_t ahead) const {
    return static_cast<std::size_t>(end_ - p_) > ahead ? p_[ahead] : '\0';
  }
  void advance(std::size_t count = 1) { p_ += count; }
  void to_end() { p_ = end_; }
  int column() const { return static_cast<int>(p_ - begin_) + 1; }
  std::string_view since(int column) const {
    return {begin_ + column - 1, static_cast<std::size_t>(p_ - begin_ - (column - 1))};
  }
  std::string_view rest() const { return {p_, static_cast<std::size_t>(end_ - p_)}; }

  /// Takes `c`, after blanks; false where something else stands.
  bool take(char c) {
    skip_blanks();
    if (peek() != c) return false;
    ++p_;
    return true;
  }
  /// Takes the word if exactly it stands here: letters in any case, no letter behind it.
  bool take_word(std::string_view word);
  /// The letters that stand here, upper case; not taken.
  std::string letters() const;
  /// Takes a comment in parentheses that begins here. Throws LineError where it does not end.
  void take_comment();

  /// Takes a number: [+-] digits [. digits], at least one digit, no exponent. Throws LineError.
  double number();

 private:
  double spaced_number(const char* from);
  [[noreturn]] void malformed(const char* from) const;
  const char *begin_, *p_, *end_;
};

/// Past blanks, block delete and N at the begin of a line.
void skip_number(Cursor& at);

/// A number that must be whole (to 1e-6) and not negative, or -1.
int whole_number(double value);

}  // namespace vcnc
