// Files and folders that exist as long as a test needs them, no two tests the same: tests run side
// by side.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace vcnc {

class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "vcnc_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  /// Returns where it is.
  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream out(file, std::ios::binary);
    if (!(out << text << std::flush)) throw std::runtime_error(file.string() + ": not written");
    return file.string();
  }

 private:
  std::filesystem::path path_;
};

class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& text)
      : path_(folder_.write(name, text)) {}
  const std::string& path() const { return path_; }

 private:
  Scratch folder_;
  std::string path_;
};

}  // namespace vcnc
