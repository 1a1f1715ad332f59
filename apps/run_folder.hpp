// The folder a run writes into: the resolved machine and piece first, the results later.
#pragma once

#include <filesystem>
#include <string>

#include "model/machine.hpp"

namespace vcnc {

class RunFolder {
 public:
  /// A folder that is new, empty or holds an earlier run, whose files are removed. Throws
  /// InputError for any other folder, so that nothing of the user's is ever overwritten.
  explicit RunFolder(const std::string& path);

  /// machine.toml (all keys, as run) and piece.toml; self-contained: the machine names this piece.
  void write_inputs(const Machine& machine);

  const std::filesystem::path& path() const { return path_; }
  std::string machine_file() const { return (path_ / "machine.toml").string(); }
  std::string piece_file() const { return (path_ / "piece.toml").string(); }

  /// Takes the folder away again when a run failed before it had any result.
  void remove_if_without_results();

 private:
  std::filesystem::path path_;
  bool created_ = false;
};

}  // namespace vcnc
