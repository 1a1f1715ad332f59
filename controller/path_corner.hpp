// A corner between two lines as the curve of two ramps that overlap: along one line the motion is
// braked to rest while it is started along the other, both with constant jerk.
//
// With tangents t1 before and t2 behind the corner at c and the parameter w from -1 to 1
//   x = c - e(-w) t1 + e(w) t2,   s = e(w) - e(-w)
// so that x(s) continues both lines to the second derivative. e begins at rest at w = -1,
//   e''' = -k for w < -1 + kSwing,   e''' = +k from there on,
// and swings out by as much, -e(0), as it then cuts the corner: the tolerance has two sides. A
// point is off by
//   |x - r(s)| = |t2 - t1| |e(-|w|)|  <=  |t2 - t1| e(0).
// Passed with w even in time, the jerk along either line is constant. At a square corner with a
// jerk of 50 m/s3 and 10 um (e(0) = 7.1 um) that saves 2 (1 - 2 kSwing) (k / J)^(1/3) = 28 ms of
// two stops. Without the swing (kSwing = 0) it saves 19 ms, but reaches 8 e(0) instead of 52 e(0)
// along the lines. Source: own derivation; what limited jerk can do within a tube is bounded by
// Landau's inequality (tests/bench/jerk_bound.hpp).
#pragma once

namespace vcnc {

class PathCorner {
 public:
  enum class Shape { swinging, plain };

  /// |e(w)| <= `cut` for w <= 0.
  PathCorner(Shape shape, double cut);

  double reach() const { return reach_; }  ///< the largest |s|
  double cut() const { return cut_; }

  struct Share {
    double value, slope;  ///< e(-|w|) and its derivative with respect to s
  };
  Share at(double s) const;  ///< 0 beyond the reach

  static double reach_per_cut(Shape shape);

 private:
  double swing_, cut_, scale_, reach_;
};

}  // namespace vcnc
