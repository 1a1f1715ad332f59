// Programs that would take for ever are refused before anything moves.
#include <gtest/gtest.h>

#include "controller/player.hpp"
#include "program_file.hpp"

namespace vcnc::player_bounds_test {
namespace {

TEST(PlayerBounds, AMoveThatAnAxisNeedsMoreThanTenHoursForIsRefused) {
  Machine machine;
  machine.probe.in_spindle = false;
  machine.axes[kX].limits.velocity = 1e-5;  // 0.01 mm/s: 400 mm take 11.1 h
  for (const char* word : {"G0", "G1 F6000"}) {
    EXPECT_NE(refusal(std::string(word) + " X400\nM30\n", machine).find("would last 11.1 h"),
              std::string::npos);
    EXPECT_EQ(refusal(std::string(word) + " X300\nM30\n", machine), "");  // 8.3 h
  }
}

}  // namespace
}  // namespace vcnc::player_bounds_test
