// A probe node on its own: axes that move as a function of time, readings as they go on the bus.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "probe_sim/probe_node.hpp"

namespace vcnc {

inline constexpr double kBenchStep = kCycle / kLoopStepsPerCycle;
/// Resolution of 16 bit signals, 0.13 nm, and of the message, 0.1 nm.
inline constexpr double kReadingError = 0.2e-9;

/// A wall with the outward normal n through the origin.
inline PieceParams wall(const Vec3& n) {
  PieceParams piece;
  piece.kind = PieceParams::Kind::plane;
  piece.direction = n;
  return piece;
}

/// Axes of the default machine (trunnion, axes through the origin) that put the ball at p.
inline AxisVector ball_at(const Vec3& p, double a = 0, double c = 0) {
  const Machine machine;
  return Kinematics(machine.kinematics, machine.probe.length, Vec3::Zero()).inverse(p, a, c);
}

/// Cycles in which the ball comes to where it shall be; a probe counts from its free zero.
inline constexpr int kApproach = 100;

/// Readings 0 .. cycles, one per millisecond; `q` gives the true axes at any time [s]. Until
/// kApproach the ball comes to q from `free` beside it, machine frame [m].
inline std::vector<ProbeSample> probe_readings(Machine machine, const PieceParams& piece,
                                               const Vec3& free, int cycles,
                                               const std::function<AxisVector(double)>& q,
                                               std::uint64_t seed = 1) {
  const auto axes = [&](std::int64_t step) {
    const double t = static_cast<double>(step) * kBenchStep;
    AxisVector now = q(t);
    const double s = std::min(1.0, static_cast<double>(step) / (10.0 * kApproach));
    const double left = 1 - s * s * s * (10 - 15 * s + 6 * s * s);
    if (s < 1)
      for (int i = 0; i < 3; ++i) now[static_cast<std::size_t>(i)] += left * free[i];
    return now;
  };
  const AxisVector start = axes(0);
  for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].limits.start = start[i];
  const std::unique_ptr<TruthPort> truth = open_local_truth();
  ProbeNode node(machine, make_piece(piece), seed, *truth);
  std::vector<ProbeSample> readings;
  for (Tick k = 0; k <= cycles; ++k) {
    if (k > 0) {
      std::array<TruthCycle, kTruthAxes> cycle;
      for (int j = 0; j < kLoopStepsPerCycle; ++j) {
        const AxisVector now = axes(10 * (k - 1) + 1 + j);
        for (std::size_t i = 0; i < kAxisCount; ++i)
          cycle[i].position[static_cast<std::size_t>(j)] = now[i];
      }
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        cycle[i].tick = k - 1;
        truth->publish(i, cycle[i]);
      }
    }
    Frames out;
    node.step(k, {}, out);
    readings.push_back(decode_probe_sample(out.at(0)).value());
  }
  return readings;
}

/// On a wall with the outward normal n, approached along it.
inline std::vector<ProbeSample> wall_readings(const Machine& machine, const Vec3& n, int cycles,
                                              const std::function<AxisVector(double)>& q,
                                              std::uint64_t seed = 1) {
  return probe_readings(machine, wall(n), 1e-3 * n, cycles, q, seed);
}

}  // namespace vcnc
