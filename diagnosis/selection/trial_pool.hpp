// What candidates do, tried on the machine at hand: the trials that contests are about.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/screening/detection_limits.hpp"
#include "diagnosis/screening/trial_values.hpp"
#include "diagnosis/selection/contest_rules.hpp"

namespace vcnc {

class TrialPool {
 public:
  /// All must outlive this; `rules.trials` are what this fills. `base`: before anything was found.
  TrialPool(const ContestRules& rules, const Machine& declared, const FittedMachine& base)
      : rules_(rules), declared_(declared), base_(base) {}

  /// All candidates at the base machine, with their detection limits.
  void simulate(const Needed& needed);
  /// What was simulated at the base machine, and nothing else.
  void begin_again();
  /// What an effect of a drive does depends on the others that it has (play rattles where nothing
  /// rubs): of axes at whose drive something was found, trials are simulated anew with that, and
  /// all of them where a probe was found to tell nothing for a while. And a large effect hides the
  /// waves of a small one: shapes that only show now are tried as well.
  void look_again(const FittedMachine& now);

 private:
  /// Adds trials with shapes that no residual showed before, and with those that were found.
  void try_shapes_that_show(const FittedMachine& now);
  /// Trials with these values, but for those of numbers that go along in every fit.
  std::vector<Trial> worth_trying(const TrialValuesOf& values) const;
  std::vector<TrialColumns> simulated_with(const FittedMachine& m, std::vector<Trial> which,
                                           const std::string& doing) const;
  /// A drive whose axis never moves shows nothing of its servo, friction or mechanics; of one that
  /// vibrates by itself nothing can be compared.
  bool asleep(const Candidate& candidate) const;
  double worth_of_line() const;

  const ContestRules& rules_;
  const Machine& declared_;
  const FittedMachine& base_;
  std::vector<TrialColumns> at_base_;  ///< the trials of the base machine
  std::vector<TrialColumns> known_;    ///< and those with shapes that showed later
  std::vector<TrialValuesOf> values_;  ///< what at_base_ and then known_ were made with
};

}  // namespace vcnc
