// The cyclic path of the model does not allocate once it is warm.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "model/drive/axis_drive.hpp"
#include "model/drive/spindle.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"
#include "model/probe/contact.hpp"
#include "model/probe/signals.hpp"
#include "tests/model/s_eq1.hpp"

namespace {
std::size_t allocations = 0;
}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace vcnc::no_allocation_test {
namespace {

template <class Step>
std::size_t allocations_in(Step step) {
  for (int i = 0; i < 10; ++i) step(i);
  const std::size_t before = allocations;
  for (int i = 10; i < 1000; ++i) step(i);
  return allocations - before;
}

TEST(NoAllocation, TheGuardSeesAllocations) {
  EXPECT_EQ(allocations_in([](int) { auto p = std::make_unique<volatile int>(1); }), 990u);
}

TEST(NoAllocation, Drives) {
  AxisEffects effects;
  effects.get<Coulomb>().level = 250;
  effects.get<Presliding>().stiffness = 2.5e7;
  effects.get<Backlash>().gap = 5e-6;
  effects.get<Windup>().compliance = 1e-8;
  effects.get<EncoderQuantisation>().quantum = 1e-7;
  AxisDrive drive({}, effects);
  EXPECT_EQ(allocations_in([&](int i) { drive.follow({1e-5 * i, 1e-2}); }), 0u);
  EXPECT_EQ(allocations_in([&](int) { drive.brake(1); }), 0u);
  SpindleDrive spindle({});
  EXPECT_EQ(allocations_in([&](int) { spindle.step(SpindleMode::orient, 0); }), 0u);
}

TEST(NoAllocation, ProbeOnThePiece) {
  const auto piece = make_piece(s_eq1());
  const auto path = piece->scan_path(3e-3, 0.5e-3, 20e-3, 0.5e-3);
  Effects effects;
  effects.get<SurfaceFriction>().coefficient = 0.1;
  effects.get<ReturnToZero>().half_width = 1e-6;
  effects.get<AdcNoise>().noise = 1e-3;
  effects.get<SampleJitter>().jitter = 1e-6;
  ProbeParams probe;
  probe.correction = ProbeParams::Correction::heydemann;
  ProbeContact contact(probe, machine_chain<TouchPort>(effects, 1), piece.get());
  Chain<DeflectionPort> feeling = machine_chain<DeflectionPort>(effects, 1);
  SignalChannel channel(probe, 0, machine_chain<AnaloguePort>(effects, 1));
  const Kinematics kinematics({}, 0.15, Vec3::Zero());
  EXPECT_EQ(allocations_in([&](int i) {
              const Vec3 p =
                  path[0].centre + 8e-3 * i * (path[1].centre - path[0].centre);  // 40 mm/s
              const AxisVector q = kinematics.inverse(p, 0.1, 1e-3 * i);
              DeflectionPort::Signal<double> felt{contact.step(kinematics.forward(q))};
              feeling.step(felt, {{1e-4 * i, 1e-4, i}, probe.spring_rate});
              channel.sample(felt.deflection.x());
              piece->nearest(p, {});  // cold start
            }),
            0u);
  EXPECT_TRUE(contact.touching());
  EXPECT_FALSE(feeling.empty());
}

}  // namespace
}  // namespace vcnc::no_allocation_test
