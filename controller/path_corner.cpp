#include "controller/path_corner.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kSwing = 0.18671262958935765;  ///< least e = -e(0)

double swing_of(PathCorner::Shape shape) {
  return shape == PathCorner::Shape::swinging ? kSwing : 0;
}

struct Ramp {
  double value, slope;
};

/// e / k and its derivative.
Ramp ramp(double swing, double w) {
  const double t = w + 1, u = t - swing;
  if (u < 0) return {-t * t * t / 6, -0.5 * t * t};
  const double half = 0.5 * swing * swing;
  return {-swing * half / 3 - u * (half + u * (0.5 * swing - u / 6)),
          -half - u * (swing - 0.5 * u)};
}

}  // namespace

double PathCorner::reach_per_cut(Shape shape) {
  const double swing = swing_of(shape);
  return ramp(swing, 1).value / ramp(swing, 0).value;
}

PathCorner::PathCorner(Shape shape, double cut)
    : swing_(swing_of(shape)),
      cut_(cut),
      scale_(cut / ramp(swing_, 0).value),
      reach_(cut * reach_per_cut(shape)) {}

PathCorner::Share PathCorner::at(double s) const {
  constexpr int kMostSteps = 50;
  constexpr double kExact = 1e-15;
  if (std::abs(s) >= reach_) return {0, 0};
  // Newton's method from the far side: s grows with w, and the faster the further.
  const double goal = std::abs(s) / scale_;
  Ramp up = ramp(swing_, 1), down{0, 0};
  double w = 1;
  for (int i = 0; i < kMostSteps; ++i) {
    const double step = (up.value - down.value - goal) / (up.slope + down.slope);
    w = std::clamp(w - step, 0.0, 1.0);
    up = ramp(swing_, w);
    down = ramp(swing_, -w);
    if (std::abs(step) < kExact) break;
  }
  const double slope = -down.slope / (up.slope + down.slope);
  return {scale_ * down.value, s < 0 ? -slope : slope};
}

}  // namespace vcnc
