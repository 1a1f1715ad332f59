#include "apps/reveal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "model/input_error.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// "effects.X.backlash.gap_um" -> "12.0"; a deviation -> "true value of axes.Y.load_kg". The file
/// is one of our own writing (configs/toml_writer.hpp): a key and its value on a line.
std::map<std::string, std::string> keys_of(const fs::path& file) {
  std::map<std::string, std::string> keys;
  std::string section, deviating;
  for (const std::string& line : lines_of(file)) {
    if (line.starts_with('[')) {
      const std::size_t from = line.find_first_not_of('['), to = line.find(']');
      section = line.substr(from, to - from);
      continue;
    }
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('#') || equals == std::string::npos) continue;
    const std::string key = line.substr(0, equals), value = line.substr(equals + 3);
    if (section == "effects.deviation" && key == "key")
      deviating = value.substr(1, value.size() - 2);
    else if (section == "effects.deviation")
      keys["true value of " + deviating] = value;
    else
      keys[section.empty() ? key : section + "." + key] = value;
  }
  return keys;
}

fs::path folder_of(const std::string& run) {
  const fs::path folder = fs::is_directory(run) ? fs::path(run) : fs::path(run).parent_path();
  if (!fs::exists(folder / "machine.toml"))
    throw InputError("--reveal: " + run + ": has no machine.toml next to the recording");
  return folder;
}

}  // namespace

std::string reveal(const std::string& a, const std::string& b) {
  const fs::path left = folder_of(a), right = folder_of(b);
  std::vector<std::array<std::string, 3>> rows;
  const auto compare_keys = [&](const char* file) {
    const auto of_a = keys_of(left / file), of_b = keys_of(right / file);
    std::set<std::string> all;
    for (const auto& [key, value] : of_a) all.insert(key);
    for (const auto& [key, value] : of_b) all.insert(key);
    const auto value = [](const auto& keys, const std::string& key) {
      const auto found = keys.find(key);
      return found == keys.end() ? std::string("-") : found->second;
    };
    for (const std::string& key : all)
      if (value(of_a, key) != value(of_b, key))
        rows.push_back({key, value(of_a, key), value(of_b, key)});
  };
  compare_keys("machine.toml");
  compare_keys("piece.toml");
  std::vector<std::string> of_a = lines_of(left / "faults.txt"),
                           of_b = lines_of(right / "faults.txt");
  for (const std::string& fault : of_a) {
    const auto same = std::find(of_b.begin(), of_b.end(), fault);
    if (same == of_b.end())
      rows.push_back({"fault", fault, "-"});
    else
      of_b.erase(same);
  }
  for (const std::string& fault : of_b) rows.push_back({"fault", "-", fault});

  std::string text = "\nrevealed: what the runs truly were\n";
  if (rows.empty()) return text + "  nothing differs\n";
  std::size_t first = 0, second = std::string("RUN_A").size();
  for (const auto& row : rows) {
    first = std::max(first, row[0].size());
    second = std::max(second, row[1].size());
  }
  text += fmt::format("  {:{}}  {:{}}  {}\n", "", first, "RUN_A", second, "RUN_B");
  for (const auto& row : rows)
    text += fmt::format("  {:{}}  {:{}}  {}\n", row[0], first, row[1], second, row[2]);
  return text;
}

}  // namespace vcnc
