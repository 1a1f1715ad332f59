// One continuous run of moves as a smooth curve x(s) in programme coordinates.
//
// The programmed path r(s) is a chain of lines, arcs and helices, parametrised by
//   ds = max(|dp|, w |d(A, C)|),   w = kRotaryLength
// so that s is the length of the controlled point's path wherever that point really moves. It is
// smoothed by a moving average with a hat kernel k of half width h(s):
//   x(s) = int_{-1}^{1} r(s + h(s) u) k(u) du,   k(u) = 1 - |u|
// Beyond its ends r is continued by point reflection, r(-s) = 2 r(0) - r(s), so end points are met
// exactly. x is C2 with a bounded third derivative. With t the unit tangent and kappa the curvature
// of r, for constant h:
//   corner     |x - r| = |t2 - t1| h / 6
//   curve      |x - r| = kappa h^2 / 12
// so h(s) follows from the tolerance; where it has to change it does so slowly (slope below
// kWidthSlope between the constraints), by C2 steps. Arcs are kept within kArcTolerance whatever
// the tolerance is, so that a circle keeps its radius.
//
// Under the fast dynamics corners of two lines get a curve that a motion with limited jerk takes in
// less time (path_corner.hpp), where they have room for it, and an arc next to a line, where its
// curvature has to begin, is held to the tolerance of the program; over a quarter of it at most the
// width comes down to the one of arcs.
// Source: the two-fold average is the B-spline filter of order 2 (Biagiotti, Melchiorri, Trajectory
// Planning for Automatic Machines and Robots, ch. 4); the variable width and its bound are our own.
#pragma once

#include <optional>
#include <vector>

#include "controller/gcode_blocks.hpp"
#include "controller/path_corner.hpp"

namespace vcnc {

/// One programmed move as geometry over [s0, s0 + length].
struct PathSegment {
  Move move;
  double s0 = 0, length = 0;
  double radius0 = 0, radius1 = 0, angle0 = 0;  ///< arcs
};

struct PathPoint {
  Coordinates x, dx;  ///< value and derivative with respect to s
};

PathSegment make_segment(Move move, double s0);
PathPoint programmed_point(const PathSegment& segment, double s);

class Path {
 public:
  static constexpr double kRotaryLength = 0.01;  ///< w [m/rad]
  static constexpr double kArcTolerance = 1e-7;  ///< [m]
  static constexpr double kLargestWidth = 5e-3;  ///< of h, in s [m]
  static constexpr double kWidthSlope = 0.15;

  /// Moves must follow each other without a gap and share one frame. `angle_tolerance` [rad] bounds
  /// the deviation of the tool axis (RTCP) or of A and C.
  /// While a path is open, more moves may follow.
  Path(std::vector<Move> moves, double angle_tolerance, bool open = false);

  void extend(std::vector<Move> moves, bool open);
  /// Up to here moves that follow change nothing.
  double settled() const { return settled_; }
  bool open() const { return open_; }
  /// The path before s is not asked for any more.
  void forget(double s);

  double length() const { return length_; }
  PathPoint eval(double s) const;        ///< the smooth curve; s is clamped to [0, length]
  PathPoint programmed(double s) const;  ///< r(s), for checks; right-hand derivative
  double half_width(double s) const { return width(s).h; }
  /// Length over which the curve may bend otherwise.
  double detail(double s) const;
  const PathSegment& segment(double s) const { return segments_[index(s)]; }
  const std::vector<PathSegment>& segments() const { return segments_; }
  const MotionFrame& frame() const { return segments_.front().move.frame; }

 private:
  struct Width {
    double h, dh;
  };
  struct Bound {
    double s, h;
  };
  /// A corner of two lines that has a curve of its own.
  struct Corner {
    double s;
    PathCorner curve;
    Coordinates jump;  ///< of the tangent
  };
  struct Kernel;  ///< accumulates the average
  bool fast() const { return segments_.front().move.dynamics == NcParams::Dynamics::fast; }
  std::size_t index(double s) const;
  Width width(double s) const;
  PathPoint smooth(double s, Width w) const;
  double largest_width(double s, double from, double cap = kLargestWidth) const;
  bool within_tolerance(double s, double h, double tip_tolerance) const;
  void append(std::vector<Move> moves);
  void bound_width();
  void build_width();
  void find_corners(double from);
  const Corner* corner_at(double s) const;
  std::optional<Corner> corner_between(const PathSegment& before, const PathSegment& behind) const;
  double tolerance_at(double s) const;

  std::vector<PathSegment> segments_;
  double length_ = 0, angle_tolerance_;
  std::vector<Bound> bounds_;  ///< largest widths by tolerance
  std::vector<Bound> knots_;   ///< h(s) runs through these
  std::vector<Corner> corners_;
  double settled_ = 0;
  bool open_;
};

}  // namespace vcnc
