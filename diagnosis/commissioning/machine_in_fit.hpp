// A declared machine on its way to one that is fitted to a healthy run: what the steps share.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/healthy/controller_check.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// What a gain, an effect of the probe or of the geometry must explain of what is left: less than
/// that is the form of friction or of the contact.
inline constexpr double kShareOfLeft = 0.05;

class MachineInFit {
 public:
  /// Fits nothing yet; the candidates are those of the case and the lags of the loops.
  MachineInFit(const DiagnosisCase& of, const DiagnosisOptions& options);

  const DiagnosisCase& of;
  const DiagnosisOptions& options;
  std::vector<Candidate> candidates;
  Evidence evidence;
  FittedMachine now;               ///< added: what was found on the axis in work
  std::vector<std::string> notes;  ///< what was found, in order

  /// Candidates by the names of their effects, in this order.
  std::vector<std::size_t> the(const std::vector<std::string>& effects,
                               const std::string& place) const;

  /// A machine with these candidates in its fit, started at what is declared of them.
  FittedMachine with_candidates(const FittedMachine& machine,
                                const std::vector<std::size_t>& chosen) const;

  /// Whether it gains what noise would not, if noise were all that is left in the signals of a
  /// place, and that share of what is more than noise there.
  bool gains_enough(const FittedMachine& than, const FittedMachine& better,
                    const std::string& place, double least_share = 0) const;
  /// Whether some signal is more than noise, of an axis its own ones where it has any.
  bool stands_out(const std::string& place) const;
  /// Whether the last of the added is nothing: what was gained is of the others.
  bool is_as_declared(const FittedMachine& m) const;
  /// Whether the last of the added is a gain of which the controller's signals say that it is not.
  bool stands_for_force(const FittedMachine& m) const;
  /// Of those that leave nearly the least, the first with the fewest numbers.
  std::size_t simplest_of_best(const std::vector<std::size_t>& some,
                               const std::vector<double>& leaves) const;

  void accept(FittedMachine better, const std::string& place, const std::string& chosen);
  /// What was added goes along with every further fit, by its sensitivities.
  void rest();
  /// Everything together, with sensitivities from where it has come to.
  void fit_together();

 private:
  /// Of the held-out chi-square per channel, and what of it is more than noise: of an axis in its
  /// own signals and the readings, else in all.
  struct Left {
    double chi2 = 0, samples = 0, above_noise = 0;
  };
  Left left_in(const std::vector<double>& chi2, const std::string& place) const;

  ControllerCheck controller_;
};

/// In words: an effect, a key, "lag of ...".
std::string told(const Candidate& c);

}  // namespace vcnc
