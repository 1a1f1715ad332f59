// A machine by hypothesis with everything that was computed at it.
#pragma once

#include <algorithm>
#include <cstddef>
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

/// A machine at what several refits of it found, with everything that is computed there.
std::vector<FittedMachine> moved_to(const Evidence& evidence, const FittedMachine& machine,
                                    const std::vector<Refit>& found);
/// Computes everything where the machine stands; so do numbers that were begun elsewhere.
void stay(const Evidence& evidence, FittedMachine& machine);
/// Makes the replica exact at the machine and computes anew what it leaves.
void anchor_at(Evidence& evidence, FittedMachine& machine);

/// Takes the sensitivities of some declared numbers where the machine stands.
void linearise(const Evidence& evidence, FittedMachine& machine,
               const std::vector<std::size_t>& which);
/// All declared numbers.
std::vector<std::size_t> every(const FittedMachine& machine);
/// Those whose sensitivities are others than those of the declared machine: not those of a drive at
/// which nothing was found.
std::vector<std::size_t> concerned(const FittedMachine& machine);

/// Frees those common numbers that make something of what was found: of the drives where that is,
/// and of the probe.
void add_common(const Evidence& evidence, FittedMachine& machine,
                const std::vector<FreedNumber>& common);
/// Holds those as declared again at whose drive nothing is any more; all of them where nothing is
/// anywhere.
void hold_common(FittedMachine& machine);

}  // namespace vcnc
