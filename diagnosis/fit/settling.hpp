// Fits a machine after something of it was decided: what is declared, what was added, what is held.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// Chi-square of the held-out laps at which it is no use to fit on: no more than `little` can be
/// gained by it, or what is left is `much` more than another machine leaves.
struct NoUse {
  double little = 0, much = std::numeric_limits<double>::infinity();

  /// Whether so much is left that it stays too much if `hoped` is gained.
  bool given_up(double left, double hoped) const { return left - std::max(0.0, hoped) > much; }
};

/// The declared machine with its nuisances fitted, or with these numbers.
FittedMachine fit_declared(Evidence& evidence, const Machine& declared,
                           Against against = Against::declaration);
FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers);

/// Takes the sensitivities of all declared numbers where the machine stands, then converges.
void converge_anew(const Evidence& evidence, FittedMachine& machine);
/// Converges, then fits all numbers jointly (joint_fit.hpp).
void converge_jointly(const Evidence& evidence, FittedMachine& machine);

/// With declared numbers that were pulled further than some tolerances held at their declaration,
/// of those that may be out of one: what is so far off is no matter of tolerance.
FittedMachine within_tolerance(Evidence& evidence, FittedMachine machine, double tolerances,
                               const std::function<bool(const FreedNumber&)>& may_be_out_of_one);

/// Takes its numbers for what they are and fits from there, where the replica is exact.
void settle_at(Evidence& evidence, FittedMachine& machine);

/// After an effect was added: takes the sensitivities of the declared numbers where the machine now
/// stands and fits all together. Where the effect had been missing, some declared
/// numbers may have been pulled far; then fits again from the declarations, too, and keeps what is
/// better.
void settle_in(Evidence& evidence, FittedMachine& machine, const NoUse& no_use);

}  // namespace vcnc
