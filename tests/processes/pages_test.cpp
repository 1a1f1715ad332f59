// `vcnc gallery` and `vcnc compare` as their users start them.
#include <gtest/gtest.h>

#include "tests/processes/shell.hpp"

namespace vcnc::pages_test {
namespace {

class Pages : public testing::Test {
 protected:
  Said vcnc(const std::string& arguments) { return shell(scratch_, bin("vcnc") + " " + arguments); }
  /// A run in the air of a given feed.
  void run(const std::string& name, const std::string& options, int feed = 1500) {
    write_text(scratch_ / (name + ".ngc"),
               "G54 G90 G21 G94\nG64 P0.01\nM19\nG1 X8 F" + std::to_string(feed) + "\nM30\n");
    const Said said = vcnc("run " + (scratch_ / (name + ".ngc")) + " --machine " +
                           configs("machines/trunnion.toml") + " --in-process --no-report --out " +
                           (scratch_ / name) + " " + options);
    ASSERT_EQ(said.code, 0) << said.err;
  }
  /// What is refused has one sentence, exit code 2 and leaves nothing behind.
  void expect_refused(const std::string& arguments, const std::string& sentence) {
    const Said said = vcnc(arguments);
    EXPECT_EQ(said.code, 2) << arguments;
    EXPECT_NE(said.err.find(sentence), std::string::npos) << arguments << "\n" << said.err;
    EXPECT_EQ(said.err.find('\n'), said.err.size() - 1) << "one line: " << said.err;
  }

  Scratch scratch_;
};

TEST_F(Pages, GalleryOfOneEffectIsASelfContainedPageWithItsFigureAndNumber) {
  const std::string out = scratch_ / "gallery";
  for (int i = 0; i < 2; ++i) {  // the second replaces the first
    const Said said = vcnc("gallery --only backlash --out " + out);
    ASSERT_EQ(said.code, 0) << said.err;
    EXPECT_NE(said.out.find("step at the reversal"), std::string::npos) << said.out;
    EXPECT_NE(said.out.find(out + "/index.html"), std::string::npos) << said.out;
    EXPECT_EQ(said.err, "");
  }
  const std::string page = read_text(out + "/index.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("id=\"backlash\""), std::string::npos);
  EXPECT_EQ(page.find("id=\"coulomb\""), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos);
}

TEST_F(Pages, GalleryWithoutGnuplotSaysSoAndHasThePageWithoutPictures) {
  const Said said = shell(scratch_, "PATH=/nowhere " + bin("vcnc") +
                                        " gallery --only backlash --out " + (scratch_ / "bare"));
  EXPECT_EQ(said.code, 0);
  EXPECT_NE(said.err.find("gnuplot is not installed"), std::string::npos) << said.err;
  const std::string page = read_text(scratch_ / "bare/index.html");
  EXPECT_EQ(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("gnuplot is not installed"), std::string::npos);
  EXPECT_NE(page.find("step at the reversal"), std::string::npos);
}

TEST_F(Pages, GalleryRefusesWhatItMustNot) {
  fs::create_directory(scratch_ / "mine");
  write_text(scratch_ / "mine/index.html", "<!DOCTYPE html>\nmy own page\n");
  write_text(scratch_ / "file", "x");
  const std::string only = "gallery --only backlash --out ";
  expect_refused(only + (scratch_ / "mine"),
                 "--out " + (scratch_ / "mine") + ": holds other files");
  expect_refused(only + (scratch_ / "file"), "is not a folder");
  expect_refused("gallery --only baklash --out " + (scratch_ / "new"),
                 "--only baklash: there is no such effect; did you mean backlash?");
  expect_refused(only + (scratch_ / "new") + " --machine " + (scratch_ / "none.toml"), "none.toml");
  EXPECT_FALSE(fs::exists(scratch_ / "new"));
  EXPECT_EQ(read_text(scratch_ / "mine/index.html"), "<!DOCTYPE html>\nmy own page\n");
}

TEST_F(Pages, CompareShowsWhatDiffersAndWhatIsEqual) {
  run("a", "");
  run("b", "--set axes.X.velocity_ff=0.9");
  const Said same = vcnc("compare " + (scratch_ / "a") + " " + (scratch_ / "a"));
  ASSERT_EQ(same.code, 0) << same.err;
  EXPECT_NE(same.out.find("commanded motion: equal;  trace hash: equal"), std::string::npos)
      << same.out;
  EXPECT_NE(same.out.find("declared machines: equal"), std::string::npos) << same.out;

  const Said other = vcnc("compare " + (scratch_ / "a") + " " + (scratch_ / "b/recording.h5") +
                          " --out " + (scratch_ / "page"));
  ASSERT_EQ(other.code, 0) << other.err;
  EXPECT_NE(other.out.find("commanded motion: equal;  trace hash: differs"), std::string::npos)
      << other.out;
  EXPECT_NE(other.out.find("axes.X.velocity_ff  A 1.0   B 0.9"), std::string::npos) << other.out;
  EXPECT_NE(other.out.find("measured nothing on a piece"), std::string::npos) << other.out;
  const std::string page = read_text(scratch_ / "page/compare.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("axes.X.velocity_ff"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos);
}

TEST_F(Pages, CompareOfDifferentProgramsSaysWhatItCannot) {
  run("slow", "");
  run("fast", "", 3000);
  const Said said = vcnc("compare " + (scratch_ / "slow") + " " + (scratch_ / "fast"));
  ASSERT_EQ(said.code, 0) << said.err;
  EXPECT_NE(said.out.find("the commanded motions differ"), std::string::npos) << said.out;
  EXPECT_NE(said.out.find("force X"), std::string::npos) << "the rest is compared";
}

TEST_F(Pages, CompareRefusesWhatIsNoRun) {
  run("a", "");
  write_text(scratch_ / "text.h5", "not a recording");
  const std::string a = scratch_ / "a";
  expect_refused("compare " + a + " " + (scratch_ / "none"), "RUN_B " + (scratch_ / "none"));
  expect_refused("compare " + (scratch_ / "text.h5") + " " + a, "RUN_A " + (scratch_ / "text.h5"));
  expect_refused("compare " + a + " " + a + " --out " + a, "--out " + a + ": holds other files");
}

}  // namespace
}  // namespace vcnc::pages_test
