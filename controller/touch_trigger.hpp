// The scanning probe as a touch probe: what a probing move (G31, G38.n) waits for, and where it
// was.
//
//   tripped   from |delta| >= d_on on until |delta| < d_off; delta: the deflection read
//   d_on      20 times probe.min_deflection_um: 0.2 mm (at most half of probe.range_mm). Above what
//             the ball lags behind when the axes speed up: m a / k, 49 um per m/s^2 of a probe of
//             the SP600 class
//   d_off     twice probe.min_deflection_um, at most half of d_on
//
// How late the interface and the bus tell does not matter: a reading goes with the measured axis
// positions q of the instant it belongs to, and from there the way back to where the ball met the
// surface (on, where it left it) is known from the deflection itself. For a straight way along the
// unit vector u of a ball that slides without friction on a plane,
//   s   = |delta|^2 / (-u . delta),   q_contact = q - s u
// whatever the angle between both; square to the surface s = |delta|. A way that is flatter than
// kFlattest, or on which A or C move, is not followed back: then it is q that counts.
// Source: the hysteresis of touch-trigger interfaces; compensation of the pretravel as in the
// calibration of ISO 230-10, here by the reading itself.
#pragma once

#include "model/axes.hpp"
#include "model/machine.hpp"
#include "model/math.hpp"

namespace vcnc {

/// What is known of one instant.
struct ProbeReading {
  Vec3 deflection = Vec3::Zero();  ///< probe frame [m]
  AxisVector position{};           ///< of the axes, measured [m, rad]
};

class TouchTrigger {
 public:
  static constexpr double kOn = 20, kOff = 2;  ///< of the smallest deflection that counts
  static constexpr double kFlattest = 0.1;     ///< cosine between way and deflection

  explicit TouchTrigger(const ProbeParams& probe);

  void step(const Vec3& deflection);
  bool tripped() const { return tripped_; }
  double on() const { return on_; }    ///< d_on [m]
  double off() const { return off_; }  ///< d_off [m]

 private:
  double on_, off_;
  bool tripped_ = false;
};

/// Axis positions at which the ball met or left the surface. `way`: direction in which X, Y, Z go,
/// of length 1, or 0 where there is none to follow back.
AxisVector touch_point(const Machine& machine, const ProbeReading& reading, const Vec3& way);

}  // namespace vcnc
