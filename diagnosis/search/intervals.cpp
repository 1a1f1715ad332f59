#include "diagnosis/search/intervals.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

std::map<std::string, Interval> intervals_of(const Evidence& evidence,
                                             const FittedMachine& machine) {
  constexpr double kNormal95 = 1.96;
  const LinearPart all = machine.linear();
  const auto n = static_cast<Eigen::Index>(all.numbers.size());
  std::map<std::string, Interval> intervals;
  if (n == 0) return intervals;
  std::vector<const Column*> columns{&machine.residual};
  for (const Column& c : all.columns) columns.push_back(&c);
  const BlockGrams blocks = evidence.grams(columns);
  const Eigen::MatrixXd sum = evidence.sum(blocks, Role::fitted);

  Eigen::MatrixXd information = sum.block(1, 1, n, n);
  information.diagonal() += all.precision();
  information.diagonal().array() += 1e-10 * (1e-6 + information.diagonal().array());
  const Eigen::MatrixXd inverse =
      information.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
  const double ratio = std::max(1.0, sum(0, 0) / std::max(1.0, evidence.count(Role::fitted)));

  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  double clusters = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (evidence.partition().blocks[b].held_out) continue;
    const Eigen::VectorXd score = blocks[b].block(1, 0, n, 1);
    meat += score * score.transpose();
    clusters += 1;
  }
  meat *= clusters / std::max(1.0, clusters - static_cast<double>(n));
  meat.diagonal() += all.precision();
  const Eigen::MatrixXd sandwich = inverse * meat * inverse;
  // With few clusters the sandwich is worth nothing.
  const bool enough = clusters > 3 * static_cast<double>(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const FreedNumber& number = all.numbers[static_cast<std::size_t>(i)];
    const double variance = std::max(ratio * inverse(i, i), enough ? sandwich(i, i) : 0.0);
    intervals[number.number.key] = {kNormal95 * std::sqrt(std::max(0.0, variance)) *
                                    number.number.typical};
  }
  return intervals;
}

}  // namespace vcnc
