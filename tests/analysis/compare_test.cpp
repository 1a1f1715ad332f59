// Comparisons of imagined runs whose differences are known.
#include "analysis/compare.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "analysis/compare_page.hpp"
#include "analysis/session.hpp"
#include "synthetic.hpp"
#include "tests/scratch.hpp"

namespace vcnc::compare_test {
namespace {

using synthetic::SyntheticRun;

/// A lap of the S piece with the tool tip off along the normal, recorded and read again.
ComparedRun lap(const Scratch& dir, const std::string& name, double off, double z = 20e-3,
                const Machine& machine = synthetic::machine(), double force = 0.1) {
  SyntheticRun run(machine, synthetic::piece_params("s_eq1"));
  run.lap(z, 0.2e-3, [&](const Station& st) { return Vec3(off * st.n); });
  AnalysisSession session({dir / name, false, false});
  session.begin(synthetic::begin(run.machine(), run.piece().params()));
  for (TelemetryRow row : run.rows()) {
    row.force[kY] = force;
    session.row(row);
  }
  session.end(synthetic::end(std::ssize(run.rows())));
  return read_run(RecordingReader(dir / name), name);
}

bool says(const Comparison& c, const std::string& part) {
  return std::any_of(c.not_comparable.begin(), c.not_comparable.end(),
                     [&](const std::string& s) { return s.find(part) != s.npos; });
}

TEST(Compare, AKnownOffsetIsTheDifferenceAtEveryStation) {
  const Scratch dir;
  const Comparison c =
      compare(lap(dir, "a", 2e-6), lap(dir, "b", 7e-6, 20e-3, synthetic::machine(), 0.3));
  EXPECT_TRUE(c.same_line);
  EXPECT_TRUE(c.same_motion);
  EXPECT_TRUE(c.not_comparable.empty());
  const double length = c.a.summary.line_length;
  EXPECT_NEAR(static_cast<double>(c.e_n_difference.size()) * kProfileBin, length, 1e-3);
  for (const double d : c.e_n_difference.y) EXPECT_NEAR(d, 5e-6, 1e-9);
  EXPECT_NEAR(c.b.force[kY].rms(), 0.3, 1e-9);
  const std::string text = to_text(c);
  EXPECT_NE(text.find("B-A: mean 5.00, rms 5.00, largest 5.00 um"), std::string::npos) << text;
  EXPECT_NE(text.find("force Y"), std::string::npos);
}

TEST(Compare, ARunAgainstItselfIsEqualThroughout) {
  const Scratch dir;
  const ComparedRun run = lap(dir, "a", 2e-6);
  const Comparison c = compare(run, run);
  EXPECT_TRUE(c.same_trace);
  EXPECT_TRUE(c.same_motion);
  EXPECT_TRUE(c.machine.empty());
  EXPECT_TRUE(c.piece.empty());
  EXPECT_EQ(max_abs(c.e_n_difference), 0);
  EXPECT_NE(to_text(c).find("declared machines: equal"), std::string::npos);
}

TEST(Compare, DeclaredMachinesKeyByKey) {
  const Scratch dir;
  Machine other = synthetic::machine();
  other.axes[kY].servo.kv_per_s = 38;
  other.setup.tolerance = 25e-6;
  const Comparison c = compare(lap(dir, "a", 0), lap(dir, "b", 0, 20e-3, other));
  ASSERT_EQ(c.machine.size(), 2u);
  EXPECT_EQ(c.machine[0].key, "axes.Y.kv_per_s");
  EXPECT_EQ(c.machine[0].a, "40.0");
  EXPECT_EQ(c.machine[0].b, "38.0");
  EXPECT_EQ(c.machine[1].key, "setup.tolerance_um");
  EXPECT_TRUE(c.same_line) << "the declaration does not decide on what is measured";
}

TEST(Compare, KeysThatOnlyOneHas) {
  const auto keys = differing_keys("name = \"x\"\n[t]\na = 1.0\n", "name = \"x\"\n[t]\nb = 2.0\n");
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(keys[0].key, "t.a");
  EXPECT_EQ(keys[0].b, "");
  EXPECT_EQ(keys[1].key, "t.b");
  EXPECT_EQ(keys[1].a, "");
  EXPECT_EQ(keys[1].b, "2.0");
}

TEST(Compare, KeysOfListsAreComparedOneByOne) {
  const std::string text = "[[list]]\nkey = 1\n[[list]]\nkey = 2\n";
  EXPECT_TRUE(differing_keys(text, text).empty());
  const auto keys = differing_keys(text, "[[list]]\nkey = 1\n[[list]]\nkey = 3\n");
  ASSERT_EQ(keys.size(), 1u);
  EXPECT_EQ(keys[0].key, "list[1].key");
}

TEST(Compare, OtherHeightsOfTheScanLineAreSaid) {
  const Scratch dir;
  const Comparison c = compare(lap(dir, "a", 1e-6), lap(dir, "b", 1e-6, 25e-3));
  EXPECT_FALSE(c.same_line);
  EXPECT_FALSE(c.same_motion);
  EXPECT_EQ(c.e_n_difference.size(), 0u);
  EXPECT_TRUE(says(c, "the scan lines differ"));
  EXPECT_TRUE(says(c, "the commanded motions differ"));
  EXPECT_NE(to_text(c).find("cannot be compared:"), std::string::npos);
}

TEST(Compare, OtherPieceOrNoneOrAnInterruptedRun) {
  const Scratch dir;
  SyntheticRun ring(synthetic::machine(), synthetic::piece_params("ring"));
  for (int k = 0; k < 200; ++k) ring.add(AxisVector{}, AxisVector{}, Vec3::Zero());
  {
    AnalysisSession session({dir / "ring", false, false});
    session.begin(synthetic::begin(ring.machine(), ring.piece().params()));
    for (const TelemetryRow& row : ring.rows()) session.row(row);
  }  // never ended
  const ComparedRun cut = read_run(RecordingReader(dir / "ring"), "ring");
  const Comparison c = compare(lap(dir, "a", 0), cut);
  EXPECT_TRUE(says(c, "run B measured nothing"));
  EXPECT_TRUE(says(c, "run B ended early (interrupted)"));
  EXPECT_TRUE(says(c, "Trace hash"));
  EXPECT_FALSE(c.piece.empty());
  EXPECT_NE(to_text(c).find("pieces differ:"), std::string::npos);
}

TEST(Compare, PageIsSelfContainedAndEscaped) {
  const Scratch dir;
  ComparedRun a = lap(dir, "a", 0), b = lap(dir, "b", 5e-6);
  a.name = "<a>&";
  const std::string page = compare_page(compare(a, b));
  EXPECT_EQ(page.substr(0, 15), "<!DOCTYPE html>");
  EXPECT_NE(page.find(kCompareMark), std::string::npos);
  EXPECT_NE(page.find("&lt;a&gt;&amp;"), std::string::npos);
  EXPECT_EQ(page.find("<a>&"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos);
  std::size_t figures = 0;
  for (auto at = page.find("<svg"); at != page.npos; at = page.find("<svg", at + 1)) ++figures;
  EXPECT_EQ(figures, 2u);
}

}  // namespace
}  // namespace vcnc::compare_test
