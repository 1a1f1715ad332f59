// Simulated time is an integer: tick k is the instant t = k * 1 ms. Nothing accumulates seconds.
#pragma once

#include <cstdint>

namespace vcnc {

using Tick = std::int64_t;

inline constexpr double kCycle = 1e-3;          ///< bus cycle [s]
inline constexpr int kPlantStepsPerCycle = 20;  ///< the plant is integrated at 50 us
inline constexpr int kLoopStepsPerCycle = 10;  ///< drive loops, probe contact and ADC run at 100 us

constexpr double seconds(Tick k) { return static_cast<double>(k) * kCycle; }

}  // namespace vcnc
