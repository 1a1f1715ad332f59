#include "apps/compare_command.hpp"

#include <iostream>
#include <utility>

#include "analysis/compare.hpp"
#include "analysis/compare_page.hpp"
#include "analysis/recording.hpp"
#include "analysis/whole_file.hpp"
#include "apps/node_options.hpp"
#include "apps/page_folder.hpp"
#include "apps/reveal.hpp"
#include "apps/stop_signal.hpp"
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

int interrupted() {
  std::cerr << "vcnc: compare: stopped, nothing was written\n";
  return kExitInterrupted;
}

}  // namespace

int compare_command(const CompareOptions& options) {
  const std::string name = "compare.html";
  catch_stop_signals();
  ComparedRun a = read("RUN_A", options.a);
  if (stop_requested()) return interrupted();
  ComparedRun b = read("RUN_B", options.b);
  if (stop_requested()) return interrupted();
  const Comparison comparison = compare(std::move(a), std::move(b));
  if (stop_requested()) return interrupted();
  std::filesystem::path file;
  if (!options.out.empty()) file = page_folder(options.out, name, kCompareMark) / name;
  const std::string truth = options.reveal ? reveal(options.a, options.b) : "";
  std::cout << to_text(comparison) << truth;
  if (!file.empty()) {
    write_whole_file(file, compare_page(comparison));
    std::cout << "comparison: " << file.string() << '\n';
  }
  return kExitOk;
}

}  // namespace vcnc
