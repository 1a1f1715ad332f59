// A program file as lines that can be read in any order, with bounded memory: what is held is one
// buffer, never the text.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "controller/program_error.hpp"

namespace vcnc {

/// Where a line begins.
struct ProgramPlace {
  std::uint64_t offset = 0;
  int line = 1;  ///< its number
};

class ProgramText {
 public:
  static constexpr std::size_t kLongestLine = 4096;

  /// Throws ProgramError where the file cannot be read.
  explicit ProgramText(const std::string& path);

  /// The next line without its line end, valid until the next call; false at the end of the file.
  /// Throws ProgramError for a NUL byte or a line that is too long.
  bool next(std::string_view& line);

  ProgramPlace here() const { return {base_ + begin_, number_ + 1}; }  ///< of the line next() gives
  ProgramPlace last() const { return {last_, number_}; }               ///< of the line it gave
  void go_to(const ProgramPlace& place);

  const std::string& path() const { return path_; }

 private:
  bool fill();

  std::string path_;
  std::ifstream file_;
  std::vector<char> buffer_;
  std::uint64_t base_ = 0, last_ = 0;  ///< offset in the file of the buffer, of the last line
  std::size_t begin_ = 0, end_ = 0;    ///< of what is unread in the buffer
  int number_ = 0;
};

}  // namespace vcnc
