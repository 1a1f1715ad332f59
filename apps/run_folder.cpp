#include "apps/run_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <array>
#include <fstream>

#include "configs/config.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

constexpr std::array kFiles{"machine.toml", "piece.toml",    "recording.h5", "recording.h5.partial",
                            "summary.json", "summary.txt",   "report.html",  "rows.csv",
                            "program.ngc",  "scenario.toml", "notes.txt",    "faults.txt",
                            "operate.txt"};

/// First line of the machine file that a run leaves: the folder is ours.
const std::string kMark = "# Written by vcnc run: the machine as it was run.\n";

bool holds_a_run(const fs::path& folder) {
  std::ifstream in(folder / "machine.toml");
  std::string line;
  return std::getline(in, line) && line + "\n" == kMark;
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw InputError(path.string() + ": cannot be written");
}

/// No file without lines.
void write_lines(const fs::path& path, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  if (!text.empty()) write_text(path, text);
}

}  // namespace

RunFolder::RunFolder(const std::string& path, const std::vector<std::string>& inputs) {
  if (path.empty()) throw InputError("--out: is empty; it needs a folder for the results");
  path_ = fs::absolute(path);
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_directory(path_, error))
    throw InputError(path_.string() + ": is not a folder; --out needs a folder for the results");
  if (!fs::is_directory(path_, error)) {
    created_ = fs::create_directories(path_, error);
    if (error) throw InputError(path_.string() + ": cannot be created: " + error.message());
  }
  lock_ = Fd(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock_.get() < 0 || ::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError(path_.string() + ": another run is writing here");
  if (!fs::is_empty(path_, error) && !holds_a_run(path_))
    throw InputError(
        path_.string() +
        ": holds other files; --out needs a new or empty folder, or one of an earlier run");
  for (const std::string& input : inputs)
    for (const char* file : kFiles)
      if (fs::equivalent(input, path_ / file, error))
        throw InputError(input + ": is an input of this run and would be overwritten in --out " +
                         path);
  for (const char* file : kFiles) fs::remove(path_ / file, error);
}

void RunFolder::write_inputs(const Machine& machine, const PieceParams* piece) {
  Machine resolved = machine;
  if (piece) {
    write_text(piece_file(), to_toml(*piece));
    resolved.setup.piece = "piece.toml";
  }
  write_text(machine_file(), kMark + to_toml(resolved));
}

void RunFolder::write_notes(const std::vector<std::string>& notes) const {
  write_lines(path_ / "notes.txt", notes);
}

void RunFolder::write_faults(const std::vector<std::string>& faults) const {
  write_lines(path_ / "faults.txt", faults);
}

void RunFolder::write_operations(const std::vector<std::string>& operations) const {
  write_lines(path_ / "operate.txt", operations);
}

bool RunFolder::has_recording() const {
  return fs::exists(path_ / "recording.h5") || fs::exists(path_ / "recording.h5.partial");
}

void RunFolder::remove_if_without_results() {
  if (has_recording()) return;
  std::error_code ignored;
  for (const char* file : kFiles) fs::remove(path_ / file, ignored);
  if (created_) fs::remove(path_, ignored);
}

}  // namespace vcnc
