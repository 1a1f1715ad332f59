// The shortest time in which a program of X, Y, Z can be run through by any planner that keeps
// velocity, acceleration and jerk of each axis, the feed and the tolerance, whatever its path
// inside the tolerance and whatever its strategy.
//
// Assumed of a motion x(t): there is a monotonous s(t) over the whole programmed path r(s) with
// |x(t) - r(s(t))| <= P, and x rests without acceleration at both ends. The time is cut where
//   S  the program starts or ends:       v = a = 0
//   J  s(t) passes a joint of moves:     v and a of a direction at most what the tube lets through
//   R  an axis i reverses near a joint:  v_i = 0, |a_i| <= A_i
// R exists where the path comes by more than 2 P from below and leaves by more than 2 P downwards:
// it is where x_i is largest between the cuts before and after. Pieces between cuts do not overlap,
// so the least times of all pieces add up; of all chains of cuts the one with the largest sum is
// taken (weighted interval scheduling).
//
// Least time of a piece. Along a unit vector n its ends are D >= |n (r_b - r_a)| - 2 P apart, and
// V, A, J of n are sum |n_i| V_i and so on (an axis: its own), V no more than the feed. With
// v <= v0, a <= a0 at the start and v <= v1, -a <= a1 at the end, the largest distance in a time T
// maximises  int v dt  under |v''| <= J, which is linear: its multiplier, a parabola in t, changes
// sign at most twice, so the jerk is +J, -J, +J, with a = A and v = V held between where they are
// reached. Up to the largest speed w, from v0 to w:
//   a_s = min(a0, A, sqrt(2 J (w - v0))),  a_p = min(A, sqrt(J (w - v0) + a_s^2 / 2)),
//   +J from a_s to a_p, constant, -J to 0 at w;
// the way down mirrored; w from the distance. Special cases, where neither A nor V is reached:
//   v = a = 0 at both ends: (32 D / J)^(1/3);   v = 0, a free: (12 D / J)^(1/3)
//
// What the tube lets through. While the programmed path stays within R - P of a constant along p
// for a time 3 h or longer, f = p x stays within R. Of the parabola through f(t), f(t - h),
// f(t - 3 h) the derivatives differ from those of f by at most J h^2 / 2 and 4 J h / 3, so
//   |f'(t)| <= 3 R / h + J h^2 / 2,   |f''(t)| <= 2 R / h^2 + 4 J h / 3,   best at h^3 = 3 R / J
// (Landau's inequality for the third derivative on a half-line; Chebyshev's cubic attains it). The
// same holds before the instant as after it. An axis is e_i = p + q with p at right angles to the
// line before the joint and q to the line behind it, and gets the sum of both bounds.
// Sources: Matorin, On inequalities between the maxima of the absolute values of a function and its
// derivatives on a half-line, AMS Translations 8 (1958); Kleinberg, Tardos, Algorithm Design, 6.1.
#pragma once

#include <vector>

#include "controller/gcode_blocks.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Largest speed and acceleration at an end of a piece, along its direction and inwards.
struct PieceEnd {
  double velocity = 0, acceleration = 0;
};

/// Least time [s] for a distance [m] under velocity, acceleration and jerk.
double shortest_travel(double distance, double velocity, double acceleration, double jerk,
                       const PieceEnd& from, const PieceEnd& to);

/// What a motion that has been within `radius` for `duration` can be doing at its end.
PieceEnd within_tube(double radius, double jerk, double duration);

/// [s]; of lines and arcs of X, Y, Z without RTCP.
double jerk_bound(const std::vector<Move>& moves, const Machine& machine);

}  // namespace vcnc
