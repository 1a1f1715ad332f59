#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct EncoderQuantisation {
  using Port = EncoderPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "encoder_quantisation",
      .title = "Resolution of the measuring system",
      .family = Family::servo,
      .brief = "positions are counted in whole steps",
      .equation = R"(q_measured = d round(q / d)
d: quantum [m or rad])",
      .validity = "Uniform steps; both measuring systems of the axis have the same.",
      .source =
          "own definition; uniform quantisation has an rms error of d/sqrt(12), Widrow, IRE Trans. "
          "CT-3 (1956) 266",
      .signature =
          R"(Following error and force carry a sawtooth of the height of d; a limit cycle of about d at rest
when there is friction.)",
      .confusable = "adc_noise frame_vibration",
      .separate = "does not fade at creep feed, where its steps become visible in time",
      .showing = Showing::line};

  double quantum = 0;  ///< [m or rad]

  static EncoderQuantisation nominal(bool rotary) {
    return {rotary ? unit::arcsec.to_si : 1 * unit::um.to_si};
  }
  bool null() const { return quantum == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "quantum_arcsec" : "quantum_nm", p.quantum, rotary ? unit::arcsec : unit::nm,
          Range{0, 1e5}, "resolution, 0 = continuous");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    using std::floor;
    if (quantum > 0) signal.position = quantum * floor(signal.position / quantum + 0.5);
  }
};

}  // namespace vcnc
