#include "analysis/session.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "synthetic.hpp"
#include "tests/scratch.hpp"

namespace vcnc::session_test {
namespace {

using synthetic::SyntheticRun;

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

SyntheticRun wavy_lap() {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.2e-3,
          [](const Station& st) { return Vec3(7e-6 * std::sin(st.s / 5e-3) * st.n); });
  return run;
}

void play(const SyntheticRun& run, const std::vector<TelemetryRow>& rows, TelemetrySink& sink,
          bool to_the_end = true) {
  sink.begin(synthetic::begin(run.machine(), run.piece().params()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (k == 500) sink.alarm({500, 3, "drive Y", "following error"});
    sink.row(rows[k]);
  }
  if (to_the_end) sink.end(synthetic::end(std::ssize(rows)));
}

TEST(AnalysisSession, AnalysisOfTheRecordingGivesTheSameBits) {
  const Scratch dir;
  SyntheticRun run = wavy_lap();
  AnalysisSession session({dir.path(), false, true});
  play(run, run.rows(), session);
  ASSERT_TRUE(session.summary());
  const std::string live = content(dir / "summary.json");
  EXPECT_EQ(live, to_json(*session.summary()));
  EXPECT_EQ(live, to_json(analyze(RecordingReader(dir.path()))));
  EXPECT_TRUE(std::filesystem::exists(dir / "rows.csv"));
}

TEST(AnalysisSession, SummaryHoldsTheKeysAndTheirValues) {
  const Scratch dir;
  SyntheticRun run = wavy_lap();
  AnalysisSession session({dir.path(), false, false});
  play(run, run.rows(), session);
  const auto json = nlohmann::json::parse(content(dir / "summary.json"));
  EXPECT_EQ(json["trace_hash"], "0123456789abcdef0123456789abcdef");
  EXPECT_EQ(json["cycles"], run.rows().size());
  EXPECT_DOUBLE_EQ(json["real_time_factor"], static_cast<double>(run.rows().size()) * 1e-3 / 0.5);
  EXPECT_EQ(json["bus_load_worst"], 0.75);
  EXPECT_EQ(json["gaps"], 0);
  EXPECT_NEAR(json["e_n_um"]["max"], 7, 0.01);
  EXPECT_NEAR(json["e_n_um"]["min"], -7, 0.01);
  EXPECT_NEAR(json["e_rest_um"]["rms"], 7 / std::sqrt(2), 0.1);
  EXPECT_NEAR(json["e_plan_um"]["max"], 0, 1e-3);
  EXPECT_NEAR(json["e_servo_um"]["max"], 0, 1e-3);
  EXPECT_EQ(json["coverage"]["percent"], 100.0);
  EXPECT_EQ(json["coverage"]["bins_ok"], json["coverage"]["bins"]);
  EXPECT_EQ(json["verdict"], "PASS");
  EXPECT_EQ(json["tolerance_um"], 50.0);
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["reason"], "program end");
  EXPECT_EQ(json["alarms"][0]["source"], "drive Y");
  EXPECT_TRUE(json["following_error"].contains("C"));
  EXPECT_TRUE(json["warnings"].empty());
  EXPECT_FALSE(std::filesystem::exists(dir / "rows.csv"));
}

TEST(AnalysisSession, InterruptedRunIsAnalysedUpToThere) {
  const Scratch dir;
  SyntheticRun run = wavy_lap();
  {
    AnalysisSession session({dir.path(), false, false});
    play(run, run.rows(), session, false);
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "summary.json"));
  const RecordingReader reader(dir.path());
  EXPECT_EQ(reader.rows(), run.rows().size());
  const Summary summary = analyze(reader);
  EXPECT_FALSE(summary.end.complete);
  EXPECT_EQ(summary.end.reason, "interrupted");
  EXPECT_EQ(summary.coverage_percent, 100.0);
}

TEST(AnalysisSession, SnapshotFollowsTheRun) {
  const Scratch dir;
  SyntheticRun run = wavy_lap();
  AnalysisSession session({dir.path(), false, false});
  session.begin(synthetic::begin(run.machine(), run.piece().params()));
  const std::size_t half = run.rows().size() / 2;
  for (std::size_t k = 0; k < half; ++k) session.row(run.rows()[k]);
  const LiveView view = session.snapshot();
  EXPECT_DOUBLE_EQ(view.t, static_cast<double>(half - 1) * 1e-3);
  EXPECT_TRUE(view.on_path);
  EXPECT_NEAR(view.e_n_max, 7e-6, 1e-8);
  EXPECT_NEAR(view.coverage_percent, 50, 3);
  EXPECT_FALSE(view.failed);
}

TEST(AnalysisSession, TextNamesVerdictAndFigures) {
  const Scratch dir;
  SyntheticRun run = wavy_lap();
  AnalysisSession session({dir.path(), false, false});
  play(run, run.rows(), session);
  const std::string text = to_text(*session.summary());
  EXPECT_EQ(text.substr(0, 6), "PASS  ");
  for (const char* part :
       {"e_n", "e_servo", "coverage 100.0 %", "following error", "drive Y", "trace"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(AnalysisSession, UnusableFolderIsOneClearError) {
  const Scratch dir;
  std::ofstream(dir / "file") << "x";
  EXPECT_THROW(AnalysisSession({dir / "file/run", false, false}), std::runtime_error);
}

}  // namespace
}  // namespace vcnc::session_test
