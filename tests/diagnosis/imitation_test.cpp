// What is missing still is not taken for a finer law of what is there.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "recorded_run.hpp"

namespace vcnc::imitation_test {
namespace {

/// Circles one way, several laps of them.
Experiment laps_of_a_circle(int laps) {
  Experiment e = experiment(Showing::circle, kX, ideal_machine(), {.feed_mm_min = 2700});
  std::istringstream lines(e.program);
  std::string line, all;
  for (int number = 1; std::getline(lines, line); ++number)
    for (int i = 0; i < (number == e.passes.front().first_line ? laps : 1); ++i) all += line + "\n";
  e.program = all;
  return e;
}

/// Some of what play does a friction that builds up over a speed does, too; where it builds up over
/// none, it is dry friction. And the first of three laps still rattles from what came before it,
/// which is no noise of the others.
TEST(Imitation, FrictionBesidePlayIsDryFriction) {
  Machine truth;
  move_number(truth, "effects.X.backlash.gap_um", 8);
  move_number(truth, "effects.X.coulomb.level_N", 40);
  move_number(truth, "effects.probe.adc_noise.noise_mV", 2);
  RecordedRun run = recorded_run(laps_of_a_circle(3), truth.effects);
  run.declared.effects = {};
  MachineReplica replica = run.replica();
  std::vector<Candidate> some = candidates(run.declared);
  std::erase_if(some, [](const Candidate& c) {
    return c.place != "X" ||
           !std::set<std::string>{"backlash", "coulomb", "grease_drag"}.contains(c.effect);
  });
  const Diagnosis d = diagnose({run.record, replica, run.declared, some});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  EXPECT_EQ(d.effects.size(), 2U);
  EXPECT_NEAR(number_of(d.found, "effects.X.backlash.gap_um"), 8, 0.2);
  for (const FoundEffect& e : d.effects)
    for (const FittedNumber& n : e.numbers)
      EXPECT_TRUE(n.low < number_of(truth, n.key) && number_of(truth, n.key) < n.high) << n.key;
  EXPECT_NEAR(number_of(d.found, "effects.X.coulomb.level_N"), 40, 0.1);
}

}  // namespace
}  // namespace vcnc::imitation_test
