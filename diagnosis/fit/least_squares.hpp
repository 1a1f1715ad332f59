// Nonlinear least squares in a few numbers, with bounds and priors (Levenberg-Marquardt by Ceres).
//
// The residuals may be millions; the solver is only ever given their products with the Jacobian.
// With J'J = L L' it works on the k + 1 residuals [L^-1 J'r; sqrt(r'r - |L^-1 J'r|^2)] and the
// Jacobian [L'; 0], which have the same cost, gradient and normal equations as the full ones.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace vcnc {

/// Sum of squares at a point, and its linearisation r + J d there.
struct Linearisation {
  double cost = 0;           ///< r'r
  Eigen::VectorXd gradient;  ///< J'r; empty unless asked for
  Eigen::MatrixXd gram;      ///< J'J; empty unless asked for
};

struct LeastSquaresProblem {
  Eigen::VectorXd start, min, max;
  std::function<Linearisation(const Eigen::VectorXd& x, bool with_derivatives)> evaluate;
  bool cautious = false;  ///< begins with short steps: far from linear
  int max_iterations = 12;
  double cost_tolerance = 1e-5;  ///< relative change of the cost at which it is content
  /// Above this at the start, it stays there.
  double hopeless_cost = std::numeric_limits<double>::infinity();
};

struct LeastSquaresSolution {
  Eigen::VectorXd x;
  double cost = 0;
  bool converged = false;
  int evaluations = 0;
};

LeastSquaresSolution solve(const LeastSquaresProblem& problem);

}  // namespace vcnc
