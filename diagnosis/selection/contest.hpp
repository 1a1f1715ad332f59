// Candidates against each other: which of them explains best what a fitted machine leaves?
//
// Screened ones (screening.hpp) that gain enough are refitted nonlinearly, a few iterations each;
// those that may yet be the best are converged. A declared number whose tolerance is lifted
// competes with them, and so do pairs, also with such a number, where no single one explains half
// or the best has many numbers. See selection.hpp for what
// is asked of a gain.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/screening/screening.hpp"

namespace vcnc {

inline constexpr double kAsGood = 0.99;   ///< part of a gain that is as much before all is fitted
inline constexpr double kNearLoss = 0.8;  ///< part of what an effect is worth, promised by a rival
/// Of what is left: what a further effect than few must gain, or another one in place of one.
inline constexpr double kHalf = 0.5;
inline constexpr double kClearlySimpler = 0.5;  ///< numbers

/// What a candidate came to.
struct Contender {
  std::size_t candidate = 0;
  Machine begun;  ///< what is refitted: the machine so far, with the whole numbers of the trials
  std::vector<FreedNumber> numbers;
  std::set<std::string> needless;  ///< keys of those that may be as declared (needed_numbers.hpp)
  Refit fit;
  double gain = 0;
  double counts = 0;     ///< what of the gain counts (counted_gain.hpp)
  std::string released;  ///< key of a declared number whose tolerance is lifted; else empty
  double needed = 0;     ///< what it must gain to be told
  bool converged = false;

  /// What counts less what further numbers give by chance.
  double worth() const { return counts - 4 * static_cast<double>(numbers.size()); }
};

/// Whether a declared number may be told to be out of its tolerance.
bool may_be_released(const DiagnosisOptions& options, const FreedNumber& number);

/// Those that count most first: what the form of the model may make does not count, however much it
/// is (counted_gain.hpp).
std::vector<Screened> by_what_counts(std::vector<Screened> screened);

/// Of candidates, by what counts, those worth a refit: the first ones, and of every family a few.
std::vector<Screened> worth_a_refit(const std::vector<Screened>& screened,
                                    const DiagnosisOptions& options,
                                    const std::function<Family(const Screened&)>& family_of);

/// What every contest of a diagnosis has in common.
struct ContestRules {
  const Evidence& evidence;
  const std::vector<Candidate>& candidates;
  const DiagnosisOptions& options;
  std::vector<TrialColumns>& trials;
  std::vector<double> base_of;   ///< held-out chi-square per channel before anything was found
  double floor = 0;              ///< what noise leaves of held-out chi-square
  std::vector<double> floor_of;  ///< of it per channel
  /// Told what is done and how far it is; false: stopped, and the next prediction throws Stopped.
  std::function<bool(const std::string&, double)> go;

  double excess(double held_out) const;
  /// What a candidate must gain where so much is left.
  double threshold(double held_out) const;
  /// The same of one that takes the channels from `before` to `after`: only what is left where it
  /// gains something is its concern.
  double threshold(const std::vector<double>& before, const std::vector<double>& after) const;
  /// What is left beyond the floor where something is gained from `before` to `after`.
  double left_where_gained(const std::vector<double>& before,
                           const std::vector<double>& after) const;
  /// Whether what it explains is there at all: whatever repeats makes the residual larger than what
  /// laps differ by.
  bool stands_out(const std::vector<double>& before, const std::vector<double>& after) const;
};

class Contest {
 public:
  Contest(const ContestRules& rules, const FittedMachine& now);

  /// Those that gain enough, best first.
  std::vector<Contender> contenders();
  /// Candidates that do as well as the first of the contenders.
  std::vector<std::size_t> equivalents(const std::vector<Contender>& contenders) const;
  /// The candidates but one that may gain `least`, refitted, and declared numbers that do; best
  /// first.
  std::vector<Contender> rivals(double least, std::size_t but) const;
  /// Whether a declared number does as well as an effect that gains `gain`, and says less.
  bool says_it_simpler(const Contender& rival, const AddedEffect& effect, double gain) const;
  /// Whether an effect of a usual size does as well as a declared number, which gains `gain`, and
  /// that is as far off as hardly any is.
  bool is_more_usual(const Contender& rival, const FreedNumber& number, double gain) const;

  /// Keys of those numbers of an effect, with their columns, that may as well be as declared.
  std::set<std::string> needless_among(const std::vector<FreedNumber>& numbers,
                                       const std::vector<Column>& columns, double gain) const;

  /// How much it says: numbers that are something, and more where one is of an unusual size.
  double intricacy(const AddedEffect& effect) const;
  double intricacy(const Contender& contender) const;
  /// Of a declared number out of tolerance.
  static double intricacy(const FreedNumber& declared);

  /// Gains that differ by less are alike when the best is `gain`.
  double band_of(double gain) const;
  double held_out() const { return ground_.held_out; }
  /// What counts of the gain of a machine (counted_gain.hpp).
  double counts(const FittedMachine& machine) const;
  /// Whether that is enough for the candidate to be told that the machine has besides.
  bool counts_enough(const FittedMachine& machine, std::size_t candidate) const;

 private:
  double counts(const Contender& contender) const;
  /// The same of a gain that leaves `after` of the channels, and `left()` of all samples.
  double counts(double gain, const std::vector<double>& after,
                const std::function<Column()>& left) const;
  bool any_at_rest() const;
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
  enum class Released { where_pulled, anywhere };
  std::vector<Contender> releases(Released which, double as_much) const;
  void refit_released(std::vector<Contender>& all, double least) const;
  double numbers_of_two(const std::vector<Contender>& all) const;
  std::vector<TrialColumns> lifted() const;
  bool is_out_of_tolerance(const std::vector<FreedNumber>& numbers) const;
  void look_ahead(const std::vector<Screened>& screened, double numbers,
                  std::vector<Contender>& all) const;
  void find_needless(Contender& contender) const;
  void put_simplest_first(std::vector<Contender>& all) const;
  bool under_two_conditions(const Contender& contender) const;
  double needed_of(const Contender& contender) const;
  /// The same of candidates that leave `after` together.
  double needed_of(const std::vector<std::size_t>& together,
                   const std::vector<double>& after) const;
  /// The same of what is at the drives of some axes.
  double needed_at(const std::set<std::string>& drives, const std::vector<double>& after) const;
  std::size_t candidate_of(const Screened& s) const;

  const ContestRules& rules_;
  const FittedMachine& now_;
  LinearPart linear_;
  Ground ground_;
  Doubt doubt_, doubt_anywhere_;      ///< of all, and of what has nothing to do with what was found
  std::vector<ActingSlices> acting_;  ///< of what was found
  std::vector<double> at_rest_;       ///< held-out chi-square while none of it acts
};

}  // namespace vcnc
