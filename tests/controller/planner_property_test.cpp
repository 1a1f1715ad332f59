// Random programs under both dynamics: finite, within limits, where they should end, and fast never
// slower than smooth. VCNC_SEEDS=2000 for more of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "configs/config.hpp"
#include "controller/limit_use.hpp"
#include "controller/player.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/controller/random_program.hpp"

namespace vcnc {
namespace {

using Dynamics = NcParams::Dynamics;

unsigned seeds() {
  const char* more = std::getenv("VCNC_SEEDS");
  return more ? static_cast<unsigned>(std::atoi(more)) : 25;
}

struct Played {
  Tick cycles = 0;
  AxisVector last{};
  std::array<double, 3> use{};
  bool finite = true;
};

Played play(const std::string& path, const Machine& machine) {
  Player player(path, machine);
  Played result;
  for (std::size_t i = 0; i < kAxisCount; ++i) result.last[i] = machine.axes[i].limits.start;
  LimitUse use(machine, result.last);
  for (PlayerStep step = player.step(); !step.done; step = player.step()) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      result.finite = result.finite && std::isfinite(step.position[i]) &&
                      std::isfinite(step.velocity[i]) && std::isfinite(step.feed);
    use.add(step.position);
    result.last = step.position;
    ++result.cycles;
  }
  for (int i = 0; i < 3; ++i) use.add(result.last);
  for (int order = 1; order <= 3; ++order)
    result.use[static_cast<std::size_t>(order - 1)] = use.largest(order);
  return result;
}

class RandomRuns : public testing::TestWithParam<const char*> {};

TEST_P(RandomRuns, AreSoundUnderBothDynamics) {
  Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + GetParam() + ".toml");
  machine.probe.in_spindle = false;
  for (unsigned seed = 1000; seed < 1000 + seeds(); ++seed) {
    const std::string text = RandomProgram(seed).text();
    SCOPED_TRACE("seed " + std::to_string(seed));
    const ProgramFile file(text);
    const std::vector<Move> moves = read_moves(text, machine);
    const FrameMap map(machine.kinematics, moves.back().frame);
    const Coordinates end = map.to_axes(moves.back().end);
    Tick smooth = 0;
    for (const Dynamics dynamics : {Dynamics::smooth, Dynamics::fast}) {
      machine.nc.dynamics = dynamics;
      const bool fast = dynamics == Dynamics::fast;
      const Played played = play(file.path(), machine);
      EXPECT_TRUE(played.finite);
      for (const double share : played.use) EXPECT_LE(share, fast ? 1.01 : 1.0006) << fast;
      for (std::size_t i = 0; i < kAxisCount; ++i)
        EXPECT_NEAR(played.last[i], end[static_cast<Eigen::Index>(i)], 1e-12) << fast;
      if (!fast) smooth = played.cycles;
      // A run may be a cycle longer where it cannot be any faster.
      if (fast) {
        EXPECT_LE(played.cycles, smooth + static_cast<Tick>(moves.size()));
      }
    }
    if (testing::Test::HasFailure()) FAIL() << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Planner, RandomRuns, testing::Values("trunnion", "head"));

}  // namespace
}  // namespace vcnc
