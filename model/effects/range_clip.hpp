#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct RangeClip {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "range_clip",
      .title = "Saturation of the sensor",
      .family = Family::probe,
      .brief = "beyond its range the sensor reads the end of the range",
      .equation = R"(x_sensed = max(-L, min(x, L)) for each channel
x: deflection [m], L: where the scale ends [m]; 0: no end)",
      .validity =
          "Sharp, no hysteresis, the same on both sides and in all channels; after gain and drift.",
      .source = "own definition",
      .signature =
          "A flat top at exactly L where the deflection would be larger, in one channel at a time.",
      .confusable = "contact_loss dropped_samples",
      .separate = "always at the same value, wherever the deflection is large",
      .showing = Showing::circle};

  double limit = 0;  ///< [m]; 0: none

  static RangeClip nominal() { return {0.4e-3}; }
  bool null() const { return limit == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("limit_mm", p.limit, unit::mm, Range{0, 50}, "largest reading of each channel; 0: none");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    if (limit == 0) return;
    for (int i = 0; i < 3; ++i) {
      if (signal.deflection[i] > limit) signal.deflection[i] = T(limit);
      if (signal.deflection[i] < -limit) signal.deflection[i] = T(-limit);
    }
  }
};

}  // namespace vcnc
