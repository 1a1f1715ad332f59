// Which candidates could explain a residual: by their sensitivities through the closed loop.
//
// Every direction of every trial is simulated once from a base machine. Its whitened columns C and
// those of the numbers that go along, N, are fitted to the residual of the fitted laps together;
// what that leaves on the held-out laps against N alone is the gain of the candidate.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/evidence/packed_column.hpp"
#include "diagnosis/fit/counted_gain.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/refit.hpp"
#include "diagnosis/screening/consequence.hpp"

namespace vcnc {

/// Products of some columns with others, remembered by the other column.
class RememberedProducts {
 public:
  /// Computes what is not known yet of `columns` with `others`, and forgets all else.
  void learn(const Evidence& evidence, const std::vector<const Column*>& others,
             const std::vector<PackedColumn>& columns);
  const RoleGrams& products() const { return products_; }  ///< of what was learnt last

 private:
  std::vector<Column> others_;  ///< of each row
  RoleGrams products_;
};

/// A trial with the columns of its directions, per step.
struct TrialColumns {
  Trial trial;
  std::vector<PackedColumn> columns;
  std::vector<Consequence> consequence;  ///< of each direction, per step
  RoleGrams own;                         ///< products of the columns with each other
  RememberedProducts ground;
  /// Of its first number; where that is a limit, the limit itself if it would be seen.
  double detection_limit = std::numeric_limits<double>::infinity();  ///< see detection_limits.hpp
  std::size_t shows_first = 0;   ///< the direction that it is the limit of
  double later_than_linear = 1;  ///< what it was taken higher by
};

struct Screened {
  std::size_t trial = 0;  ///< index into the columns
  double gain = 0;        ///< held-out chi-square
  double counted = 0;     ///< the part that counts
  Eigen::VectorXd size;   ///< per direction, in steps
};

/// Simulates all trials from `base`. `keep_going` is asked now and then; where it says no, the rest
/// stays without columns.
std::vector<TrialColumns> simulate_trials(const Evidence& evidence, const Machine& base,
                                          const Prediction& prediction,
                                          const std::vector<Candidate>& candidates,
                                          std::vector<Trial> trials,
                                          const std::function<bool(double)>& keep_going);

/// Gains of all trials on a residual, best first.
std::vector<Screened> screen(const Evidence& evidence, const Ground& ground, const Doubt& doubt,
                             const std::vector<Candidate>& candidates,
                             std::vector<TrialColumns>& trials);

/// The residual less what a trial that was screened on this ground explains of it.
Column left_by(const Ground& ground, const TrialColumns& trial);

/// Of two trials together that were screened on this ground.
Screened screen_pair(const Evidence& evidence, const Ground& ground, const Doubt& doubt,
                     const TrialColumns& first, const TrialColumns& second);

}  // namespace vcnc
