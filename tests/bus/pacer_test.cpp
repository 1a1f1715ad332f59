#include "bus/pacer.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <limits>
#include <stdexcept>

namespace vcnc::pacer_test {
namespace {

TEST(Pacer, FreeRunningNeverWaits) {
  Pacer pacer;
  const double begin = pacer.elapsed();
  for (Tick k = 0; k < 1000000; ++k) pacer.wait(k);
  EXPECT_LT(pacer.elapsed() - begin, 1.0);  // a million cycles are 1000 s of machine time
  EXPECT_FALSE(pacer.paced());
  EXPECT_EQ(pacer.overruns(), 0u);
}

TEST(Pacer, DeadlinesAreAbsolute) {
  Pacer pacer(2);
  const double begin = pacer.elapsed();
  for (Tick k = 0; k <= 200; ++k) pacer.wait(k);
  const double seconds = pacer.elapsed() - begin;
  EXPECT_GE(seconds, 0.0999);
  EXPECT_LT(seconds, 2.0);  // sleeps overshoot, but errors do not add up without bound
}

TEST(Pacer, LateCyclesAreCountedAndCaughtUp) {
  Pacer pacer(1);
  pacer.wait(0);
  ::poll(nullptr, 0, 30);
  const double begin = pacer.elapsed();
  for (Tick k = 1; k <= 20; ++k) pacer.wait(k);  // all of them are due already
  EXPECT_LT(pacer.elapsed() - begin, 0.019);
  EXPECT_GE(pacer.overruns(), 20u);
}

TEST(Pacer, SpeedIsChecked) {
  EXPECT_THROW(Pacer(-1), std::invalid_argument);
  EXPECT_THROW(Pacer{std::numeric_limits<double>::infinity()}, std::invalid_argument);
  EXPECT_THROW(Pacer{std::numeric_limits<double>::quiet_NaN()}, std::invalid_argument);
}

}  // namespace
}  // namespace vcnc::pacer_test
