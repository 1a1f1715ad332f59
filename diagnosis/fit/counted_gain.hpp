// How much of a gain cannot be an error of the models' form.
//
// A model that gets the healthy machine wrong by some chi-square in a channel, or what it has
// explained there, may gain a part of that by an effect that is not there. So of a gain in a
// channel only that counts which exceeds such a part. An effect that leaves next to nothing in the
// channel where it explains most has been seen to be right, and is doubted less everywhere. What
// was brought into a channel where nothing was is no gain of the next one that takes it out again.
// What is gained while no found effect does anything (acting_slices.hpp) is doubted as if none
// were. What encoders round off is known as a sample only, and repeats (friction that is stirred by
// it is another friction): a twentieth of its chi-square counts for nobody, either.
#pragma once

#include <vector>

#include "diagnosis/diagnosis_options.hpp"

namespace vcnc {

/// Part of a gain that a channel must have to be concerned.
inline constexpr double kConcerned = 0.02;

/// Chi-square of the held-out laps per channel that does not count; empty: all counts.
using Doubt = std::vector<double>;

/// Per channel: what of chi-square comes back without an effect.
using Explained = std::vector<double>;

/// Where `left` is what is left now and `before` was there before anything was explained, each of
/// the found effects its part of it. `rounding` is what encoders make of the found effects (play
/// lets an axis tremble within a step of them) beyond what counts as noise, and what the steps of
/// recorded signals may make; empty: nothing.
Doubt doubt_of(const DiagnosisOptions& options, const std::vector<Explained>& found,
               const std::vector<double>& before, const std::vector<double>& left,
               const std::vector<double>& rounding = {});
/// Where nothing was explained yet.
Doubt doubt_of(const DiagnosisOptions& options, const std::vector<double>& rounding = {});

/// Of `gain`, which came from `before` going down to `after` in the channels.
double counted(double gain, const std::vector<double>& before, const std::vector<double>& after,
               const Doubt& doubt);
/// The same where `at_rest` of the gain of each channel comes from samples at which no found effect
/// acts: there `anywhere` alone is doubted.
double counted(double gain, const std::vector<double>& before, const std::vector<double>& after,
               const Doubt& doubt, const Doubt& anywhere, const std::vector<double>& at_rest);

}  // namespace vcnc
