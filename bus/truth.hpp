// The ground truth between the simulators: where the axes really are.
//
// The probe's physics needs the true motion of the machine, which no real module could know. It
// therefore travels apart from the bus, on a channel that only the drive and probe simulators open
// (own link target vcnc_truth). In cycle k every drive publishes the true load position of its axis
// at the end of each of its loop steps; the probe collects all five in cycle k+1. That is the same
// one-cycle rule as on the bus, so the result does not depend on who runs first.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "bus/tick.hpp"

namespace vcnc {

inline constexpr std::size_t kTruthAxes = 5;

/// True load positions of one axis [m or rad] at the ends of the loop steps of one cycle.
struct TruthCycle {
  Tick tick = -1;
  std::array<double, kLoopStepsPerCycle> position{};
};

/// A channel that cannot be opened: one sentence saying why.
class TruthError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class TruthPort {
 public:
  virtual ~TruthPort() = default;
  /// Drive side. Never waits: what a stuck or absent reader cannot take is dropped and counted.
  virtual void publish(std::size_t axis, const TruthCycle& cycle) = 0;
  /// Probe side: all axes of cycle k. False if one of them is not there, which leaves its entry as
  /// it was; never waits or guesses.
  virtual bool collect(Tick k, std::array<TruthCycle, kTruthAxes>& out) = 0;
  /// Cycles that could not be delivered so far.
  virtual std::uint64_t dropped() const { return 0; }
};

/// Drives and probe in one process and thread.
std::unique_ptr<TruthPort> open_local_truth();

/// The probe's end between processes: creates the channel at `path`, which must exist before the
/// first cycle, and removes it at the end. Throws TruthError.
std::unique_ptr<TruthPort> open_truth_reader(const std::string& path);

/// A drive's end between processes. The reader may come later. Throws TruthError.
std::unique_ptr<TruthPort> open_truth_writer(const std::string& path);

}  // namespace vcnc
