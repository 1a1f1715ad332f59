#include "apps/run_folder.hpp"

#include <array>
#include <fstream>

#include "configs/config.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

constexpr std::array kFiles{"machine.toml", "piece.toml",  "recording.h5", "recording.h5.partial",
                            "summary.json", "summary.txt", "report.html",  "rows.csv"};

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw InputError(path.string() + ": cannot be written");
}

}  // namespace

RunFolder::RunFolder(const std::string& path) : path_(fs::absolute(path)) {
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_directory(path_, error))
    throw InputError(path_.string() + ": is not a folder; --out needs a folder for the results");
  if (fs::is_directory(path_, error)) {
    if (!fs::is_empty(path_, error) && !fs::exists(path_ / "machine.toml", error))
      throw InputError(
          path_.string() +
          ": holds other files; --out needs a new or empty folder, or one of an earlier run");
    for (const char* file : kFiles) fs::remove(path_ / file, error);
    return;
  }
  created_ = fs::create_directories(path_, error);
  if (error) throw InputError(path_.string() + ": cannot be created: " + error.message());
}

void RunFolder::write_inputs(const Machine& machine) {
  Machine resolved = machine;
  if (!machine.setup.piece.empty()) {
    write_text(piece_file(), to_toml(load_piece(machine.setup.piece)));
    resolved.setup.piece = "piece.toml";
  }
  write_text(machine_file(), to_toml(resolved));
}

void RunFolder::remove_if_without_results() {
  std::error_code ignored;
  if (fs::exists(path_ / "recording.h5", ignored) ||
      fs::exists(path_ / "recording.h5.partial", ignored))
    return;
  for (const char* file : kFiles) fs::remove(path_ / file, ignored);
  if (created_) fs::remove(path_, ignored);
}

}  // namespace vcnc
