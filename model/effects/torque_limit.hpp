#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TorqueLimit {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "torque_limit",
      .title = "Too small a limit of the drive force",
      .family = Family::servo,
      .brief = "the drive gives less than its declared largest force",
      .equation = R"(|F_ref| <= F_max (1 - d);  the integral is held while the force is limited
d: missing share, F_max: declared limit [N or N m])",
      .validity =
          R"(Constant; a weakening field at high speed and thermal limits are not modelled. The drive goes on
to report its force as a share of the declared limit.)",
      .source = "own definition; anti-windup as in model/drive/axis_drive.hpp",
      .signature =
          R"(Nothing until the motion asks for more; then a flat top of the force at (1 - d) of the limit, an
acceleration of no more than F_max (1 - d)/J and a burst of following error with overshoot.)",
      .confusable = "torque_constant_error acceleration_ff_error",
      .separate = "acts only above a force, there abruptly; the force has a flat top",
      .showing = Showing::corner};

  double missing = 0;  ///< share of the declared limit

  static TorqueLimit nominal(bool rotary) { return {rotary ? 0.95 : 0.8}; }
  bool null() const { return missing == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("missing_percent", p.missing, Unit{"percent", 0.01}, Range{0, 99.9},
          "of the declared largest force");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.force_limit *= 1 - missing;
  }
};

}  // namespace vcnc
