// The shortest time in which a path can be run through when jerk costs nothing: a lower bound for
// every planner on this path.
//
// With b = v^2 and u = dv/dt, both along s, db/ds = 2 u, and at every grid point
//   |q'| sqrt(b) <= V,   sqrt(b) <= feed limit,   |q'' b + q' u| <= A    for every axis.
// A backward pass finds the largest b from which the rest of the path can be finished, a forward
// pass then takes the largest u that stays below it. u is constant between grid points. Source:
// Pham, Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis,
// IEEE Transactions on Robotics 34 (2018). The constraints are held at the grid points alone, so on
// a coarse grid the result is too small rather than too large.
#pragma once

#include "controller/path.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// [s], with `steps_per_width` grid points in the half width of the path's rounding.
double time_bound(const Path& path, const Machine& machine, double steps_per_width = 24);

}  // namespace vcnc
