// Scenarios from a seed: crashes that must end safely, and ordinary runs that must not be stopped.
//
// Scenario number i of a seed is a pure function of (seed, i, machines), so that any of them can be
// repeated alone. Drawn are, beside the kind: machine, mounting, stylus and spring, range, force
// limit, acceleration of the linear axes, ADC, place and posture, way relative to the tool, surface
// and incidence, feed (logarithmic), depth, and whether the ball is in contact before.
// A crash goes 1.25 times out of the usable range and some millimetres further along every axis of
// the probe. Feeds up to F20000 are drawn: what the NC unit's feed check refuses counts as safe,
// what it lets through must stop before the mechanical limit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "configs/scenario.hpp"

namespace vcnc {

/// Throws InputError where a machine file cannot be read.
class ScenarioDraw {
 public:
  ScenarioDraw(std::uint64_t seed, std::vector<std::string> machines);

  Scenario crash(std::uint64_t number) const;
  Scenario ordinary(std::uint64_t number) const;
  /// A crash of slow or middle feed and one fault, 50 ms before the first touch up to the trip.
  /// Kind and node go through all there are (apps/fault_draw.hpp).
  Scenario faulted(std::uint64_t number) const;

 private:
  enum class Feed { any, usual };
  Scenario crash(std::uint64_t stream, std::uint64_t number, Feed feed) const;

  std::uint64_t seed_;
  std::vector<std::string> machines_;
};

}  // namespace vcnc
