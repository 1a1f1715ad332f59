#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ScaleError {
  using Port = DisplacementPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "scale_error",
      .title = "Scale error",
      .family = Family::geometry,
      .brief = "the scale is a little too long or too short: an error in proportion to the travel",
      .equation = R"(displacement = e (q - q_0)
e: scale error [m/m], q: position [m], q_0: where the scale is fixed [m])",
      .validity =
          "Constant over time (see thermal_expansion). Linear axes: a circle closes on itself.",
      .source =
          "ISO 230-1:2012 linear positioning error E_XX, its linear part; cosine error of a scale "
          "adds to it",
      .signature =
          R"(On a circle of radius R a radial error R (e_x cos^2 + e_y sin^2): the mean of the two makes it
larger, half their difference an ellipse along the axes, cos(2 phi). The same at every feed
and in both directions; grows with R.)",
      .confusable =
          "lead_error thermal_expansion thermal_warm_up pitch_progressive tip_radius probe_gain",
      .separate =
          "tip_radius and probe_gain do not grow with the radius of the circle; thermal ones "
          "change "
          "between the start and the end of the run",
      .showing = Showing::circle};

  double error = 0;      ///< e
  double reference = 0;  ///< q_0 [m]

  static ScaleError nominal() { return {.error = 100e-6}; }
  bool null() const { return error == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("error_ppm", p.error, Unit{"ppm", 1e-6}, Range{-1e4, 1e4},
          "true travel over measured travel, less 1");
    visit("reference_mm", p.reference, unit::mm, Range{-1e4, 1e4},
          "position at which the scale is right");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.displacement += error * (context.load.position - reference);
  }
};

}  // namespace vcnc
