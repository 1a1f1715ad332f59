#include "analysis/whole_file.hpp"

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace vcnc {

WholeFile::WholeFile(std::filesystem::path path)
    : path_(std::move(path)), temporary_(path_.string() + kTemporary) {
  stream_.open(temporary_, std::ios::binary | std::ios::trunc);
  if (!stream_)
    throw std::runtime_error(path_.string() + ": cannot be written: " + std::strerror(errno));
}

WholeFile::~WholeFile() {
  if (temporary_.empty()) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void WholeFile::commit() {
  errno = 0;
  stream_.close();
  if (!stream_)
    throw std::runtime_error(path_.string() + ": cannot be written completely: " +
                             (errno != 0 ? std::strerror(errno) : "write error"));
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw std::runtime_error(path_.string() + ": cannot be written: " + error.message());
  temporary_.clear();
}

void write_whole_file(const std::filesystem::path& path, std::string_view content) {
  WholeFile file(path);
  file.stream().write(content.data(), static_cast<std::streamsize>(content.size()));
  file.commit();
}

}  // namespace vcnc
