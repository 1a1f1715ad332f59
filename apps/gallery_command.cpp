#include "apps/gallery_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <thread>

#include "analysis/plot.hpp"
#include "analysis/whole_file.hpp"
#include "apps/gallery_page.hpp"
#include "apps/node_options.hpp"
#include "apps/page_folder.hpp"
#include "apps/progress_line.hpp"
#include "apps/stop_signal.hpp"
#include "configs/config.hpp"

namespace vcnc {
namespace {

namespace fs = std::filesystem;

std::vector<std::string_view> chosen_effects(const std::vector<std::string>& only,
                                             const Machine& machine) {
  for (const std::string& name : only) {
    try {
      demonstration(name, machine);
    } catch (const std::invalid_argument& e) {
      throw InputError(std::string("--only ") + e.what());
    }
  }
  std::vector<std::string_view> names;
  for (const EffectText* text : all_effect_texts())
    if (only.empty() || std::find(only.begin(), only.end(), text->name) != only.end())
      names.push_back(text->name);
  return names;
}

/// All entries, made by several threads; in the order of the names.
std::vector<GalleryEntry> make_entries(const std::vector<std::string_view>& names,
                                       const Machine& machine, bool draw) {
  std::vector<GalleryEntry> entries(names.size());
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  ProgressLine progress;
  const auto work = [&] {
    for (std::size_t i = next++; i < names.size() && !stop_requested(); i = next++) {
      try {
        entries[i] = gallery_entry(names[i], machine, draw);
      } catch (const std::exception& e) {
        const std::lock_guard lock(mutex);
        if (!failure)
          failure = std::make_exception_ptr(
              std::runtime_error(fmt::format("gallery: {}: {}", names[i], e.what())));
        next = names.size();
        return;
      }
      const std::lock_guard lock(mutex);
      ++done;
      progress.show(fmt::format("{} of {} effects: {}", done, names.size(), names[i]));
    }
  };
  const std::size_t workers = std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1,
                                                      std::max<std::size_t>(names.size(), 1));
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < workers; ++i) threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return entries;
}

}  // namespace

int gallery_command(const GalleryOptions& options) {
  const Machine machine =
      options.machine.empty() ? ideal_machine() : declared(load_machine(options.machine));
  const std::vector<std::string_view> names = chosen_effects(options.only, machine);
  const fs::path folder = page_folder(options.out, "index.html", kGalleryMark);
  std::string why;
  const bool draw = draw_svg("set terminal svg\nplot 0\n", why).has_value();
  if (!draw) std::cerr << "vcnc: gallery: " << why << " The page has numbers and texts only.\n";
  catch_stop_signals();
  const std::vector<GalleryEntry> entries = make_entries(names, machine, draw);
  if (stop_requested()) {
    std::cerr << "vcnc: gallery: stopped, nothing was written\n";
    std::error_code ignored;
    fs::remove(folder, ignored);  // only if it is empty
    return kExitInterrupted;
  }
  write_whole_file(folder / "index.html", gallery_page(entries, machine, why));
  for (const GalleryEntry& entry : entries)
    std::cout << fmt::format("{:<22} {}\n", entry.demonstration.text->name,
                             !entry.trouble.empty()   ? entry.trouble
                             : entry.readings.empty() ? "-"
                                                      : entry.readings.front().name + " " +
                                                            entry.readings.front().value);
  std::cout << "gallery: " << (folder / "index.html").string() << '\n';
  return kExitOk;
}

}  // namespace vcnc
