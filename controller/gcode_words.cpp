#include "controller/gcode_words.hpp"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>

namespace vcnc {
namespace {

constexpr double kLargestNumber = 1e7;

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// The characters that may belong to a number, from `i` on.
std::string_view number_at(std::string_view line, std::size_t i) {
  std::size_t end = i;
  while (end < line.size() &&
         (is_digit(line[end]) || line[end] == '.' || line[end] == '+' || line[end] == '-'))
    ++end;
  return line.substr(i, end - i);
}

/// [+-] digits [. digits], at least one digit; nothing else.
bool parse_number(std::string_view text, double& value) {
  if (text.starts_with('+')) {  // from_chars knows '-' only
    text.remove_prefix(1);
    if (text.starts_with('-')) return false;
  }
  bool digit = false;
  for (const char c : text) digit = digit || is_digit(c);
  if (!digit) return false;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return error == std::errc() && end == text.data() + text.size();
}

std::string show(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isprint(byte) ? fmt::format("'{}'", c) : fmt::format("byte {:#04x}", byte);
}

}  // namespace

std::vector<Word> split_words(std::string_view line, const std::string& where) {
  std::vector<Word> words;
  std::size_t i = 0;
  const auto skip_blanks = [&] {
    while (i < line.size() && is_blank(line[i])) ++i;
  };
  skip_blanks();
  if (i < line.size() && line[i] == '%') return words;
  while (skip_blanks(), i < line.size()) {
    const char c = line[i];
    if (c == ';') break;
    if (c == '(') {
      const std::size_t close = line.find(')', i);
      if (close == std::string_view::npos)
        throw ProgramError(where + ": comment without closing ')'");
      i = close + 1;
      continue;
    }
    if (!is_letter(c))
      throw ProgramError(fmt::format("{}: unexpected {}; a word is a letter followed by a number{}",
                                     where, show(c),
                                     c == '/' ? ", and block delete is not supported" : ""));
    ++i;
    skip_blanks();
    const std::string_view number = number_at(line, i);
    i += number.size();
    Word word{static_cast<char>(std::toupper(static_cast<unsigned char>(c))), 0, {}};
    word.text = word.letter + std::string(number);
    if (!parse_number(number, word.value))
      throw ProgramError(fmt::format(
          "{}: malformed number in {}; allowed are digits with at most one sign and one point",
          where, word.text));
    if (!(std::abs(word.value) <= kLargestNumber))
      throw ProgramError(fmt::format("{}: number too large in {}; allowed is up to {:.0f}", where,
                                     word.text, kLargestNumber));
    words.push_back(std::move(word));
  }
  return words;
}

ProgramLines::ProgramLines(const std::string& path) : path_(path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw ProgramError(path + ": no such program file");
  if (std::filesystem::is_directory(status))
    throw ProgramError(path + ": is a directory, not a program file");
  // The program is read twice, once to check it, so it cannot come out of a pipe.
  if (!std::filesystem::is_regular_file(status))
    throw ProgramError(path + ": is not a regular file");
  file_.open(path, std::ios::binary);
  if (!file_) throw ProgramError(path + ": the program file cannot be read");
}

bool ProgramLines::next(std::string& line) {
  line.clear();
  using Traits = std::ifstream::traits_type;
  std::streambuf& bytes = *file_.rdbuf();
  Traits::int_type byte = bytes.sbumpc();
  if (Traits::eq_int_type(byte, Traits::eof())) return false;
  ++number_;
  for (; !Traits::eq_int_type(byte, Traits::eof()); byte = bytes.sbumpc()) {
    const char c = Traits::to_char_type(byte);
    if (c == '\n') break;
    if (c == '\0') throw ProgramError(where() + ": NUL byte; a program is plain text");
    if (line.size() == kLongestLine)
      throw ProgramError(fmt::format("{}: line longer than {} characters", where(), kLongestLine));
    line.push_back(c);
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (number_ == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
  return true;
}

}  // namespace vcnc
