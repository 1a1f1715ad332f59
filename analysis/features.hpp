// Numbers read off a measured curve: pure functions of a signal over its covariate.
//
// All by least squares or plain statistics, SI units in and out. The covariate need not be evenly
// spaced. Functions of an angle take radians, any turn.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vcnc {

/// A signal over what it naturally depends on: angle, position, velocity, time, station.
struct Curve {
  std::string label;  ///< "counter-clockwise", "F3000", "forward"
  std::vector<double> x, y;

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
  std::size_t size() const { return x.size(); }
};

double mean(const Curve& curve);
/// Root of the mean square.
double rms(const Curve& curve);
/// Root of the mean square about the mean.
double scatter(const Curve& curve);
double peak_to_peak(const Curve& curve);
double max_abs(const Curve& curve);

/// Straight line y ~ offset + slope x.
struct Trend {
  double offset = 0, slope = 0;
};
Trend trend(const Curve& curve);

/// y ~ mean + cosine cos(2 pi x / period) + sine sin(2 pi x / period).
struct Wave {
  double mean = 0, cosine = 0, sine = 0;
  double amplitude() const;
  double phase() const;  ///< of amplitude * sin(2 pi x / period + phase) [rad]
};
Wave wave(const Curve& curve, double period);
/// The k-th harmonic of an angle, fitted together with all lower ones.
Wave harmonic(const Curve& curve, int k);

/// Height of the step at `at` [rad] of a signal over an angle: straight lines through the points
/// from `inner` to `outer` before and behind it, their difference at the step, behind minus before
/// in the direction of travel. Empty with fewer than 3 points on a side.
std::optional<double> step_at(const Curve& curve, double at, double inner = 0.1,
                              double outer = 0.25);
/// Largest departure within `reach` [rad] of an angle from the straight line between the means of
/// both edges of that stretch, with its sign; empty without points.
std::optional<double> spike_at(const Curve& curve, double at, double reach = 0.12);

/// Mean of the second curve minus that of the first at equal x (the first is interpolated linearly;
/// both monotonic, either way): what the direction of travel makes of the signal. Empty where they
/// do not overlap.
std::optional<double> mean_difference(const Curve& first, const Curve& second);

/// `with` minus `without`, at the abscissas of `with`: point by point where both have the same,
/// else `without` is interpolated linearly over its sorted abscissa; points beyond it are left out.
Curve difference(const Curve& with, const Curve& without);

/// Least squares y ~ c v^n through pairs of speed and value: n, with all values of one sign.
/// 2 for centrifugal effects, 1 for delays. Empty with fewer than two useful pairs.
std::optional<double> growth_exponent(std::span<const double> speed, std::span<const double> value);

}  // namespace vcnc
