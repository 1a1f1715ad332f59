// What a hypothesis leaves, as further effects are held against it.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {

/// A residual with the numbers that go along, and the products of
/// all of these.
struct Ground {
  Ground(const Evidence& evidence, const Column& residual, const LinearPart& linear);

  std::vector<const Column*> columns;  ///< the residual, then those of the linear numbers
  RoleGrams grams;
  Eigen::VectorXd precision, offset;
  Eigen::VectorXd step;             ///< of the linear numbers
  double fitted = 0, held_out = 0;  ///< chi-square with priors, the linear numbers fitted
  std::vector<double> held_out_of;  ///< of it per channel, without priors
};

}  // namespace vcnc
