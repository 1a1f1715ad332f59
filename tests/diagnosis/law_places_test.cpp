#include "diagnosis/laws/law_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "tests/diagnosis/stroke_run.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc::law_places_test {
namespace {

void expect_neighbours(const std::vector<double>& promises, std::size_t first, std::size_t last) {
  const Neighbours n = about_the_most(promises);
  EXPECT_EQ(n.first, first);
  EXPECT_EQ(n.last, last);
}

TEST(LawPlaces, AreWhatPromisesAPartOfTheMost) {
  expect_neighbours({0, 1, 50, 100, 20, 2, 30}, 2, 5);
  expect_neighbours({100, 1}, 0, 1);
  expect_neighbours({1, 100}, 1, 2);
  expect_neighbours({0, 0, 0}, 0, 1);
  // Not all of a travel, but what promises more.
  std::vector<double> broad(30, 50);
  broad[20] = 100;
  for (std::size_t i = 21; i < 30; ++i) broad[i] = 60;
  expect_neighbours(broad, 20, 30);
}

/// 3 um over 2 of 60 mm, one way only.
TEST(LawPlaces, TellADisplacementThatActsAtOnePlaceOneWay) {
  Record record = toy::commands(3000, 4);
  toy::measure(record, {}, 23);
  const std::vector<double>& x = record.find(SignalKind::command, 0)->value;
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 1; k < s.value.size(); ++k)
        if (x[k] > x[k - 1]) s.value[k] += 3e-6 * std::max(0.0, 1 - std::abs(x[k] - 0.0115) / 1e-3);
  toy::ToyReplica replica(record);
  const Diagnosis d = diagnose({record, replica, {}, toy::candidates()});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(d.laws.size(), 1U);
  EXPECT_EQ(d.laws[0].words, "displacement on X going forwards as f(q_X)");
  const Law& law = d.laws[0].law;
  const auto most = std::max_element(law.value.begin(), law.value.end());
  EXPECT_NEAR(*most, 3e-6, 0.5e-6);
  EXPECT_NEAR(law.at[static_cast<std::size_t>(most - law.value.begin())], 0.0115, 0.3e-3);
}

/// A cover that catches over 3 mm of a travel of 80 mm, forwards.
TEST(LawPlaces, TellAForceThroughTheLoop) {
  Machine truth = stroke_run::declared();
  Law law;
  law.over = Covariate::position;
  law.times = Covariate::forwards;
  law.at = {0.012, 0.0145, 0.015};
  law.value = {0, -150, 0};
  truth.effects.laws.push_back(law);
  const Record record = stroke_run::recorded(truth, 5);
  const Machine declared = stroke_run::declared();
  MachineReplica replica(record, declared, std::nullopt);
  std::vector<Candidate> some = candidates(declared);
  std::erase_if(some, [](const Candidate& c) {
    return c.place != "X" || (c.effect != "coulomb" && c.effect != "backlash");
  });
  const Diagnosis d = diagnose({record, replica, declared, some});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_FALSE(d.laws.empty());
  EXPECT_EQ(d.laws[0].words, "force on X going forwards as f(q_X)");
  const auto least = std::min_element(d.laws[0].law.value.begin(), d.laws[0].law.value.end());
  EXPECT_NEAR(*least, -150, 40);
  EXPECT_NEAR(d.laws[0].law.at[static_cast<std::size_t>(least - d.laws[0].law.value.begin())],
              0.0145, 1e-3);
}

}  // namespace
}  // namespace vcnc::law_places_test
