// With every effect of the list active at every place, no step of any chain allocates.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "model/drive/axis_drive.hpp"
#include "model/effects/chain.hpp"
#include "model/effects/port_list.hpp"
#include "tests/effects/all_nominal.hpp"
#include "tests/effects/port_samples.hpp"

namespace {
std::size_t allocations = 0;
}  // namespace

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

namespace vcnc::effects_allocation_test {
namespace {

/// Allocations of 1000 steps; `active` is set when there was something to step.
template <class Port>
std::size_t allocations_in(Chain<Port> chain, bool rotary, bool& active) {
  active |= !chain.empty();
  Draw draw(1);
  std::size_t total = 0;
  for (std::int64_t k = 0; k < 1000; ++k) {
    Sample<Port, double> sample = random_sample<Port>(draw, k, rotary);
    const std::size_t before = allocations;
    chain.step(sample.signal, sample.context);
    total += allocations - before;
  }
  return total;
}

TEST(EffectsAllocation, TheGuardSeesAllocations) {
  const std::size_t before = allocations;
  delete new volatile int(1);
  EXPECT_EQ(allocations - before, 1u);
}

TEST(EffectsAllocation, NoneInAnyChain) {
  Machine machine = all_nominal();
  for (const Law::Point point :
       {Law::Point::command, Law::Point::motor_force, Law::Point::table_force,
        Law::Point::displacement, Law::Point::reading}) {
    Law law;
    law.point = point;
    law.over = Covariate::position;
    law.at = {0, 1};
    law.value = {0, 1e-6};
    machine.effects.laws.push_back(law);
  }
  for_each_port([&]<class Port>(std::type_identity<Port>) {
    SCOPED_TRACE(std::string(Port::name));
    bool active = false, used = false;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      EXPECT_EQ(allocations_in(axis_chain<Port>(machine.effects, axis, 1), is_rotary(axis), active),
                0u);
    EXPECT_EQ(allocations_in(machine_chain<Port>(machine.effects, 1), false, active), 0u);
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      used |= std::is_same_v<typename Effect::Port, Port>;
    });
    for (const Law& law : machine.effects.laws)
      used |= takes(law.point, static_cast<const Port*>(nullptr));
    EXPECT_EQ(active, used);
  });
}

TEST(EffectsAllocation, NoneInADriveWithAllOfThem) {
  const Machine machine = all_nominal();
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    AxisDrive drive(machine, axis, 1);
    const double start = machine.axes[axis].limits.start;
    for (int k = 0; k < 10; ++k) drive.follow({start + 1e-5 * k, 1e-2});
    const std::size_t before = allocations;
    for (int k = 10; k < 300; ++k) drive.follow({start + 1e-5 * k, 1e-2});
    EXPECT_EQ(allocations, before) << kAxisNames[axis];
  }
}

}  // namespace
}  // namespace vcnc::effects_allocation_test
