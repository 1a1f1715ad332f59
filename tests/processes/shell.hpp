// Runs command lines as a user's shell would and keeps what they say.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/scratch.hpp"

namespace vcnc {

namespace fs = std::filesystem;

inline std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

inline std::uintmax_t size_of(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

struct Said {
  int code = 0;
  std::string out, err;
};

inline Said shell(const Scratch& scratch, const std::string& command) {
  const std::string out = scratch / "stdout", err = scratch / "stderr";
  const int status = std::system((command + " >" + out + " 2>" + err + " </dev/null").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out),
          read_text(err)};
}

inline std::string bin(const std::string& program) {
  return std::string(VCNC_BIN_DIR) + "/" + program;
}
inline std::string configs(const std::string& file) {
  return std::string(VCNC_SOURCE_DIR) + "/configs/" + file;
}

/// Value of a key of a flat JSON text, as text.
inline std::string json_value(const std::string& json, const std::string& key) {
  const std::size_t at = json.find("\"" + key + "\"");
  if (at == std::string::npos) return "";
  std::size_t from = json.find(':', at) + 1;
  while (json[from] == ' ' || json[from] == '"') ++from;
  return json.substr(from, json.find_first_of("\",}\n", from) - from);
}

}  // namespace vcnc
