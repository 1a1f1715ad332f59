#include "diagnosis/evidence/role_grams.hpp"

namespace vcnc {
namespace {

Eigen::MatrixXd bordered(const Eigen::MatrixXd& a, const Eigen::MatrixXd& across,
                         const Eigen::MatrixXd& b) {
  if (b.size() == 0) return a;
  Eigen::MatrixXd all(a.rows() + b.rows(), a.cols() + b.cols());
  all << a, across, across.transpose(), b;
  return all;
}

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

}  // namespace

Eigen::MatrixXd RoleGrams::fitted_with(const std::vector<double>& weight) const {
  if (weight.empty()) return fitted;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(fitted.rows(), fitted.cols());
  for (std::size_t c = 0; c < fitted_of.size(); ++c) sum += weight[c] * fitted_of[c];
  return sum;
}

RoleGrams RoleGrams::none(Eigen::Index rows, Eigen::Index cols, std::size_t channels) {
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(rows, cols);
  const std::vector<Eigen::MatrixXd> zeros(channels, zero);
  return {zero, zero, zeros, zeros};
}

RoleGrams bordered(const RoleGrams& a, const RoleGrams& across, const RoleGrams& b) {
  if (b.fitted.size() == 0) return a;
  RoleGrams all{bordered(a.fitted, across.fitted, b.fitted),
                bordered(a.held_out, across.held_out, b.held_out),
                {},
                {}};
  for (std::size_t c = 0; c < a.held_out_of.size(); ++c) {
    all.fitted_of.push_back(bordered(a.fitted_of[c], across.fitted_of[c], b.fitted_of[c]));
    all.held_out_of.push_back(bordered(a.held_out_of[c], across.held_out_of[c], b.held_out_of[c]));
  }
  return all;
}

RoleGrams completed(const RoleGrams& known, const std::vector<Eigen::Index>& from,
                    const std::vector<Eigen::Index>& old, const RoleGrams& fresh,
                    const std::vector<Eigen::Index>& others) {
  const auto n = static_cast<Eigen::Index>(old.size() + others.size());
  RoleGrams all = RoleGrams::none(n, n, known.fitted_of.size());
  const auto complete = [&](Eigen::MatrixXd& to, const Eigen::MatrixXd& k,
                            const Eigen::MatrixXd& f) {
    to(old, old) = k(from, from);
    to(others, Eigen::all) = f;
    to(Eigen::all, others) = f.transpose();
  };
  complete(all.fitted, known.fitted, fresh.fitted);
  complete(all.held_out, known.held_out, fresh.held_out);
  for (std::size_t c = 0; c < known.fitted_of.size(); ++c) {
    complete(all.fitted_of[c], known.fitted_of[c], fresh.fitted_of[c]);
    complete(all.held_out_of[c], known.held_out_of[c], fresh.held_out_of[c]);
  }
  return all;
}

RoleGrams beside(const RoleGrams& a, const RoleGrams& b) {
  RoleGrams both{beside(a.fitted, b.fitted), beside(a.held_out, b.held_out), {}, {}};
  for (std::size_t c = 0; c < a.held_out_of.size(); ++c) {
    both.fitted_of.push_back(beside(a.fitted_of[c], b.fitted_of[c]));
    both.held_out_of.push_back(beside(a.held_out_of[c], b.held_out_of[c]));
  }
  return both;
}

double left_after(const Eigen::MatrixXd& g, const Eigen::VectorXd& step) {
  const Eigen::Index n = step.size();
  return g(0, 0) - 2 * step.dot(g.block(1, 0, n, 1).col(0)) + step.dot(g.block(1, 1, n, n) * step);
}

std::vector<double> left_after(const std::vector<Eigen::MatrixXd>& products,
                               const Eigen::VectorXd& step) {
  std::vector<double> left;
  for (const Eigen::MatrixXd& g : products) left.push_back(left_after(g, step));
  return left;
}

}  // namespace vcnc
