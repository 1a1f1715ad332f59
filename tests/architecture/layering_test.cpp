// The architecture as a test: who may include whom, and what is banned where.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Source {
  std::string path;    ///< relative to the project, for example "bus/pacer.cpp"
  std::string folder;  ///< first part of it
  std::string text;    ///< without comments
};

std::string without_comments(const std::string& text) {
  static const std::regex comment(R"(//[^\n]*|/\*[\s\S]*?\*/)");
  return std::regex_replace(text, comment, "");
}

const std::vector<std::string> kFolders{"model",      "configs",   "bus",
                                        "controller", "servo_sim", "probe_sim",
                                        "analysis",   "diagnosis", "apps"};

std::vector<Source> sources(const std::vector<std::string>& folders = kFolders) {
  std::vector<Source> all;
  const fs::path root(VCNC_SOURCE_DIR);
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cpp" && extension != ".hpp") continue;
      std::ifstream in(entry.path());
      const std::string text((std::istreambuf_iterator<char>(in)), {});
      all.push_back({fs::relative(entry.path(), root).string(), folder, without_comments(text)});
    }
  }
  return all;
}

std::set<std::string> includes(const Source& source) {
  static const std::regex include(R"re(#include\s*[<"]([^>"]+)[>"])re");
  std::set<std::string> found;
  for (std::sregex_iterator i(source.text.begin(), source.text.end(), include), end; i != end; ++i)
    found.insert((*i)[1]);
  return found;
}

TEST(Layering, DependenciesPointOneWay) {
  const std::map<std::string, std::set<std::string>> allowed{
      {"model", {}},
      {"configs", {"model"}},
      {"bus", {}},
      {"controller", {"model", "bus"}},
      {"servo_sim", {"model", "bus"}},
      {"probe_sim", {"model", "bus"}},
      {"analysis", {"model", "bus", "configs"}},
      {"diagnosis", {"model", "bus", "configs", "analysis"}},
      {"apps",
       {"model", "configs", "bus", "controller", "servo_sim", "probe_sim", "analysis",
        "diagnosis"}}};
  std::size_t checked = 0;
  for (const Source& source : sources()) {
    for (const std::string& header : includes(source)) {
      const std::string target = header.substr(0, header.find('/'));
      if (header.find('/') == std::string::npos || target == source.folder) continue;
      if (std::find(kFolders.begin(), kFolders.end(), target) == kFolders.end()) continue;
      ++checked;
      EXPECT_TRUE(allowed.at(source.folder).contains(target))
          << source.path << " includes " << header;
    }
  }
  EXPECT_GT(checked, 50u);
}

/// A folder of the diagnosis takes from those before it, and what all of them share.
TEST(Layering, TheDiagnosisIsBuiltFromItsRecordsUp) {
  const std::vector<std::string> order{
      "records",   "candidates", "replica",   "evidence", "fit",           "beforehand", "healthy",
      "screening", "laws",       "selection", "report",   "commissioning", "findings"};
  const std::set<std::string> shared{"diagnosis.hpp", "diagnosis_options.hpp", "diagnosis_case.hpp",
                                     "parallel.hpp", "verdict.hpp"};
  const auto rank = [&](const std::string& folder) {
    return std::find(order.begin(), order.end(), folder) - order.begin();
  };
  static const std::regex of_diagnosis(R"(diagnosis/(?:(\w+)/)?(\w+\.hpp))");
  std::set<std::string> seen;
  for (const Source& source : sources({"diagnosis"})) {
    const fs::path folder = fs::path(source.path).parent_path();
    if (folder == "diagnosis") continue;  // what is made of all of them
    seen.insert(folder.filename());
    for (const std::string& header : includes(source)) {
      std::smatch parts;
      if (!std::regex_match(header, parts, of_diagnosis)) continue;
      if (parts[1].matched)
        EXPECT_LE(rank(parts[1]), rank(folder.filename())) << source.path << " includes " << header;
      else
        EXPECT_TRUE(shared.contains(parts[2])) << source.path << " includes " << header;
    }
  }
  EXPECT_EQ(seen, std::set<std::string>(order.begin(), order.end()));
}

TEST(Layering, OnlySimulatorsSeeTheGroundTruth) {
  for (const Source& source : sources()) {
    const bool may = source.folder == "servo_sim" || source.folder == "probe_sim" ||
                     source.path.starts_with("bus/truth") || source.path == "apps/drive_main.cpp" ||
                     source.path == "apps/probe_main.cpp" ||
                     source.path.starts_with("apps/virtual_machine");
    if (may) continue;
    EXPECT_FALSE(includes(source).contains("bus/truth.hpp")) << source.path;
  }
}

/// A pattern that may only appear in the places named.
struct Ban {
  const char* what;
  std::regex pattern;
  std::function<bool(const Source&)> applies;
};

