#include "diagnosis/candidates/suspects.hpp"

#include <gtest/gtest.h>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/selection/selection.hpp"
#include "model/input_error.hpp"
#include "toy_machine.hpp"

namespace vcnc::suspects_test {
namespace {

using Words = std::vector<std::string>;

std::string names(const std::vector<Candidate>& all) {
  std::string text;
  for (const Candidate& c : all) text += (text.empty() ? "" : " ") + c.name();
  return text;
}

TEST(Suspects, AreEffectsAtAPlaceEffectsAnywhereOrKeys) {
  const Candidate play{"backlash", "X", {}, {}}, mass{"deviation", "axes.X.load_kg", {}, {}};
  EXPECT_TRUE(is_suspected({"X.backlash"}, play));
  EXPECT_TRUE(is_suspected({"backlash"}, play));
  EXPECT_FALSE(is_suspected({"Y.backlash"}, play));
  EXPECT_FALSE(is_suspected({"back"}, play));
  EXPECT_TRUE(is_suspected({"axes.X.load_kg"}, mass));
  EXPECT_TRUE(is_suspected({}, play));
}

TEST(Suspects, OfADeclaredNumberAreItsKeyAndItsEffect) {
  const std::string key = "effects.X.coulomb.level_N";
  EXPECT_TRUE(is_suspected({key}, key));
  EXPECT_TRUE(is_suspected({"X.coulomb"}, key));
  EXPECT_TRUE(is_suspected({"coulomb"}, key));
  EXPECT_TRUE(is_suspected({}, key));
  EXPECT_FALSE(is_suspected({"Y.coulomb"}, key));
  EXPECT_FALSE(is_suspected({"X.coul"}, key));
  EXPECT_FALSE(is_suspected({"coulomb"}, std::string("axes.coulomb.load_kg")));
}

TEST(Suspects, OthersAreLeftOutAndWrongOnesRefused) {
  const std::vector<Candidate> all = toy::candidates();
  EXPECT_EQ(names(suspected(all, {}, {"X.coulomb", "geometry.squareness"})),
            "X.coulomb geometry.squareness");
  EXPECT_EQ(suspected(all, {}, {}).size(), all.size());
  EXPECT_TRUE(suspected(all, {"axes.Z.load_kg"}, {"axes.Z.load_kg"}).empty());
  try {
    suspected(all, {"axes.Z.load_kg"}, {"X.coulomb", "X.rust"});
    FAIL() << "X.rust is no effect";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("--suspect: \"X.rust\" is no effect"), std::string::npos)
        << e.what();
  }
}

/// What is found of `truth`, by its name or key.
std::string found(const Machine& truth, const Words& suspects, const Machine& declared = {}) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, truth, 7);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, declared);
  DiagnosisOptions options;
  options.suspects = suspects;
  const std::vector<Candidate> sought = suspected(toy::candidates(), {"axes.X.load_kg"}, suspects);
  const SelectionResult result = select_effects_of(evidence, declared, sought, options, {});
  std::string text;
  for (const AddedEffect& a : result.found.added) text += sought[a.candidate].name();
  for (const ReleasedNumber& r : result.found.released) text += r.key;
  return text;
}

TEST(Suspects, NothingElseIsFound) {
  const Machine leaning = toy::machine({{"effects.geometry.squareness.xy_urad", 6}}),
                heavy = toy::machine({{"axes.X.load_kg", 545}});
  EXPECT_EQ(found(leaning, {"geometry.squareness"}), "geometry.squareness");
  EXPECT_EQ(found(leaning, {"X.coulomb"}), "");
  EXPECT_EQ(found(heavy, {"axes.X.load_kg"}), "axes.X.load_kg");
  EXPECT_EQ(found(heavy, {"geometry.squareness"}), "");
}

/// No declared number takes their place, though none may be found either.
TEST(Suspects, AreNotHiddenByADeclaredNumberFarOutOfTolerance) {
  const Machine declared = toy::machine({{"effects.X.coulomb.level_N", 60}});
  for (const double viscous : {30, 60, 120})
    EXPECT_EQ(found(toy::machine({{"effects.X.coulomb.level_N", 60},
                                  {"effects.X.viscous.coefficient_Ns_per_m", viscous}}),
                    {"X.viscous"}, declared),
              "X.viscous")
        << viscous;
}

}  // namespace
}  // namespace vcnc::suspects_test
