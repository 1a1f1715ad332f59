// A machine by hypothesis with everything that was computed at it, and fitting one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/acting_slices.hpp"
#include "diagnosis/fit/counted_gain.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {

/// An effect that was accepted.
struct AddedEffect {
  std::size_t candidate = 0;  ///< index into the candidates
  std::vector<FreedNumber> numbers{};
  std::set<std::string> needless{};  ///< keys of those that may be as declared (needed_numbers.hpp)
  double gain = 0;
  Explained explained{};                  ///< held-out chi-square per channel, back without it
  ActingSlices acts{};                    ///< when it does something
  std::vector<std::size_t> class_with{};  ///< candidates that do as well
};

/// A declared number found out of tolerance.
struct ReleasedNumber {
  std::string key;
  Explained explained{};                  ///< as of an effect, with its tolerance
  std::vector<std::size_t> class_with{};  ///< candidates that do as well
};

/// A machine by hypothesis with all that was computed at it.
struct FittedMachine {
  Machine machine;
  std::vector<AddedEffect> added;
  LinearPart nuisances;  ///< those of released declared numbers have no tolerance
  std::vector<ReleasedNumber> released;
  Prediction prediction;
  Column residual;
  std::vector<Column> columns;  ///< of all numbers of `added`, in order
  double held_out = std::numeric_limits<double>::infinity();
  std::vector<double> rounding;  ///< held-out chi-square per channel; see doubt_of()

  std::vector<FreedNumber> numbers() const;                 ///< of all added effects
  std::vector<Column> columns_of(std::size_t added) const;  ///< of the numbers of one of them
  std::size_t found() const { return added.size() + released.size(); }
  std::vector<Explained> explained() const;  ///< by each, and each released number
  std::vector<ActingSlices> acting() const;  ///< each of the same
  /// Nuisances and added effects with their columns.
  LinearPart linear() const;
  /// Without one of the added effects and its columns, everything else as it was computed.
  FittedMachine without_effect(std::size_t i) const;
  /// With a declared number that was released held again as in `base`, nothing fitted.
  FittedMachine holding(const std::string& key, const FittedMachine& base) const;
};

/// Axes and other places at which something was found.
std::set<std::string> places_found(const FittedMachine& machine);
/// The axis of whose drive a declared number is; empty: of none.
std::string drive_of(const std::string& key, const std::vector<Candidate>& candidates);
/// Axes at whose drive something was found.
std::set<std::string> drives_found(const FittedMachine& machine,
                                   const std::vector<Candidate>& candidates);

/// Fits all numbers of a machine together, nuisances included, until nothing moves.
void converge(const Evidence& evidence, FittedMachine& machine);

/// With declared numbers that were pulled further than some tolerances held at their declaration,
/// of those that may be out of one: what is so far off is no matter of tolerance.
FittedMachine within_tolerance(Evidence& evidence, FittedMachine machine, double tolerances,
                               const std::function<bool(const FreedNumber&)>& may_be_out_of_one);

/// Takes the sensitivities of all declared numbers where the machine stands, then fits as above.
void converge_anew(const Evidence& evidence, FittedMachine& machine);

/// Frees those common numbers that make something of what was found: of the drives where that is,
/// and of the probe.
void add_common(const Evidence& evidence, FittedMachine& machine,
                const std::vector<FreedNumber>& common);
/// Holds those as declared again at whose drive nothing is any more; all of them where nothing is
/// anywhere.
void hold_common(FittedMachine& machine);

/// Takes its numbers for what they are and fits from there, where the replica is exact.
void settle_at(Evidence& evidence, FittedMachine& machine);

/// Makes the replica exact at the machine and computes anew what it leaves.
void anchor_at(Evidence& evidence, FittedMachine& machine);

/// Chi-square of the held-out laps at which it is no use to fit on: no more than `little` can be
/// gained by it, or what is left is `much` more than another machine leaves.
struct NoUse {
  double little = 0, much = std::numeric_limits<double>::infinity();

  /// Whether so much is left that it stays too much if `hoped` is gained.
  bool given_up(double left, double hoped) const { return left - std::max(0.0, hoped) > much; }
};

/// After an effect was added: takes the sensitivities of the declared numbers where the machine now
/// stands and fits all together. Where the effect had been missing, some may have been pulled far;
/// then fits again from the declarations, too, and keeps what is better.
void settle_in(Evidence& evidence, FittedMachine& machine, const NoUse& no_use);

/// The declared machine with its nuisances fitted, or with these numbers.
FittedMachine fit_declared(Evidence& evidence, const Machine& declared,
                           Against against = Against::declaration);
FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers);

}  // namespace vcnc
