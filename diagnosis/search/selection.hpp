// Finds the effects that a declared machine lacks, one after the other.
//
//   base fit                 declared numbers within their tolerances, set-up free
//   repeat
//     screen                 every candidate, by sensitivities (screening.hpp)
//     refit                  the best few nonlinearly (refit.hpp); pairs where no one explains half
//     accept                 the one with the largest gain on held-out laps, if it is enough
//     converge, drop test    all together; what is no longer needed goes
//     exchange               each one taken out, all candidates compete for its place
//
// A gain is chi-square on held-out laps (whose expectation is their number of samples when nothing
// but noise is left) and of the priors of the declared numbers. It must exceed 25 and 2 % of the
// excess, and be found under two conditions if the effect shows under two. Candidates that do as
// well as the best one within 30 and 5 % of what remains are equivalent to it on this record.
//
// What found effects explain is never known better than to half a percent: of what a further effect
// gains in a channel only that counts which exceeds 0.5 % of what they explain there.
//
// Of candidates that do as well as the best one, that with the fewest numbers of the most usual
// size stands for all.
//
// Thresholds: chi-square of a few spurious numbers is a few units; 25 is also what five standard
// deviations of one number give, which is how a detection limit is defined.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "diagnosis/search/candidate.hpp"
#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/refit.hpp"
#include "diagnosis/search/screening.hpp"

namespace vcnc {

struct DiagnosisOptions {
  double least_gain = 25, least_share = 0.02;
  /// Chi-square that a model may leave by its form alone, and the share of it an effect must gain.
  double form = 0, share_of_form = 0;
  double share_of_found = 0;  ///< of what found effects explain, see above
  /// Chi-square per channel that the model is known to leave by its form, and the share of it that
  /// one effect may take for its own. Empty: none.
  std::vector<double> form_of_channel;
  double taken_of_form = 0.5;
  double form_um =
      0;  ///< RMS of the reading that this form makes; less in readings alone is a note
  double class_gain = 30, class_share = 0.05;
  double law_gain = 40;           ///< of a generic law
  double model_form = 1.10;       ///< chi-square per sample above which no cause is named
  double out_of_tolerance = 4.5;  ///< pull of a declared number
  double clamped_um = 5;          ///< offset of the piece that is worth a word; 10 urad per um
  std::size_t refits = 5, per_family = 2, pairs_of = 10;
  std::size_t max_effects = 8;
};

struct DiagnosisProgress {
  std::string doing;  ///< "screening 212 candidates"
  double share = 0;   ///< of this step
};
/// Called now and then; false stops the work, what was found is kept.
using KeepGoing = std::function<bool(const DiagnosisProgress&)>;

/// An effect that was accepted.
struct AddedEffect {
  std::size_t candidate = 0;  ///< index into the candidates
  std::vector<FreedNumber> numbers;
  double gain = 0;
  std::vector<std::size_t> class_with;  ///< candidates that do as well
};

/// A machine by hypothesis with all that was computed at it.
struct FittedMachine {
  Machine machine;
  std::vector<AddedEffect> added;
  LinearPart nuisances;               ///< those of released declared numbers have no tolerance
  std::vector<std::string> released;  ///< declared numbers found out of tolerance
  Prediction prediction;
  Column residual;
  std::vector<Column> columns;  ///< of all numbers of `added`, in order
  double held_out = std::numeric_limits<double>::infinity();

  std::vector<FreedNumber> numbers() const;  ///< of all added effects
  /// Nuisances and added effects with their columns.
  LinearPart linear() const;
};

struct SelectionResult {
  FittedMachine base, found;
  double floor = 0;               ///< what noise leaves of held-out chi-square
  std::vector<double> rung_chi2;  ///< held-out chi-square after each addition
  std::vector<std::string> rung_name;
  std::vector<std::vector<double>> rung_rms;  ///< held-out, per channel
  std::vector<TrialColumns> trials;
  bool interrupted = false;
};

SelectionResult select_effects_of(Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const DiagnosisOptions& options, const KeepGoing& keep_going);

/// Fits all numbers of a machine together, nuisances included, until nothing moves.
void converge(const Evidence& evidence, FittedMachine& machine);

/// Held-out chi-square that noise and the form of the model make: one per sample and the form's,
/// less where a channel is quieter than that.
double noise_floor(const Evidence& evidence, const Column& residual,
                   const std::vector<double>& form_of_channel = {});

/// The declared machine with its nuisances fitted, or with these numbers.
FittedMachine fit_declared(Evidence& evidence, const Machine& declared);
FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers);

}  // namespace vcnc
