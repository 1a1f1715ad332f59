// Finds the effects that a declared machine lacks, one after the other.
//
//   base fit                 declared numbers within their tolerances, set-up free
//   repeat
//     screen                 every candidate, by sensitivities (screening.hpp)
//     refit                  the best few nonlinearly (refit.hpp); pairs where no one explains half
//                            or the best one has many numbers
//     accept                 the one with the largest gain on held-out laps, if it is enough
//     converge, drop test    all together; what is no longer needed goes (machine_changes.hpp)
//     try again              with what was found, and with shapes that show now (trial_pool.hpp)
//     exchange               each one taken out, all candidates and declared numbers compete; two
//                            of one place, and one that does as much (exchange.hpp)
//   begin otherwise          where much is left: with another of the first contenders
//
// Where names leave more than a tenth, a law without a name (generic_laws.hpp) is fitted alone. The
// search ends where that leaves less than a tenth, explains twice as much as the names (or as much
// as three of them) or more: nothing in the library is the cause, more names would only imitate it.
//
// A gain is chi-square on held-out laps (whose expectation is their number of samples when nothing
// but noise is left) and of the priors of the declared numbers. It must exceed 25 and 2 % of the
// excess (10 % between two runs, half beside another of its drive), and be found under two
// conditions if the effect shows under two. Candidates that do as well as the best one within 30
// and 5 % of what remains are equivalent to it on this record.
//
// What found effects explain is never known better than to half a percent: of what a further effect
// gains in a channel only that counts which exceeds 0.5 % of what they explain there, but for what
// is gained while none of them does anything.
//
// Of candidates that do as well as the best one, that with the fewest numbers of the most usual
// size stands for all.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/laws/generic_laws.hpp"
#include "diagnosis/screening/screening.hpp"
#include "diagnosis/selection/limits_beside.hpp"

namespace vcnc {

struct DiagnosisProgress {
  std::string doing;  ///< "screening 212 candidates"
  double share = 0;   ///< of this step
};
/// Called now and then; false stops the work, what was found is kept.
using KeepGoing = std::function<bool(const DiagnosisProgress&)>;

/// What is left after an addition.
struct LadderStep {
  std::string name;
  double held_out = 0;      ///< chi-square
  std::vector<double> rms;  ///< held-out, per channel [SI]
};

struct SelectionResult {
  FittedMachine base, found;
  double floor = 0;                ///< what noise leaves of held-out chi-square
  std::vector<LadderStep> ladder;  ///< one per addition
  std::vector<TrialColumns> trials;
  std::vector<double> release_limits;        ///< of the nuisances of `base`
  std::optional<LimitsBeside> beside_found;  ///< where something was found
  std::optional<LawFit> law_alone;           ///< of `base`, where it was looked for
  bool interrupted = false;
};

SelectionResult select_effects_of(Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const DiagnosisOptions& options, const KeepGoing& keep_going);

/// Held-out chi-square that noise and the form of the model make: one per sample and the form's,
/// less where a channel is quieter than that.
std::vector<double> noise_floor(const Evidence& evidence, const Column& residual,
                                const std::vector<double>& form_of_channel = {});

}  // namespace vcnc
