// A program file as a stream of lines, and a line as a list of words.
//
// A word is a letter and a number: "G1", "x -12.5". Comments are ( ... ) and everything after ';'.
// A line whose first character is '%' is a header. Lower case is taken as upper case; spaces
// between words, and between a letter and its number, mean nothing. Anything else is refused.
#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "controller/program_error.hpp"

namespace vcnc {

struct Word {
  char letter = 0;  ///< 'A'..'Z'
  double value = 0;
  std::string text;  ///< as written, without spaces: for messages
};

/// Splits one line into words. `where` ("FILE:LINE") begins the message of a ProgramError.
std::vector<Word> split_words(std::string_view line, const std::string& where);

/// Reads a program line by line with bounded memory.
class ProgramLines {
 public:
  static constexpr std::size_t kLongestLine = 4096;

  /// Throws ProgramError where the file cannot be read.
  explicit ProgramLines(const std::string& path);

  /// Next line without its line end; false at the end of the file. Throws ProgramError for a NUL
  /// byte or a line that is too long.
  bool next(std::string& line);

  int number() const { return number_; }  ///< of the line last read, from 1
  const std::string& path() const { return path_; }
  std::string where() const { return path_ + ":" + std::to_string(number_); }

 private:
  std::string path_;
  std::ifstream file_;
  int number_ = 0;
};

}  // namespace vcnc
