// The fastest run along a motion that is already known as q(tau): where it can be quicker, and
// where it has to be slower, with velocity, acceleration and jerk of every axis within limits.
//
// With d tau / dt = sqrt(c(tau)):
//   dq/dt   = q' sqrt(c)
//   d2q/dt2 = q'' c + q' c' / 2
//   d3q/dt3 = (q''' c + 3/2 q'' c' + q' c'' / 2) sqrt(c)
// c is a cubic B-spline on a grid of equal steps in tau, and the limits hold at the grid points:
//   minimise  sum 1 / sqrt(c)   subject to   c <= u,   |q'' c + q' c' / 2| <= A,
//                                            |q''' c + 3/2 q'' c' + q' c'' / 2| <= J / sqrt(c)
// The last one is the only one that is not convex. The problem is solved by Newton's method on a
// logarithmic barrier, without the curvature of 1 / sqrt(c) in the constraint (Gauss-Newton), which
// makes the matrix positive definite; it has five diagonals, so a step costs the same for every
// grid point. Limits that the motion exceeds to begin with are widened to what it needs and drawn
// in step by step. The point found is a local optimum.
//
// Because q itself starts and ends smoothly at rest, c stays finite there; with c a function of the
// length along the path, as in the sources, its second derivative is not.
// Sources: Verscheure et al., Time-Optimal Path Tracking for Robots: A Convex Optimization
// Approach, IEEE TAC 54 (2009), for the squared speed as unknown; Dong, Ferreira, Stori, Feed-rate
// optimization with jerk constraints, Int. J. Machine Tools & Manufacture 47 (2007), for the jerk;
// Boyd, Vandenberghe, Convex Optimization, ch. 11, for the barrier.
#pragma once

#include <array>
#include <vector>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

/// One grid point; everything per unit of its limit, derivatives per step of the grid. Second and
/// third derivatives as the least and the largest around it.
struct WarpNode {
  double c_max = 1;             ///< u: from velocities and the feed
  Coordinates a0_low, a0_high;  ///< q'' / A
  Coordinates a1;               ///< q' / (2 A)
  Coordinates j0_low, j0_high;  ///< q''' / J
  Coordinates j1, j2;           ///< 3 q'' / (2 J),  q' / (2 J)

  double use() const;  ///< largest share of a limit with c = 1
  /// The limits really are used `ratio` times (velocity, acceleration, jerk) with c = 1.
  void exceeded(const std::array<double, 3>& ratio);
};

enum class WarpAim {
  fastest,  ///< least time
  nearest   ///< least change, to bring a motion back within limits
};

/// Coefficients of c: one more at either end than grid points. `hold_start` and `hold_end` keep
/// value and derivatives of c = 1 there, so that the motion continues smoothly beyond. `accuracy`
/// is about the share of the time that may be left to gain per limit. c = 1 where none is found.
std::vector<double> time_warp(const std::vector<WarpNode>& nodes, WarpAim aim, double accuracy,
                              bool hold_start, bool hold_end);

}  // namespace vcnc
