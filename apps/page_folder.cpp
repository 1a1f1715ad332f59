#include "apps/page_folder.hpp"

#include <fstream>

#include "model/input_error.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

bool holds_page(const fs::path& file, std::string_view mark) {
  std::ifstream in(file);
  std::string first, second;
  return std::getline(in, first) && std::getline(in, second) && second == mark;
}

}  // namespace

fs::path page_folder(const std::string& out, const std::string& name, std::string_view mark) {
  if (out.empty()) throw InputError("--out: is empty; it needs a folder for the page");
  const fs::path folder = fs::absolute(out);
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw InputError("--out " + out + ": is not a folder; it needs one for the page");
  if (!fs::exists(folder, error)) {
    fs::create_directories(folder, error);
    if (error) throw InputError("--out " + out + ": cannot be created: " + error.message());
  }
  const bool empty = fs::is_empty(folder, error);
  if (error) throw InputError("--out " + out + ": cannot be read: " + error.message());
  if (!empty && !holds_page(folder / name, mark))
    throw InputError("--out " + out +
                     ": holds other files; it needs a new or empty folder, or one with an earlier "
                     "page of this kind");
  const fs::path trial = folder / ".writable";
  const bool writable = std::ofstream(trial).good();
  fs::remove(trial, error);
  if (!writable) throw InputError("--out " + out + ": nothing can be written there");
  return folder;
}

}  // namespace vcnc
