#include "diagnosis/verdict.hpp"

#include <gtest/gtest.h>

namespace vcnc {
namespace {

using enum DiagnosisVerdict;

/// A run that shows everything, in which nothing is off.
VerdictGrounds quiet() { return {.held_out_samples = 10'000, .excited = true}; }

/// One effect that explains all there was.
VerdictGrounds all_by_one() {
  VerdictGrounds g = quiet();
  g.named = true;
  g.explained_share = 1;
  return g;
}

TEST(Verdict, NothingOffIsNoDeviation) { EXPECT_EQ(verdict_of(quiet()), no_deviation); }

TEST(Verdict, AMachineThatIsOffAndHasNoNameIsUnexplained) {
  VerdictGrounds g = quiet();
  g.ratio = 1.06;
  EXPECT_EQ(verdict_of(g), unexplained);
  g = quiet();
  g.still_off = true;  // one signal, where the sum over all tells nothing
  EXPECT_EQ(verdict_of(g), unexplained);
}

TEST(Verdict, WhatShowsNothingCannotTellUnlessSomethingIsOff) {
  VerdictGrounds g = quiet();
  g.excited = false;
  EXPECT_EQ(verdict_of(g), not_identifiable);
  g.ratio = 2;
  EXPECT_EQ(verdict_of(g), unexplained);
  g = all_by_one();
  g.held_out_samples = 199;
  EXPECT_EQ(verdict_of(g), not_identifiable);
}

TEST(Verdict, AnEffectThatLeavesNothingExplains) {
  EXPECT_EQ(verdict_of(all_by_one()), explained);
  VerdictGrounds g = all_by_one();
  g.ratio = 1.004;  // noise to half a percent, however little there was
  g.explained_share = 0.3;
  EXPECT_EQ(verdict_of(g), explained);
  g.ratio = 100;  // a fault of ten thousand times the noise, 99 % of it explained
  g.explained_share = 0.99;
  EXPECT_EQ(verdict_of(g), explained);
}

TEST(Verdict, BetweenNoiseAndWhatIsLeftManyNamesAreNoExplanation) {
  VerdictGrounds g = all_by_one();
  g.ratio = 1.04;
  g.explained_share = 0.95;
  EXPECT_EQ(verdict_of(g), explained);
  g.few_effects = false;
  EXPECT_EQ(verdict_of(g), partly);
  g.few_effects = true;
  g.explained_share = 0.85;
  EXPECT_EQ(verdict_of(g), partly);
  g.chatter_named = true;
  EXPECT_EQ(verdict_of(g), explained);
}

TEST(Verdict, ASignalMadeWorseOrStillOffIsPartly) {
  for (bool VerdictGrounds::*spoils : {&VerdictGrounds::made_worse, &VerdictGrounds::still_off}) {
    VerdictGrounds g = all_by_one();
    g.*spoils = true;
    EXPECT_EQ(verdict_of(g), partly);
  }
}

TEST(Verdict, WhatHasNoNameIsNeverExplained) {
  for (bool VerdictGrounds::*nameless : {&VerdictGrounds::law, &VerdictGrounds::vibrates}) {
    VerdictGrounds g = all_by_one();
    g.*nameless = true;
    EXPECT_EQ(verdict_of(g), partly);
    g.named = false;
    EXPECT_EQ(verdict_of(g), unexplained);
  }
}

TEST(Verdict, ASearchThatWasStoppedSaysNothingElse) {
  for (VerdictGrounds g : {quiet(), all_by_one(), VerdictGrounds{}}) {
    g.interrupted = true;
    EXPECT_EQ(verdict_of(g), interrupted);
  }
}

}  // namespace
}  // namespace vcnc
