#include "analysis/report.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <sstream>

#include "analysis/curves.hpp"
#include "analysis/plot.hpp"
#include "analysis/session.hpp"
#include "synthetic.hpp"
#include "tests/scratch.hpp"

namespace vcnc::report_test {
namespace {

using synthetic::SyntheticRun;

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::string report_of_a_lap(const Scratch& dir) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.2e-3, [](const Station& st) { return Vec3(6e-6 * st.n); });
  AnalysisSession session({dir.path(), true, false});
  RunBegin begin = synthetic::begin(run.machine(), run.piece().params());
  begin.program_name = "<part> & \"co\".nc";
  session.begin(begin);
  for (const TelemetryRow& row : run.rows()) session.row(row);
  session.end(synthetic::end(std::ssize(run.rows())));
  return content(dir / "report.html");
}

/// Hides gnuplot as long as it lives.
class EmptyPath {
 public:
  EmptyPath() : before_(getenv("PATH")) { setenv("PATH", "/nowhere", 1); }
  ~EmptyPath() { setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_;
};

TEST(Report, IsOneSelfContainedPageWithAllFigures) {
  const Scratch dir;
  const std::string html = report_of_a_lap(dir);
  EXPECT_EQ(html.substr(0, 15), "<!DOCTYPE html>");
  EXPECT_NE(html.find("</html>"), std::string::npos);
  EXPECT_EQ(count(html, "<svg"), 6u) << "five figures and the coverage strip";
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("No figures"), std::string::npos);
  EXPECT_NE(html.find("PASS"), std::string::npos);
  EXPECT_NE(html.find("6.00 µm"), std::string::npos);
  EXPECT_NE(html.find("0123456789abcdef0123456789abcdef"), std::string::npos);
  EXPECT_EQ(html.find("<part>"), std::string::npos);
  EXPECT_NE(html.find("&lt;part&gt; &amp; &quot;co&quot;.nc"), std::string::npos);
}

TEST(Report, SaysSoWhenGnuplotIsMissing) {
  const Scratch dir;
  const EmptyPath hidden;
  const std::string html = report_of_a_lap(dir);
  EXPECT_EQ(count(html, "gnuplot is not installed"), 5u);
  EXPECT_NE(html.find("whole path"), std::string::npos);
}

TEST(Report, RunWithoutScanHasNoErrorFigures) {
  const Scratch dir;
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("ring"));
  for (int k = 0; k < 200; ++k) run.add(AxisVector{}, AxisVector{}, Vec3::Zero());
  AnalysisSession session({dir.path(), true, false});
  RunBegin begin = synthetic::begin(run.machine(), run.piece().params());
  begin.piece_toml.clear();
  session.begin(begin);
  for (const TelemetryRow& row : run.rows()) session.row(row);
  session.end(synthetic::end(200));
  const std::string html = content(dir / "report.html");
  EXPECT_EQ(count(html, "<svg"), 2u) << "following error and bus load";
  EXPECT_NE(html.find("the run has no workpiece"), std::string::npos);
}

TEST(Plot, BadScriptIsNoFigure) {
  std::string why;
  EXPECT_FALSE(draw_svg("set terminal svg\nplot nonsense(\n", why));
  EXPECT_EQ(why, "No figures: gnuplot failed.");
}

TEST(Envelope, KeepsEveryExtremeAndShowsGaps) {
  Envelope e(0, 100, 50);
  for (int i = 0; i <= 4000; ++i) {
    const double x = i * 0.01;
    e.add(x, i == 1234 ? 5 : i == 2001 ? -7 : 0.001 * (i % 10));
  }
  for (int i = 8000; i <= 10000; ++i) e.add(i * 0.01, 1);
  const auto points = e.points();
  EXPECT_LE(points.size(), 100u);
  double high = 0, low = 0, x_before = -1;
  int gaps = 0;
  for (const Envelope::Point& p : points) {
    high = std::max(high, p.y);
    low = std::min(low, p.y);
    gaps += p.starts;
    EXPECT_GT(p.x, x_before);
    x_before = p.x;
  }
  EXPECT_EQ(high, 5);
  EXPECT_EQ(low, -7);
  EXPECT_EQ(gaps, 2);  // the beginning and the hole
}

}  // namespace
}  // namespace vcnc::report_test
