// What a gain is worth where a machine by hypothesis leaves so much.
//
// Not all of it counts: what the form of the model may make, or what was found may be wrong by,
// counts for nobody (counted_gain.hpp). Of what counts, so much is asked as the rules of the
// contest say (contest_rules.hpp), and more at a drive where something was found.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "diagnosis/fit/acting_slices.hpp"
#include "diagnosis/fit/counted_gain.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/selection/contender.hpp"
#include "diagnosis/selection/contest_rules.hpp"

namespace vcnc {

class Appraisal {
 public:
  /// Both must outlive this.
  Appraisal(const ContestRules& rules, const FittedMachine& now);
  Appraisal(const Appraisal&) = delete;  // the ground refers to the columns of this one

  const ContestRules& rules() const { return rules_; }
  const FittedMachine& machine() const { return now_; }
  const LinearPart& linear() const { return linear_; }
  const Ground& ground() const { return ground_; }
  const Doubt& doubt() const { return doubt_; }
  /// Held-out chi-square.
  double held_out() const { return ground_.held_out; }

  /// Gains that differ by less are alike when the best is `gain`.
  double band_of(double gain) const;
  /// What counts of the gain of a contender, or of a machine.
  double counts(const Contender& contender) const;
  double counts(const FittedMachine& machine) const;
  /// The same of a gain that leaves `after` of the channels, and `left()` of all samples.
  double counts(double gain, const std::vector<double>& after,
                const std::function<Column()>& left) const;
  /// Whether it counts by samples: at some of them nothing of what was found does anything.
  bool by_samples() const { return !at_rest_.empty(); }

  /// What must count for a contender to be told, or for candidates that leave `after` together.
  double needed_of(const Contender& contender) const;
  double needed_of(const std::vector<std::size_t>& together,
                   const std::vector<double>& after) const;
  /// Whether what counts is enough for the candidate to be told that the machine has besides.
  bool counts_enough(const FittedMachine& machine, std::size_t candidate) const;
  bool under_two_conditions(const Contender& contender) const;

  /// Keys of those numbers of an effect, with their columns, that may as well be as declared.
  std::set<std::string> needless_among(const std::vector<FreedNumber>& numbers,
                                       const std::vector<Column>& columns, double gain) const;
  void find_needless(Contender& contender) const;

 private:
  bool any_at_rest() const;
  /// What must count of what is at the drives of some axes.
  double needed_at(const std::set<std::string>& drives, const std::vector<double>& after) const;

  const ContestRules& rules_;
  const FittedMachine& now_;
  LinearPart linear_;
  Ground ground_;
  Doubt doubt_, doubt_anywhere_;      ///< of all, and of what has nothing to do with what was found
  std::vector<ActingSlices> acting_;  ///< of what was found
  std::vector<double> at_rest_;       ///< held-out chi-square while none of it acts
};

}  // namespace vcnc
