// Candidates against each other: which of them explains best what a fitted machine leaves?
//
// Screened ones (screening.hpp) that gain enough are refitted nonlinearly, a few iterations each;
// those that may yet be the best are converged. A declared number whose tolerance is lifted
// competes with them, and so do pairs, also with such a number, where no single one explains half
// or the best has many numbers. What is asked of a gain: appraisal.hpp, selection.hpp.
#pragma once

#include <functional>
#include <vector>

#include "diagnosis/screening/screening.hpp"
#include "diagnosis/selection/appraisal.hpp"
#include "diagnosis/selection/contender.hpp"
#include "diagnosis/selection/contest_rules.hpp"

namespace vcnc {

/// Those that count most first: what the form of the model may make does not count, however much it
/// is (counted_gain.hpp).
std::vector<Screened> by_what_counts(std::vector<Screened> screened);

/// Of candidates, by what counts, those worth a refit: the first ones, and of every family a few.
std::vector<Screened> worth_a_refit(const std::vector<Screened>& screened,
                                    const DiagnosisOptions& options,
                                    const std::function<Family(const Screened&)>& family_of);

class Contest {
 public:
  /// Both must outlive this.
  Contest(const ContestRules& rules, const FittedMachine& now) : appraisal_(rules, now) {}

  const Appraisal& appraisal() const { return appraisal_; }
  /// Those that gain enough, best first.
  std::vector<Contender> contenders();
  /// Candidates that do as well as the first of the contenders.
  std::vector<std::size_t> equivalents(const std::vector<Contender>& contenders) const;
  /// The candidates but one that may gain `least`, refitted, and declared numbers that do; best
  /// first.
  std::vector<Contender> rivals(double least, std::size_t but) const;

 private:
  /// Gains of these trials, best first.
  std::vector<Screened> screened_of(std::vector<TrialColumns>& trials) const;
  /// Screened by products of whole channels, counted anew by samples.
  std::vector<Screened> counted_by_samples(std::vector<Screened> screened) const;
  std::vector<Screened> best_of_each(const std::vector<Screened>& trials) const;
  std::vector<Screened> likes_of(const std::vector<Contender>& all,
                                 const std::vector<Screened>& screened,
                                 const std::vector<Screened>& list) const;
  std::vector<Contender> refitted(const std::vector<Screened>& list) const;
  Contender contender(const std::vector<const TrialColumns*>& trials, const Eigen::VectorXd& size,
                      double promised) const;
  void finish(std::vector<Contender>& all) const;
  void begin_elsewhere(Contender& best, const std::vector<Screened>& trials) const;
  double numbers_of_two(const std::vector<Contender>& all) const;
  void look_ahead(const std::vector<Screened>& screened, double numbers,
                  std::vector<Contender>& all) const;
  void put_simplest_first(std::vector<Contender>& all) const;
  std::size_t candidate_of(const Screened& s) const;
  double intricacy_of(const Contender& contender) const;

  Appraisal appraisal_;
  const ContestRules& rules_ = appraisal_.rules();
  const FittedMachine& now_ = appraisal_.machine();
};

}  // namespace vcnc
