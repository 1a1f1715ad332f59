// How far fitted numbers may be from the truth: half widths of 95 % intervals.
//
// Noise: the largest of what the curvature of chi-square tells, times what chi-square is too large
// by, of the scatter between blocks of a second (sandwich; White 1980), and of that between laps:
// an axis that rests elsewhere within a step of its encoder shifts a whole lap, and a fitted drift
// follows such shifts. Where the model is known not to be exact, two things are added in
// quadrature instead of the last: the scatter between the conditions of the run, by Student's t
// and 1.3 for what so few of them miss, since what a model gets wrong is alike in all laps of a
// condition; and 4 % of the largest amplitude of the effect, since no law of an effect is known
// better than to two percent. Where chi-square is ragged about a number, its interval is as wide as
// that (look_about.hpp). Both were set on machines of the second generator.
#pragma once

#include <map>
#include <string>

#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// Half width of the interval that holds 95 % of a normal distribution, in standard deviations.
inline constexpr double kNormal95 = 1.96;
/// Standard deviation of a number, of the size of its effect, by the form of the law.
inline constexpr double kKnownTo = 0.02;

struct Interval {
  double half_width = 0;  ///< of the 95 % interval, in the unit of the key
  /// The same were the shapes of effects known: the height of a slow drift and its time constant
  /// may be known together alone.
  double shapes_known = 0;
};

/// Whether a model is known to be more than noise off the machine, where it leaves `held_out` of a
/// `floor` that noise leaves (chi-square).
bool is_inexact(const Evidence& evidence, const DiagnosisOptions& options, double floor,
                double held_out);

/// By key, of nuisances and added effects; `inexact`: the model is known not to be exact.
std::map<std::string, Interval> intervals_of(const Evidence& evidence, const FittedMachine& machine,
                                             bool inexact = false);

/// Whether the intervals of all amplitudes of an effect, its shape known, hold what is declared: it
/// is not known to be there at all. Not of one that has none but a limit.
bool may_be_as_declared(const AddedEffect& effect, const Machine& declared,
                        const std::map<std::string, Interval>& intervals);

}  // namespace vcnc
