// What is asked of a gain, whoever makes it; see selection.hpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/screening/screening.hpp"

namespace vcnc {

inline constexpr double kAsGood = 0.99;   ///< part of a gain that is as much before all is fitted
inline constexpr double kNearLoss = 0.8;  ///< part of what an effect is worth, promised by a rival
/// Of what is left: what a further effect than few must gain, or another one in place of one.
inline constexpr double kHalf = 0.5;
inline constexpr double kClearlySimpler = 0.5;  ///< numbers

/// What every contest of a diagnosis has in common.
struct ContestRules {
  const Evidence& evidence;
  const std::vector<Candidate>& candidates;
  const DiagnosisOptions& options;
  std::vector<TrialColumns>& trials;
  std::vector<double> base_of;   ///< held-out chi-square per channel before anything was found
  double floor = 0;              ///< what noise leaves of held-out chi-square
  std::vector<double> floor_of;  ///< of it per channel
  /// Told what is done and how far it is; false: stopped, and the next prediction throws Stopped.
  std::function<bool(const std::string&, double)> go;

  double excess(double held_out) const;
  /// What a candidate must gain where so much is left.
  double threshold(double held_out) const;
  /// The same of one that takes the channels from `before` to `after`: only what is left where it
  /// gains something is its concern.
  double threshold(const std::vector<double>& before, const std::vector<double>& after) const;
  /// What is left beyond the floor where something is gained from `before` to `after`.
  double left_where_gained(const std::vector<double>& before,
                           const std::vector<double>& after) const;
  /// Whether what it explains is there at all: whatever repeats makes the residual larger than what
  /// laps differ by.
  bool stands_out(const std::vector<double>& before, const std::vector<double>& after) const;
};

}  // namespace vcnc
