#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PitchProgressive {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "pitch_progressive",
      .title = "Progressive pitch error",
      .family = Family::geometry,
      .brief = "the pitch changes along the travel: an error that bends over the position",
      .equation = R"(displacement = e_2 (x/L)^2 + e_3 (x/L)^3,   x = q - q_0
e_2, e_3: error at x = L [m or rad], L = 100 mm or 90 deg, q_0: where the error is zero [m or
rad])",
      .validity =
          R"(A smooth error without its linear part, which is scale_error. Polynomial: only meant within the
travel. Rotary axes: within a turn; it does not close on itself.)",
      .source =
          "ISO 230-1:2012 linear and angular positioning error; polynomial terms as in volumetric "
          "models: own choice",
      .signature =
          R"(A curve over the position, the same at every feed and in both directions. On a circle e_2 makes
cos(phi) and cos(3 phi), e_3 cos(2 phi) and cos(4 phi); they grow with R^2 and R^3.)",
      .confusable = "scale_error straightness piece_offset angular_errors",
      .separate =
          "scale_error is a straight line; straightness of the other axis acts across its travel: "
          "another line, parallel to the first, tells them apart",
      .showing = Showing::line};

  double quadratic = 0;  ///< e_2 / L^2 [1/m or 1/rad]
  double cubic = 0;      ///< e_3 / L^3 [1/m^2 or 1/rad^2]
  double reference = 0;  ///< q_0 [m or rad]

  static PitchProgressive nominal(bool rotary) {
    const double e = rotary ? 10 * unit::arcsec.to_si : 5 * unit::um.to_si;
    const double x = travel(rotary);
    return {.quadratic = e / (x * x), .cubic = 0.5 * e / (x * x * x)};
  }
  bool null() const { return quadratic == 0 && cubic == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    const double x = travel(rotary), e = rotary ? unit::arcsec.to_si : unit::um.to_si;
    const Unit square{rotary ? "arcsec_at_90deg" : "um_at_100mm", e / (x * x)};
    visit(rotary ? "quadratic_arcsec_at_90deg" : "quadratic_um_at_100mm", p.quadratic, square,
          Range{-1000, 1000}, "quadratic part, so far from the reference");
    visit(rotary ? "cubic_arcsec_at_90deg" : "cubic_um_at_100mm", p.cubic,
          Unit{square.suffix, e / (x * x * x)}, Range{-1000, 1000},
          "cubic part, so far from the reference");
    visit(rotary ? "reference_deg" : "reference_mm", p.reference, rotary ? unit::deg : unit::mm,
          rotary ? Range{-360, 360} : Range{-1e4, 1e4}, "position at which the error is zero");
  }

  /// L [m or rad].
  static constexpr double travel(bool rotary) { return rotary ? 90 * kDegree : 0.1; }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T x = context.load.position - reference;
    signal.displacement += x * x * (quadratic + cubic * x);
  }
};

}  // namespace vcnc
