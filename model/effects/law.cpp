#include "model/effects/law.hpp"

#include <algorithm>

namespace vcnc {

double Law::function(double c) const {
  if (at.empty()) return 0;
  const auto above = std::upper_bound(at.begin(), at.end(), c);
  if (above == at.begin()) return value.front();
  if (above == at.end()) return value.back();
  const std::size_t i = static_cast<std::size_t>(above - at.begin());
  return value[i - 1] + (value[i] - value[i - 1]) * (c - at[i - 1]) / (at[i] - at[i - 1]);
}

double Law::operator()(double t, const Motions<double>& axes) const {
  const auto read = [&](Covariate c, OfAxis of) {
    const Motion<double>& m = axes[static_cast<std::size_t>(of)];
    switch (c) {
      case Covariate::position:
        return m.position;
      case Covariate::velocity:
        return m.velocity;
      case Covariate::acceleration:
        return m.acceleration;
      case Covariate::sign:
        return m.velocity > 0 ? 1.0 : m.velocity < 0 ? -1.0 : 0.0;
      case Covariate::forwards:
        return m.velocity > 0 ? 1.0 : 0.0;
      case Covariate::backwards:
        return m.velocity < 0 ? 1.0 : 0.0;
      case Covariate::time:
        break;
    }
    return t;
  };
  const double factor = times == Covariate::time ? 1 : read(times, times_axis);
  return factor * function(read(over, over_axis));
}

bool Law::grows() const {
  return times == Covariate::position || times == Covariate::velocity ||
         times == Covariate::acceleration;
}

bool Law::jumps() const {
  return over == Covariate::time && times == Covariate::time && at.size() == 2 &&
         at[1] - at[0] < 10e-3;
}

std::string Law::objection() const {
  if (at.empty()) return "needs at least one knot and its value";
  if (at.size() != value.size())
    return "needs as many values as knots, found " + std::to_string(value.size()) + " and " +
           std::to_string(at.size());
  if (std::adjacent_find(at.begin(), at.end(), std::greater_equal<>()) != at.end())
    return "the knots must ascend";
  if (point == Point::reading && rotary(axis)) return "the probe has readings in X, Y and Z only";
  return "";
}

Unit Law::unit_of(Covariate c, bool rotary) {
  switch (c) {
    case Covariate::position:
      return rotary ? unit::deg : unit::mm;
    case Covariate::velocity:
      return rotary ? unit::deg_s : unit::mm_s;
    case Covariate::acceleration:
      return rotary ? unit::deg_s2 : unit::mm_s2;
    default:
      return unit::s;
  }
}

Unit Law::unit_of(Point p, bool rotary) {
  switch (p) {
    case Point::command_time:
      return unit::us;
    case Point::motor_force:
    case Point::table_force:
      return rotary ? unit::newton_m : unit::newton;
    case Point::command:
    case Point::displacement:
      return rotary ? unit::arcsec : unit::um;
    case Point::reading:
      break;
  }
  return unit::um;
}

}  // namespace vcnc
