// What is still there after all that was found.
#pragma once

#include <vector>

#include "diagnosis/beforehand/chatter_search.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// Times the noise by which a signal is off for something that is there.
inline constexpr double kLoud = 1.5;

/// Whether an axis that vibrates by itself moves a signal.
bool is_stirred(const std::vector<Chatter>& chatter, const ComparedChannel& channel);

/// RMS on held-out laps, or of what was fitted where that alone is off [SI].
struct StillOff {
  ComparedChannel channel;
  double is, noise, was;
};

/// Signals that are still off by more than noise, and by more of what `before` was off than a
/// model of something that was found may be wrong by, on fitted and on held-out laps: what one
/// lap does alone is no deviation. Where nothing was repeated, what was fitted is enough if it is
/// off by far: it has motions that the rest has not. Not those that an axis which vibrates by
/// itself moves.
std::vector<StillOff> signals_still_off(const Evidence& evidence, const DiagnosisOptions& options,
                                        const std::vector<Chatter>& chatter, const Machine& before,
                                        const Machine& found);

/// Chi-square beyond the noise, per channel, that recorded steps may make of what a machine leaves.
std::vector<double> made_by_steps(const Evidence& evidence, const DiagnosisOptions& options,
                                  const FittedMachine& machine);

}  // namespace vcnc
