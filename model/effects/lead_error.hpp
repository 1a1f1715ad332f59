#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LeadError {
  using Port = TransmissionPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "lead_error",
      .title = "Lead error of a screw",
      .family = Family::mechanics,
      .brief =
          "the screw's lead is not the one that the motor's encoder is counted with: made so, or "
          "warm",
      .equation = R"(q_load - q_motor = e (q - q_0)
e: lead error [m/m], q: position, q_0: where the run starts)",
      .validity =
          R"(The same over the whole screw and the whole run (periodic: transmission_error; in time:
thermal_expansion); the ratio of forces changes by e << 1, which is left out.)",
      .source =
          R"(ISO 3408-3:2006, cumulative lead deviation: 23 um over 300 mm in class 5, 52 um in class 7;
steel grows by 11.5 ppm/K)",
      .signature =
          R"(The two measuring systems drift apart in proportion to the travel. With the loop closed on the
motor the load is off by e q, as with a scale that is wrong; with the loop closed on the load the
tool is where it should be, and only the motor moves by more.)",
      .confusable = "scale_error thermal_expansion",
      .separate =
          "scale_error is not seen between the two measuring systems; thermal_expansion changes "
          "between the start and the end of the run",
      .showing = Showing::line};

  double error = 0;  ///< e

  static LeadError nominal() { return {.error = 100e-6}; }
  bool null() const { return error == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("error_ppm", p.error, Unit{"ppm", 1e-6}, Range{-1e4, 1e4},
          "travel of the load over that which the motor counts, less 1");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.lead += error;
  }
};

}  // namespace vcnc
