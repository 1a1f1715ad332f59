// The values of a law by its columns, to first order.
#pragma once

#include <Eigen/Dense>
#include <deque>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/laws/law_columns.hpp"
#include "diagnosis/laws/law_knots.hpp"

namespace vcnc {

struct LinearLaw {
  double gain = 0;  ///< held-out chi-square
  Eigen::VectorXd value;
};

/// `columns`: of a law's knots; all numbers of the ground go along.
LinearLaw fit_law(const Evidence& evidence, const Ground& ground,
                  const std::vector<Column>& columns);

/// Standard deviations of the values, with G_c the products of the columns in the channel c and
/// n_c samples,
///
///   cov = G^-1 (sum_c max(1, chi2_c / n_c) G_c) G^-1
///
/// so that what a law leaves in a channel counts as noise there. As if it were white: what ten hats
/// cannot draw is known less well than that.
Eigen::VectorXd deviations_of_law(const Evidence& evidence, const Ground& ground,
                                  const std::vector<Column>& columns);

/// What a law would gain with narrower hats besides its own; columns and products are computed
/// once.
class GainWithHats {
 public:
  /// All must live as long.
  GainWithHats(const Evidence& evidence, const Ground& ground, const LawColumns& columns,
               const Law& law);
  double operator()(const std::vector<Hat>& hats);

 private:
  void learn(const std::vector<Hat>& hats);
  void take(std::vector<Column> fresh);

  const Evidence& evidence_;
  const Ground& ground_;
  const LawColumns& of_;
  Law law_;
  std::vector<Hat> hats_;
  std::deque<Column> columns_;  ///< of the law's own knots, then of the hats
  RoleGrams across_, among_;
};

}  // namespace vcnc
