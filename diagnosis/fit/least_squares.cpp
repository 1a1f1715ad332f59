#include "diagnosis/fit/least_squares.hpp"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

/// Within the bounds: a step ends at them, and a number that would leave them stays.
/// Ceres' own bounds search along every step that meets one, at the price of many linearisations.
class Box : public ceres::Manifold {
 public:
  explicit Box(const LeastSquaresProblem& problem) : problem_(problem) {}

  int AmbientSize() const override { return static_cast<int>(problem_.start.size()); }
  int TangentSize() const override { return AmbientSize(); }

  bool Plus(const double* x, const double* step, double* to) const override {
    vector(to) = (vector(x) + vector(step)).cwiseMax(problem_.min).cwiseMin(problem_.max);
    return true;
  }
  bool Minus(const double* y, const double* x, double* step) const override {
    vector(step) = vector(y) - vector(x);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override { return identity(jacobian); }
  bool MinusJacobian(const double*, double* jacobian) const override { return identity(jacobian); }

 private:
  Eigen::Map<const Eigen::VectorXd> vector(const double* x) const { return {x, AmbientSize()}; }
  Eigen::Map<Eigen::VectorXd> vector(double* x) const { return {x, AmbientSize()}; }
  bool identity(double* jacobian) const {
    Eigen::Map<Eigen::MatrixXd>(jacobian, AmbientSize(), AmbientSize()).setIdentity();
    return true;
  }

  const LeastSquaresProblem& problem_;
};

/// The k + 1 residuals of the header.
class Compressed : public ceres::CostFunction {
 public:
  Compressed(const LeastSquaresProblem& problem, int& evaluations)
      : problem_(problem), evaluations_(evaluations) {
    const int k = static_cast<int>(problem.start.size());
    set_num_residuals(k + 1);
    mutable_parameter_block_sizes()->push_back(k);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const Eigen::Index k = problem_.start.size();
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    ++evaluations_;
    const Linearisation at =
        problem_.evaluate(Eigen::Map<const Eigen::VectorXd>(x[0], k), derivatives);
    if (!std::isfinite(at.cost)) return false;
    Eigen::Map<Eigen::VectorXd> r(residuals, k + 1);
    r.setZero();
    if (!derivatives) {
      r[k] = std::sqrt(std::max(0.0, at.cost));
      return true;
    }
    // A number without influence gets a pivot too small to matter.
    Eigen::MatrixXd gram = at.gram;
    gram.diagonal().array() += 1e-12 * (1 + gram.diagonal().maxCoeff());
    const Eigen::LLT<Eigen::MatrixXd> factor(gram);
    if (factor.info() != Eigen::Success) return false;
    r.head(k) = factor.matrixL().solve(at.gradient);
    r[k] = std::sqrt(std::max(0.0, at.cost - r.head(k).squaredNorm()));
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor> jacobian(jacobians[0], k + 1, k);
    jacobian.setZero();
    jacobian.topRows(k) = Eigen::MatrixXd(factor.matrixU());
    for (Eigen::Index i = 0; i < k; ++i)
      if (at.gradient[i] > 0 ? x[0][i] <= problem_.min[i] : x[0][i] >= problem_.max[i])
        jacobian.col(i).setZero();
    return true;
  }

 private:
  const LeastSquaresProblem& problem_;
  int& evaluations_;
};

/// Ends a search after a step in vain that was nearly of Gauss-Newton's length, or after some.
class InVain : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& i) override {
    if (i.iteration == 0) return ceres::SOLVER_CONTINUE;
    steps_ = i.step_is_successful ? 0 : steps_ + 1;
    const bool long_step = steps_ > 0 && i.trust_region_radius > kLong;
    return long_step || given_up() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool given_up() const { return steps_ >= kMost; }

 private:
  static constexpr double kLong = 10;
  static constexpr int kMost = 4;  ///< of 1, 1/2, 1/3 and 1/9 of the length
  int steps_ = 0;                  ///< in vain, one after the other
};

}  // namespace

LeastSquaresSolution solve(const LeastSquaresProblem& problem) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // a search that fails is not the user's concern
  LeastSquaresSolution solution;
  solution.x = problem.start.cwiseMax(problem.min).cwiseMin(problem.max);
  if (solution.x.size() == 0) {
    solution.cost = problem.evaluate(solution.x, false).cost;
    solution.converged = true;
    return solution;
  }
  if (std::isfinite(problem.hopeless_cost)) {
    ++solution.evaluations;
    solution.cost = problem.evaluate(solution.x, false).cost;
    if (solution.cost > problem.hopeless_cost) return solution;
  }
  ceres::Problem ceres_problem;
  double* x = solution.x.data();
  ceres_problem.AddResidualBlock(new Compressed(problem, solution.evaluations), nullptr, x);
  ceres_problem.SetManifold(x, new Box(problem));
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = problem.cost_tolerance;
  options.parameter_tolerance = 1e-7;
  options.gradient_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  InVain in_vain;
  options.callbacks.push_back(&in_vain);
  // Of columns scaled to one: start as Gauss-Newton, or half as far. What Ceres shortens a step in
  // vain by is next to nothing at such a radius, so the next one begins half as far, too.
  constexpr double kGaussNewton = 1e6, kHalfAsFar = 1;
  options.initial_trust_region_radius = problem.cautious ? kHalfAsFar : kGaussNewton;
  options.max_num_iterations = problem.max_iterations;
  ceres::Solver::Summary summary;
  do {
    ceres::Solve(options, &ceres_problem, &summary);
    options.initial_trust_region_radius = kHalfAsFar;
    options.max_num_iterations -= static_cast<int>(summary.iterations.size()) - 1;
  } while (summary.termination_type == ceres::USER_SUCCESS && !in_vain.given_up() &&
           options.max_num_iterations > 0);
  solution.cost = 2 * summary.final_cost;
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  return solution;
}

}  // namespace vcnc
