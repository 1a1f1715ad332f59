// The cyclic path must not allocate once its buffers have grown.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"

namespace {
std::atomic<std::uint64_t> allocations = 0;
}

// Not inlined, or the compiler takes the pair for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace vcnc::allocation_test {
namespace {

class Drive : public Node {
 public:
  explicit Drive(int id) : id_(id) {}
  int id() const override { return id_; }
  std::string_view name() const override { return "drive"; }
  bool accepts(std::uint16_t) const override { return true; }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    double sum = 0;
    for (const Frame& frame : inputs)
      if (const auto command = decode_group_command(frame)) sum += command->axes[0].position;
    out.push_back(encode(DriveStatus{.node = id_, .tick = low16(k), .position = sum}));
    if (k % 10 == 0) out.push_back(encode(Emergency{.node = id_}));
  }

 private:
  int id_;
};

class Counter : public Master {
 public:
  bool step(Tick k, std::span<const Frame> answers, Frames& out) override {
    if (k == 100) after_warm_up = allocations;
    seen += answers.size();
    out.push_back(encode(GroupCommand{.tick = low16(k)}));
    at_end = allocations;
    return k < 5000;
  }
  std::uint64_t after_warm_up = 0, at_end = 0;
  std::size_t seen = 0;
};

TEST(Allocation, NoneInTheCycleAfterWarmUp) {
  std::vector<Drive> drives;
  for (int id = 1; id <= kSpindleNode; ++id) drives.emplace_back(id);
  std::vector<Node*> nodes;
  Roster roster;
  for (Drive& drive : drives) {
    nodes.push_back(&drive);
    roster.push_back({drive.id(), "drive"});
  }
  InprocTransport bus(nodes);
  Counter master;
  Pacer pacer;
  const auto result = run_main_loop(master, bus, roster, {.pacer = pacer});
  ASSERT_TRUE(result.complete) << result.failure;
  EXPECT_EQ(master.seen, 6u * 5001 + 6 * 501);
  EXPECT_GT(master.after_warm_up, 0u);
  EXPECT_EQ(master.at_end, master.after_warm_up);
}

}  // namespace
}  // namespace vcnc::allocation_test
