// One axis of a hypothesis, driven by the command of a record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/drive/axis_drive.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Samples of the true position in a cycle; the last belongs to its end.
inline constexpr std::size_t kTruthPerCycle = 10;
/// Those of them that tell position, velocity and acceleration at its end.
inline constexpr std::size_t kLateTruth = 3;

/// One value per cycle of 1 ms, SI; NaN where nothing is said of this axis.
struct AxisReplay {
  SharedSeries measured, twist, force;
  SharedSeries velocity;      ///< of the motor side; empty: not asked for
  std::vector<double> truth;  ///< true position, the last of a cycle k belongs to the instant k ms
  std::size_t per_cycle = kTruthPerCycle;  ///< of truth; fewer: the last ones

  /// True position at the end of a cycle; [-1] and [-2] are those 100 and 200 us before.
  const double* end_of(std::size_t cycle) const { return &truth[(cycle + 1) * per_cycle - 1]; }
  std::size_t cycles() const { return truth.size() / per_cycle; }
};

/// A machine by hypothesis and the same with its deviations applied, starting where the record
/// does.
struct AxisVariant {
  const Machine& hypothesis;
  const Machine& actual;
};

/// An axis with what is needed to displace its tool centre otherwise.
struct WatchedReplay {
  AxisReplay replay;
  std::vector<LoadMotion> late;  ///< kLateTruth per cycle
};
WatchedReplay replay_watched(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                             const CommandedMotion& motion);
/// The same drive with the displacements of another hypothesis, as replay_variants(); empty where
/// those depend on more than its load's motion at the instant.
std::optional<AxisReplay> displaced(const WatchedReplay& drive, const Machine& hypothesis,
                                    const Machine& actual, std::size_t axis);

/// Several variants of an axis, side by side (model/drive/lanes.hpp): the same to the last bit, but
/// of the truth only the last kLateTruth of every cycle.
std::vector<AxisReplay> replay_variants(const std::vector<AxisVariant>& variants, std::size_t axis,
                                        const CommandedMotion& motion);

/// `actual` is the hypothesis with its deviations applied and starting where the record does;
/// `motion` is at 1 ms. Throws std::invalid_argument where the machine cannot be simulated.
AxisReplay replay_axis(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                       const CommandedMotion& motion);

/// Everything replay_axis() depends on besides the motion: the drive, and what displaces the tool
/// centre in addition.
struct AxisFingerprint {
  std::string drive, displacement;
};
AxisFingerprint fingerprint_of_axis(const Machine& hypothesis, const Machine& actual,
                                    std::size_t axis);

}  // namespace vcnc
