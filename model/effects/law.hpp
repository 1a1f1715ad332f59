// A law without an effect of its own: any function of the machine's state, or any time series,
// added at one of six points of an axis and simulated through the closed loop.
//
//   y = m * f(c)
//   f  piecewise linear through (at, value), constant beyond its ends
//   c  covariate: time, or position, velocity, acceleration of an axis
//   m  1, or the sign, position, velocity or acceleration of an axis (its value in SI), or 1 while
//      it goes forwards (backwards) and 0 else
//
//   point          y is                                          unit (linear, rotary)
//   command        added to the set-point of the loops           um, arcsec
//   command_time   the set-point is taken later by this          us
//   motor_force    added to the motor's force                    N, Nm
//   table_force    added to the force on the table               N, Nm
//   displacement   added to the tool centre's position           um, arcsec
//   reading        added to the probe's reading; X, Y, Z are its components   um
//
// A drive knows the true motion of its own axis and the commanded motion of the others; at the
// probe all axes' true motions are known. Source: own definition; piecewise linear functions (hat
// functions) as a basis for unknown laws follow the discrepancy modelling literature, e.g.
// Brynjarsdottir & O'Hagan, Inverse Problems 30 (2014) 114007.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "model/axes.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

/// What a law may depend on.
enum class Covariate { time, position, velocity, acceleration, sign, forwards, backwards };

struct Law {
  enum class Point { command, command_time, motor_force, table_force, displacement, reading };
  enum class OfAxis { X, Y, Z, A, C };

  std::string label;  ///< for people
  OfAxis axis = OfAxis::X;
  Point point = Point::table_force;
  Covariate over = Covariate::time;  ///< not a direction
  OfAxis over_axis = OfAxis::X;
  Covariate times = Covariate::time;  ///< time: no factor
  OfAxis times_axis = OfAxis::X;
  std::vector<double> at;     ///< knots, ascending
  std::vector<double> value;  ///< as many

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    using enum Covariate;
    visit("label", p.label, "for people");
    axis_field("axis", p.axis, visit, "the axis it acts on");
    visit.choice("point", p.point,
                 {{"command", Point::command},
                  {"command_time", Point::command_time},
                  {"motor_force", Point::motor_force},
                  {"table_force", Point::table_force},
                  {"displacement", Point::displacement},
                  {"reading", Point::reading}},
                 "where it acts");
    visit.choice("over", p.over,
                 {{"time", time},
                  {"position", position},
                  {"velocity", velocity},
                  {"acceleration", acceleration}},
                 "what the law is a function of");
    axis_field("over_axis", p.over_axis, visit, "of which axis");
    visit.choice(
        "times", p.times,
        {{"one", time},
         {"sign", sign},
         {"position", position},
         {"velocity", velocity},
         {"acceleration", acceleration},
         {"forwards", forwards},
         {"backwards", backwards}},
        "a factor: the sign of the velocity, 1 one way only, or a value in m, m/s, rad, ...");
    axis_field("times_axis", p.times_axis, visit, "of which axis");
    const Unit x = unit_of(p.over, rotary(p.over_axis)), y = unit_of(p.point, rotary(p.axis));
    visit("at_" + std::string(x.suffix), p.at, x, Range{-1e9, 1e9}, "knots, ascending");
    visit("value_" + std::string(y.suffix), p.value, y, Range{-1e9, 1e9}, "values at the knots");
  }

  std::size_t axis_index() const { return static_cast<std::size_t>(axis); }
  /// f(c), piecewise linear.
  double function(double c) const;
  /// y for the motions of all axes at time t [s].
  double operator()(double t, const Motions<double>& axes) const;
  /// Whether the factor is a value, in SI.
  bool grows() const;
  /// From one value to another within 10 ms, once.
  bool jumps() const;
  /// Empty, or what is wrong with it in one sentence.
  std::string objection() const;

  static bool rotary(OfAxis a) { return is_rotary(static_cast<std::size_t>(a)); }
  static Unit unit_of(Covariate c, bool rotary);
  static Unit unit_of(Point p, bool rotary);

 private:
  template <class Axis, class Visit>
  static void axis_field(const char* key, Axis& a, Visit& visit, const char* doc) {
    using enum OfAxis;
    visit.choice(key, a, {{"X", X}, {"Y", Y}, {"Z", Z}, {"A", A}, {"C", C}}, doc);
  }
};

}  // namespace vcnc
