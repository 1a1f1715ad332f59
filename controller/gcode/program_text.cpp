#include "controller/gcode/program_text.hpp"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>

namespace vcnc {
namespace {

constexpr std::size_t kBuffer = 64 * 1024;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

ProgramText::ProgramText(const std::string& path) : path_(path), buffer_(kBuffer) {
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

bool ProgramText::fill() {
  const std::size_t rest = end_ - begin_;
  std::memmove(buffer_.data(), buffer_.data() + begin_, rest);
  base_ += begin_;
  begin_ = 0;
  end_ = rest;
  const std::streamsize got =
      file_.rdbuf()->sgetn(buffer_.data() + rest, static_cast<std::streamsize>(kBuffer - rest));
  end_ += static_cast<std::size_t>(got);
  return got > 0;
}

bool ProgramText::next(std::string_view& line) {
  const char* found = nullptr;
  for (std::size_t searched = 0;;) {
    const char* from = buffer_.data() + begin_;
    const std::size_t unread = end_ - begin_;
    if (unread > searched)
      found = static_cast<const char*>(std::memchr(from + searched, '\n', unread - searched));
    if (found) break;
    searched = unread;
    if (searched > kLongestLine + 2 || !fill()) break;
  }
  if (begin_ == end_) return false;
  ++number_;
  last_ = base_ + begin_;
  const char* from = buffer_.data() + begin_;
  const std::size_t length = found ? static_cast<std::size_t>(found - from) : end_ - begin_;
  begin_ += length + (found ? 1 : 0);
  line = {from, length};
  if (length > kLongestLine + 1)
    throw ProgramError(fmt::format("{}:{}:{}: line longer than {} characters", path_, number_,
                                   kLongestLine + 1, kLongestLine));
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (line.size() > kLongestLine)
    throw ProgramError(fmt::format("{}:{}:{}: line longer than {} characters", path_, number_,
                                   kLongestLine + 1, kLongestLine));
  if (number_ == 1 && line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  if (const void* nul = std::memchr(line.data(), '\0', line.size()))
    throw ProgramError(fmt::format("{}:{}:{}: NUL byte; a program is plain text", path_, number_,
                                   static_cast<const char*>(nul) - line.data() + 1));
  return true;
}

void ProgramText::go_to(const ProgramPlace& place) {
  number_ = place.line - 1;
  if (place.offset >= base_ && place.offset <= base_ + end_) {
    begin_ = static_cast<std::size_t>(place.offset - base_);
    return;
  }
  file_.clear();
  file_.rdbuf()->pubseekpos(static_cast<std::streamoff>(place.offset), std::ios::in);
  base_ = place.offset;
  begin_ = end_ = 0;
}

}  // namespace vcnc
