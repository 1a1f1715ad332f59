// A file that a command writes where its user says, complete or not at all.
#pragma once

#include <fstream>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "analysis/whole_file.hpp"

namespace vcnc {

/// Throws InputError naming `option` where `path` is a file that this command did not write: files
/// of its own have `mark` within their first 1000 bytes. What is no regular file (a terminal, a
/// pipe) may be written to.
void refuse_foreign_output(const std::string& option, const std::string& path,
                           std::string_view mark);

class OutputFile {
 public:
  /// Throws as refuse_foreign_output(), and std::runtime_error where nothing can be written.
  OutputFile(const std::string& option, std::string path, std::string_view mark);

  std::ostream& stream();
  /// The file that holds what was written so far; none of a file that is not regular.
  std::optional<std::string> so_far();
  /// The file appears. Throws std::runtime_error where it could not be written completely.
  void commit();

 private:
  std::string path_;
  std::unique_ptr<WholeFile> whole_;  ///< null: not a regular file
  std::ofstream direct_;
};

}  // namespace vcnc
