// The cyclic path of the player allocates nothing: only where a run begins, it is planned.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "configs/config.hpp"
#include "controller/player.hpp"
#include "tests/controller/program_file.hpp"

namespace {
std::size_t allocations = 0;
}

// Counts every allocation of this executable. Not inlined, so that the compiler sees new and delete
// as a pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace vcnc::player_allocation_test {
namespace {

TEST(PlayerAllocation, NoneWithinARun) {
  const Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml");
  std::string text = "G43.4 H1\nG0 X50 Y0 Z50\nG4 P0.1\n";
  for (int i = 1; i <= 200; ++i)
    text += "G1 X50 Y" + std::to_string(0.2 * i) + " A" + std::to_string(0.05 * i) + " F2000\n";
  const ProgramFile file(text + "G3 X50 Y60 R10\nM30\n");
  Player player(file.path(), machine);
  int runs = 0, cycles = 0;
  bool waiting = false;
  for (PlayerStep step; !step.done;) {
    const std::size_t before = allocations;
    const bool waited = waiting;
    step = player.step();
    waiting = step.dwell;
    const bool planned = cycles == 0 || waited != waiting || step.done;
    runs += planned;
    ++cycles;
    if (planned) continue;
    EXPECT_EQ(allocations, before) << "line " << step.line;
  }
  EXPECT_GT(cycles, 1500);
  EXPECT_EQ(runs, 4);  // rapid, dwell, lap, end
}

}  // namespace
}  // namespace vcnc::player_allocation_test
