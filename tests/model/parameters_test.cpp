#include "model/parameters.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace vcnc::parameters_test {
namespace {

TEST(Parameters, EachIsFoundByItsKey) {
  Machine machine;
  const std::vector<Parameter> all = parameters(machine);
  ASSERT_GT(all.size(), 500U);
  for (const Parameter& p : all) {
    const std::optional<Parameter> found = find_parameter(machine, p.key);
    ASSERT_TRUE(found) << p.key;
    EXPECT_EQ(found->key, p.key);
    EXPECT_EQ(found->value, p.value) << p.key;
    EXPECT_EQ(found->unit.suffix, p.unit.suffix) << p.key;
    EXPECT_FALSE(find_whole_parameter(machine, p.key)) << p.key;
  }
  const std::vector<WholeParameter> whole = whole_parameters(machine);
  ASSERT_FALSE(whole.empty());
  for (const WholeParameter& p : whole) {
    const std::optional<WholeParameter> found = find_whole_parameter(machine, p.key);
    ASSERT_TRUE(found) << p.key;
    EXPECT_EQ(found->value, p.value) << p.key;
  }
}

TEST(Parameters, NothingElseIs) {
  Machine machine;
  for (const char* key :
       {"", ".", "axes", "axes.X", "axes.X.", "axes.X.load", "axes.X.load_kgs", "axes.X.load_kg.",
        "axes.W.load_kg", "effects.geometry.squareness", "effects.setup.piece_offset.shift_um",
        "effects.setup.piece_offset.shift_um.w", "effects.setup.piece_offset.shift_um.xx"})
    EXPECT_FALSE(find_parameter(machine, key)) << key;
  EXPECT_TRUE(find_parameter(machine, "effects.setup.piece_offset.shift_um.y"));
}

TEST(Parameters, AreSetByKeyWithinTheirRange) {
  Machine machine;
  set_parameter(machine, "axes.Y.load_kg", 321);
  EXPECT_EQ(machine.axes[1].mechanics.load, 321);
  EXPECT_THROW(set_parameter(machine, "axes.Y.load_kg", -1), std::invalid_argument);
  EXPECT_EQ(machine.axes[1].mechanics.load, 321);
  EXPECT_THROW(set_parameter(machine, "axes.Y.weight_kg", 1), std::invalid_argument);
}

}  // namespace
}  // namespace vcnc::parameters_test
