// The best values of a few numbers with all others along.
//
// `live` numbers are simulated; `linear` ones (nuisances, effects found before) move along their
// columns and are eliminated exactly (variable projection: Golub & Pereyra 1973):
//
//   min over x, d of |z(x) - N d|^2 + (o + d)' P (o + d)
//
// with o the present distance of the linear numbers from their declaration and P their precision.
// No number of a tolerance is taken further than kFarthestPull of them off its declaration: where
// something is missing, sensitivities would point to numbers that only cancel each other.
#pragma once

#include <Eigen/Dense>
#include <limits>
#include <vector>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/least_squares.hpp"

namespace vcnc {

/// Tolerances that a declared number is believed to be off at most; one that is further off is
/// released, or competes as an effect.
inline constexpr double kFarthestPull = 6;

/// Numbers with the columns d yhat / d number, per typical size.
struct LinearPart {
  std::vector<FreedNumber> numbers;
  std::vector<Column> columns;

  Eigen::VectorXd precision() const;
  Eigen::VectorXd offset() const;  ///< from the declaration, in typical sizes
};

/// Less the numbers that are moved otherwise.
LinearPart without(const LinearPart& part, const std::vector<FreedNumber>& live);

/// A step along columns and what it leaves.
struct LinearStep {
  Eigen::VectorXd step;  ///< in typical sizes
  double fitted = 0;     ///< chi-square with priors
  double held_out = 0;
};

/// Products of [z, columns] summed over the fitted and the held-out blocks. `damping`: see
/// RefitOptions.
LinearStep linear_step(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& held_out,
                       const Eigen::VectorXd& precision, const Eigen::VectorXd& offset,
                       double damping = 0);

/// The same where numbers stay within what is allowed of them, too.
LinearStep step_within_range(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& held_out,
                             const std::vector<FreedNumber>& numbers, double damping);

/// Part of the way from some numbers to others, or beyond, within what is allowed of them.
std::vector<FreedNumber> between(const std::vector<FreedNumber>& from, std::vector<FreedNumber> to,
                                 double share);

struct Refit {
  std::vector<FreedNumber> live, linear;  ///< at the solution
  Machine machine;                        ///< with both
  double fitted = 0, held_out = 0;        ///< chi-square with priors
  Column residual;                        ///< with the live numbers, the linear ones as they were
  std::vector<Column> columns;            ///< of the live numbers at the solution
  Eigen::VectorXd linear_step;            ///< of the linear numbers, in typical sizes
  std::vector<double> held_out_of;        ///< chi-square per channel, without priors
};

/// How a search begins: as sensitivities tell, or with short steps where shapes are far off.
enum class Begin { near, far };

struct RefitOptions {
  int max_iterations = 12;
  Begin begin = Begin::near;
  std::vector<double> weight = {};  ///< of each channel's chi-square in what is made least; none: 1
  /// Times what a linear number's own curvature counts more, so that numbers whose columns nearly
  /// cancel each other do not take long steps that only sensitivities believe in (Levenberg 1944,
  /// Marquardt 1963).
  double damping = 0;
  /// A chi-square from which no search begins.
  double hopeless = std::numeric_limits<double>::infinity();
};

Refit refit(const Evidence& evidence, const Machine& start, const std::vector<FreedNumber>& live,
            const LinearPart& linear, const RefitOptions& options = {});

/// Forward differences of a prediction with respect to some numbers, per typical size.
std::vector<Column> columns_of(const Evidence& evidence, const Machine& machine,
                               const Prediction& base, const std::vector<FreedNumber>& numbers);

}  // namespace vcnc
