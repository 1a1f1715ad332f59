#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct StylusBending {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "stylus_bending",
      .title = "Bending of the stylus",
      .family = Family::probe,
      .brief = "the stylus takes up part of the deflection, the sensor sees the rest",
      .equation = R"(x_sensed = x/(1 + k c_l) for x and y,   z_sensed = z/(1 + k c_a)
k: spring rate of the probe [N/m], c_l, c_a: compliance of the stylus across and along it [m/N];
cantilever: c_l = L^3/(3 E I), I = pi d^4/64, c_a = 4 L/(E pi d^2).)",
      .validity =
          R"(Two springs in series, quasi-static. The contact force stays k x, as if the stylus were
rigid. Carbide (600 GPa), 50 mm x 2 mm: c_l = 88 um/N, c_a = 0.027 um/N.)",
      .source = "beam theory (Euler, Bernoulli), any textbook; probe calibration: ISO 10360-5",
      .signature =
          R"(The sideways reading is too small by k c_l/(1 + k c_l), in proportion to the deflection;
along the stylus hardly. A calibration at one deflection removes it.)",
      .confusable = "probe_gain tip_radius tip_lobing",
      .separate = "x and y alike, z not; with probe_gain it is told apart by a second stylus only",
      .showing = Showing::s_piece};

  double lateral = 0, axial = 0;  ///< [m/N]

  static StylusBending nominal() { return {.lateral = 10e-6, .axial = 0.1e-6}; }
  bool null() const { return lateral == 0 && axial == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit um_per_n{"um_per_N", 1e-6};
    visit("lateral_um_per_N", p.lateral, um_per_n, Range{0, 2000}, "across the stylus");
    visit("axial_um_per_N", p.axial, um_per_n, Range{0, 2000}, "along the stylus");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double across = 1 + context.spring_rate * lateral,
                 along = 1 + context.spring_rate * axial;
    signal.deflection.x() /= across;
    signal.deflection.y() /= across;
    signal.deflection.z() /= along;
  }
};

}  // namespace vcnc
