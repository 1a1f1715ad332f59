#include "apps/compare_command.hpp"

#include <iostream>

#include "analysis/compare.hpp"
#include "analysis/compare_page.hpp"
#include "analysis/recording.hpp"
#include "analysis/whole_file.hpp"
#include "apps/node_options.hpp"
#include "apps/page_folder.hpp"
#include "model/input_error.hpp"

namespace vcnc {
namespace {

ComparedRun read(const char* option, const std::string& path) {
  try {
    return read_run(RecordingReader(path), path);
  } catch (const RecordingError& e) {
    throw InputError(std::string(option) + " " + e.what());
  }
}

}  // namespace

int compare_command(const CompareOptions& options) {
  const std::string name = "compare.html";
  const Comparison comparison = compare(read("RUN_A", options.a), read("RUN_B", options.b));
  std::filesystem::path file;
  if (!options.out.empty()) file = page_folder(options.out, name, kCompareMark) / name;
  std::cout << to_text(comparison);
  if (!file.empty()) {
    write_whole_file(file, compare_page(comparison));
    std::cout << "comparison: " << file.string() << '\n';
  }
  return kExitOk;
}

}  // namespace vcnc
