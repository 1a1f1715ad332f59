#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SignalPhase {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "signal_phase",
      .title = "Quadrature error of the sine signal",
      .family = Family::acquisition,
      .brief = "sine and cosine are not 90 deg apart",
      .equation = R"(w = R sin(phi - alpha)
alpha: quadrature error [rad], phi = 2 pi x / period, R: amplitude)",
      .validity = "Constant over time; one channel each.",
      .source = "Heydemann, Applied Optics 20 (1981) 3382",
      .signature =
          R"(Error of the reading of period/2pi alpha cos^2(phi): half of it constant, half with two periods per
signal period of the deflection.)",
      .confusable = "signal_gain signal_harmonics",
      .separate = "over the deflection in periods: cos 2 phi, signal_gain makes sin 2 phi",
      .showing = Showing::circle};

  Vec3 angle = Vec3::Zero();  ///< per channel [rad]

  static SignalPhase nominal() { return {Vec3::Constant(2 * kDegree)}; }
  bool null() const { return angle.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("angle_deg", p.angle, unit::deg, Range{-30, 30}, "quadrature error of x, y, z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double alpha = angle[context.channel];
    signal.sine = std::cos(alpha) * signal.sine - std::sin(alpha) * signal.cosine;
  }
};

}  // namespace vcnc
