// Which numbers of an effect a record asks for.
//
// Where two numbers move the same, neither is known: the tilt of a guide whose own axis stands
// moves a tool as the place of the piece does, and both may be fitted far off their declaration,
// taking each other back. With all others fitted again, a number that is as declared, instead of x
// off it, costs
//
//   chi2 - least = x^2 / (H^-1)_ii        H: information of all numbers, priors included
//
// of chi-square, and moves each other number j by -x (H^-1)_ji / (H^-1)_ii: conditioning of a
// normal distribution (Rasmussen, Williams, Gaussian Processes for Machine Learning, A.2).
#pragma once

#include <Eigen/Dense>
#include <set>
#include <string>
#include <vector>

#include "diagnosis/candidates/freed_number.hpp"

namespace vcnc {

/// Indices, in ascending order, of those of `may_go` that may be as declared for less than `cost`
/// together: one after the other, the cheapest first, and never all of them. `off` [n]: distances
/// from the declarations, `information` [n x n], positive definite, in the same units.
std::vector<Eigen::Index> needless(const Eigen::MatrixXd& information, Eigen::VectorXd off,
                                   std::vector<Eigen::Index> may_go, double cost);

/// The same of the amplitudes of `effect`, by key: `all` are the numbers of the information, in
/// their typical sizes, those of the effect among them.
std::set<std::string> needless_of(const std::vector<FreedNumber>& effect,
                                  const std::vector<FreedNumber>& all,
                                  const Eigen::MatrixXd& information, const Machine& declared,
                                  double cost);

}  // namespace vcnc