TEST(Layering, BannedConstructs) {
  const auto everywhere = [](const Source&) { return true; };
  const auto cyclic = [](const Source& s) {
    return s.folder != "apps" && s.folder != "configs" && s.folder != "analysis" &&
           s.folder != "diagnosis";
  };
  const std::vector<Ban> bans{
      {"a wall clock outside the pacer",
       std::regex(
           R"((steady_clock|system_clock|high_resolution_clock)\s*::|\bclock_gettime\b|\bgettimeofday\b|\bstd::time\b)"),
       [](const Source& s) { return !s.path.starts_with("bus/pacer"); }},
      {"a sleep outside the pacer",
       std::regex(R"(\bsleep_for\b|\bsleep_until\b|\bnanosleep\b|\busleep\b)"),
       [](const Source& s) { return !s.path.starts_with("bus/pacer"); }},
      {"a socket outside the transports", std::regex(R"(sys/socket\.h|sys/un\.h|linux/can)"),
       [](const Source& s) { return s.folder != "bus"; }},
      {"a distribution whose numbers differ between libraries",
       std::regex(R"(std::\w+_distribution)"), everywhere},
      {"an engine seeded from outside", std::regex(R"(random_device|\brand\(\))"), everywhere},
      {"unordered iteration in cyclic code", std::regex(R"(unordered_(map|set))"), cyclic},
      {"DDS outside bus/dds", std::regex(R"(dds/dds\.h)"),
       [](const Source& s) { return !s.path.starts_with("bus/dds/"); }},
      {"HDF5 outside the recording", std::regex(R"(hdf5\.h)"),
       [](const Source& s) { return s.path != "analysis/hdf5_file.hpp"; }},
      {"printing from a library", std::regex(R"(std::(cout|cerr)\b|\bprintf\()"),
       [](const Source& s) { return s.folder != "apps"; }},
      {"a file or a thread in the model", std::regex(R"(<fstream>|<thread>|<mutex>|<filesystem>)"),
       [](const Source& s) {
         return s.folder == "model" || s.folder == "servo_sim" || s.folder == "probe_sim";
       }},
  };
  for (const Source& source : sources()) {
    for (const Ban& ban : bans) {
      if (!ban.applies(source)) continue;
      EXPECT_FALSE(std::regex_search(source.text, ban.pattern)) << source.path << ": " << ban.what;
    }
  }
}

TEST(Layering, HeavyHeadersStayInOneSourceFile) {
  const std::map<std::string, std::size_t> limit{
      {"toml++/toml.h", 1}, {"CLI/CLI.hpp", 3}, {"nlohmann/json.hpp", 2}, {"hdf5.h", 1}};
  std::map<std::string, std::set<std::string>> users;
  for (const Source& source : sources())
    for (const std::string& header : includes(source)) users[header].insert(source.path);
  for (const auto& [header, most] : limit) EXPECT_LE(users[header].size(), most) << header;
}

/// Two types of one name in one program are undefined behaviour that no compiler reports.
TEST(Layering, EveryTypeInAHeaderHasANameOfItsOwn) {
  static const std::regex type(R"((?:^|\n)(?:struct|class|enum class) (\w+)[^;\n]*\{)");
  std::map<std::string, std::string> owner;
  for (const Source& source : sources()) {
    if (!source.path.ends_with(".hpp")) continue;
    for (std::sregex_iterator i(source.text.begin(), source.text.end(), type), end; i != end; ++i) {
      const auto [known, fresh] = owner.emplace((*i)[1], source.path);
      EXPECT_TRUE(fresh || known->second == source.path)
          << (*i)[1] << " is in " << known->second << " and in " << source.path;
    }
  }
  EXPECT_GT(owner.size(), 80u);
}

/// Tests run side by side: a file with a name of one's own choosing is another test's, too.
TEST(Tests, TakeTheirFilesFromScratch) {
  static const std::regex own(R"re(temp_directory_path|mkdtemp|tmpnam|TempDir\(|"/tmp)re");
  std::size_t checked = 0;
  for (const Source& source : sources({"tests"})) {
    if (source.path == "tests/scratch.hpp" || source.path.starts_with("tests/architecture/") ||
        source.path.starts_with("tests/bench/") || source.path.starts_with("tests/fuzz/"))
      continue;
    ++checked;
    EXPECT_FALSE(std::regex_search(source.text, own)) << source.path;
  }
  EXPECT_GT(checked, 100u);
}

TEST(Layering, MainsAreShort) {
  for (const Source& source : sources()) {
    if (!source.path.ends_with("_main.cpp")) continue;
    const auto lines = std::count(source.text.begin(), source.text.end(), '\n');
    EXPECT_LE(lines, 60) << source.path;
  }
}

}  // namespace
