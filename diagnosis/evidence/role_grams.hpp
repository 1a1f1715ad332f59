// Products of columns with each other, summed over what is fitted and what is held out.
//
// With G the products of [z, c_1 ... c_n], a step s along the columns leaves
//
//   |z - C s|^2 = G_00 - 2 s' G_c0 + s' G_cc s
#pragma once

#include <Eigen/Dense>
#include <vector>

namespace vcnc {

struct RoleGrams {
  Eigen::MatrixXd fitted, held_out;
  std::vector<Eigen::MatrixXd> fitted_of, held_out_of;  ///< per channel; they add up to the others

  /// What is fitted, every channel with its weight; none given: all 1.
  Eigen::MatrixXd fitted_with(const std::vector<double>& weight) const;

  /// All zero.
  static RoleGrams none(Eigen::Index rows, Eigen::Index cols, std::size_t channels);
};

/// Products of [a, b] with themselves, from those of a, of a with b, and of b.
RoleGrams bordered(const RoleGrams& a, const RoleGrams& across, const RoleGrams& b);
/// Products of columns with each other, from those of some of them, `old`, that stand in `known` in
/// the order of `from`; `fresh`: of the others with all. Indices are those of the result.
RoleGrams completed(const RoleGrams& known, const std::vector<Eigen::Index>& from,
                    const std::vector<Eigen::Index>& old, const RoleGrams& fresh,
                    const std::vector<Eigen::Index>& others);
/// Products of some columns with [a, b].
RoleGrams beside(const RoleGrams& a, const RoleGrams& b);

/// Chi-square that a step leaves, from the products of [z, columns].
double left_after(const Eigen::MatrixXd& products, const Eigen::VectorXd& step);
/// The same for every channel.
std::vector<double> left_after(const std::vector<Eigen::MatrixXd>& products,
                               const Eigen::VectorXd& step);

}  // namespace vcnc
