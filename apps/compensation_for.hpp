// Which settings of the NC unit's compensation (model/compensation.hpp) answer the effects of a
// machine, and which effects none can answer.
//
// One table in the source file names for every effect that can be compensated the function that
// does it; whatever is not in it gets the reason that belongs to its family. The settings are in
// closed form from the parameters of the effects and the gains of the drives:
//
//   backlash (motor encoder), load_play        backlash = gap
//   lost_motion, windup (motor encoder)        backlash = 2 c F_c, the part that friction makes
//   scale_error, lead_error (motor encoder)    scale
//   pitch_progressive, encoder_eccentricity    a table over the travel or a turn
//   pitch_periodic, load_encoder_error, transmission_error (motor encoder)
//                                              a table over one period, 64 points
//   straightness                               tables of the axes across, over the travel
//   lateral_play                               tables of the axes across with two directions
//   squareness                                 squareness
//   command_delay, bus_latency, velocity_ff_error, kv_error, gains of the drives as they are:
//       lead, so that all axes have one lag L:  l = t_d + n T + (1 - kvff)/Kv - L;  L = 0 where
//       the longest lead of 5 ms allows it
//   coulomb, stribeck, motor_friction          a pulse at reversals
//
//   laws (model/effects/law.hpp) of the points displacement and command over a position, with the
//   factor one or the sign of that axis' motion: a table of their knots
//
// The pulse: at a reversal the friction on the drive jumps by dF = 2 F_c. The drive answers it at
// once, the axis staying on its path, when the set-point is off by p with
//   Kp (Kv + s)(1 + 1/(Ti s)) P + J s^2 P = dF/s,   Kp = J w_v (full feed-forward)
// and the velocity controller then feels
//   U = (s + Kv) P = dF/J (s + Kv) / (s^3 + w_v s^2 + w_v (Kv + 1/Ti) s + w_v Kv/Ti).
// One pole lies near -Kv and all but cancels; with the others, -r_1 and -r_2,
//   u(t) = dF/(J (r_2 - r_1)) (exp(-r_1 t) - exp(-r_2 t)).
#pragma once

#include <string>
#include <vector>

#include "model/machine.hpp"

namespace vcnc {

struct CompensationRemark {
  std::string effect;  ///< its key: "X.backlash", "geometry.squareness", "axes.Y.load_kg"
  bool compensated = false;
  std::string text;  ///< what by, or why not
};

struct CompensationProposal {
  CompensationParams settings;
  std::vector<CompensationRemark> remarks;  ///< one for each effect, law and deviation
};

/// For the effects, laws and deviations of `machine`. What its file compensates already counts for
/// nothing: the effects are all that the machine does besides.
CompensationProposal compensation_for(const Machine& machine);

/// The best pulse against friction that jumps by `step` [N or N m], in a drive of this inertia with
/// the velocity loop's crossover w_v [rad/s].
ReversalPulse pulse_against(double step, double inertia, double crossover, double integral_time,
                            double kv);

}  // namespace vcnc
