// The folder a run writes into: the resolved machine and piece first, the results later.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bus/fd.hpp"
#include "model/machine.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

class RunFolder {
 public:
  /// A folder that is new, empty or holds an earlier run, whose files are removed. Throws
  /// InputError for any other folder, for one that holds an input of this run, and while another
  /// run writes there, so that nothing of the user's is ever lost.
  RunFolder(const std::string& path, const std::vector<std::string>& inputs);

  /// machine.toml (all keys, as run) and piece.toml; self-contained: the machine names this piece.
  void write_inputs(const Machine& machine, const PieceParams* piece);

  /// notes.txt, a line each; no file without notes.
  void write_notes(const std::vector<std::string>& notes) const;

  /// faults.txt, a line each; no file without faults.
  void write_faults(const std::vector<std::string>& faults) const;

  /// operate.txt, a line each; no file without operations.
  void write_operations(const std::vector<std::string>& operations) const;

  const std::filesystem::path& path() const { return path_; }
  std::string machine_file() const { return (path_ / "machine.toml").string(); }
  std::string piece_file() const { return (path_ / "piece.toml").string(); }
  bool has_recording() const;

  /// Takes the folder away again when a run failed before it had any result.
  void remove_if_without_results();

 private:
  std::filesystem::path path_;
  bool created_ = false;
  Fd lock_;  ///< held while this run lives
};

}  // namespace vcnc
