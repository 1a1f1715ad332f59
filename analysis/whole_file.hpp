// Files that appear complete or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace vcnc {

/// Writes to a temporary name beside `path` and renames in commit(); gone if not committed.
class WholeFile {
 public:
  static constexpr const char* kTemporary = ".partial";  ///< behind the name, until commit()

  explicit WholeFile(std::filesystem::path path);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  std::ostream& stream() { return stream_; }
  /// Throws std::runtime_error naming the file when anything could not be written.
  void commit();

 private:
  std::filesystem::path path_, temporary_;
  std::ofstream stream_;
};

void write_whole_file(const std::filesystem::path& path, std::string_view content);

}  // namespace vcnc
