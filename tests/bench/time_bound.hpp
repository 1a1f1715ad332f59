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

#include <vector>

#include "controller/path.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// [s], with `steps_per_width` grid points in the half width of the path's rounding.
double time_bound(const Path& path, const Machine& machine, double steps_per_width = 24);

/// Straight moves, each run from rest to rest as fast as velocity, acceleration and jerk (no jerk
/// limit: false) of the axes and the feed allow [s]; closed form.
double time_with_stops(const std::vector<Move>& moves, const Machine& machine, bool with_jerk);

/// The same without a jerk limit, neighbours overlapping as in LinuxCNC's trapezoidal planner under
/// G64 P (emc/tp/tp.c): a move begins when the one before, braking, has reached
///   v = 2 sqrt(a P / cos theta),   2 theta: angle that the path leaves at the corner.
double trapezoid_time(const std::vector<Move>& moves, const Machine& machine);

}  // namespace vcnc
