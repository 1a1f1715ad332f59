// Laws without a name: what is left over as a function of something, through the closed loop.
//
//   y = m f(c),   f = sum of hat functions over the range of the covariate c, with a small ridge
//   y = a before an instant, b after it: what slips, once
//
// at a point of an axis (model/effects/law.hpp): force on the table, displacement of the tool
// centre, reading of the probe. m is 1, a sign of the velocity, one direction or a position. All
// are fitted to first order (law_columns.hpp) with ten hats each, and with narrow ones at the place
// of a travel that promises most (law_places.hpp); the best ones that are no laws of time get more
// where held-out laps ask for them (law_knots.hpp). The best few are then simulated themselves and
// the best of these is fitted again where it acts (Gauss-Newton); what it gains there on the
// held-out laps counts.
//
// Known limit: laws that differ by less than the equivalence band (30 and 5 %) are told as such.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/fit/counted_gain.hpp"
#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

struct LawFit {
  std::vector<LearnedLaw> laws;
  double gain = 0;  ///< held-out chi-square, simulated
  Machine machine;  ///< with the laws
};

/// The best law on what `at` leaves, or one with gain 0.
/// `doubt`: of gains, see counted_gain.hpp. `least`: no law is of use that gains less; none is
/// simulated whose columns promise far less.
LawFit best_law(const Evidence& evidence, const FittedMachine& at, const Doubt& doubt,
                const DiagnosisOptions& options, double least = 0);

/// Whether of what a law gains in some channels a twentieth is lost in others, by chi-square of
/// each before and after: a force that winds up a shaft by what the other measuring system slips,
/// and that no motor has felt.
bool contradicted(const std::vector<double>& before, const std::vector<double>& after);

/// `at` as it stands with laws that were learnt on what it leaves, all its numbers fitted again.
FittedMachine learned(const Evidence& evidence, const FittedMachine& at, const Machine& machine);

/// Names that are too many where one law does as well.
inline constexpr std::size_t kImitation = 3;

/// What effects with names explain.
struct Named {
  double gain;        ///< all together, of several what counts of it (counted_gain.hpp)
  std::size_t count;  ///< effects
  double least;       ///< what the model loses without the one it misses least
};

/// Whether a law that gains `alone` takes the names away: more than to_take_away().
/// A law has ten numbers and bends to what the model of a true effect gets wrong about it, some
/// percent of what that does: one name only goes where the law gains clearly more, besides what a
/// law is to gain at all (`needed`). Of several names one law is the simpler account; three names
/// or more go where it gains as much as they do but for a part of the least of them.
bool takes_names_away(double alone, const Named& named, double needed);
double to_take_away(const Named& named, double needed);

/// "force on X as sgn(v_X) f(q_X)"
std::string words_of(const Law& law);

}  // namespace vcnc
