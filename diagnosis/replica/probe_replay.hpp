// The probe of a hypothesis, on axes whose true motion is known: in full, or quickly.
//
// In full: every sample of 100 us with everything that the simulated probe does (ProbeSensor).
//
// Quickly, for differences between two similar machines, one step per cycle of h = 1 ms in two
// stages. Contact: the ball on its spring moves freely along the exact solution for a tool that
// moves evenly over the step, with r = p - p_T, w^2 = k/m, b = zeta w, w_d^2 = w^2 - b^2:
//
//   r(h)  = e^(-bh) [ (cos + b/w_d sin) r + sin/w_d r' ]
//   r'(h) = e^(-bh) [ -w^2/w_d sin r + (cos - b/w_d sin) r' ]      (cos, sin of w_d h)
//
// then the surface puts it back along its normal as in ProbeContact; the normal force that this
// takes, N = m dv_n / h, limits Coulomb friction, whose impulse and that of the guides act evenly
// over the step. Sensing: effects on the deflection and the counters once per cycle; those on the
// sin/cos signals by the phase they shift, x += (atan2(w', u') - phi) period / 2 pi, without
// converter and without counting: nothing slips. Where signals are corrected online, the
// correction sees its samples of 100 us on straight lines between cycles, until it has its ellipse.
//
// What measures between table and tool in place of the probe has no motion of its own. A ball bar
// reads, in the first channel,
//
//   d = |p_WT - p_WB| - L + r_b - r_0
//
// p_WB the ball on the table, L the nominal length, r_b - r_0 what the ball is larger than declared
// (TouchPort), which for a bar is the error of its zero. A sensor on the table reads p_WT - p_W0 in
// three channels, p_W0 where it reads zero. Then both are sensed like a deflection.
//
// Neglected against the full probe: motion of the tool within 1 ms other than even, quantisation by
// the converter (0.13 nm), and what only fingerprint_of_full_probe() names. What is left cancels in
// the difference to first order.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/replica/axis_replay.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"

namespace vcnc {

using AxisReplays = PerAxis<std::shared_ptr<const AxisReplay>>;
/// x, y, z in the probe frame, one value per cycle [m].
using Deflections = std::array<std::vector<double>, 3>;

/// What the tool is held against: a piece by a probe, or what else is on the table.
struct Counterpart {
  struct OnTable {
    Vec3 p_W0 = Vec3::Zero();  ///< the ball of a bar, or where a sensor reads zero [m]
    double bar_length = 0;     ///< nominal [m]; 0: a sensor
    Eigen::Matrix3d R_SW = Eigen::Matrix3d::Identity();  ///< into the frame that a sensor tells
  };
  const Piece* piece = nullptr;  ///< null: nothing is touched
  std::optional<OnTable> on_table;
};

struct ProbeReplay {
  Deflections ball;     ///< the true deflection
  Deflections reading;  ///< what the module makes of it
};

/// In full. `actual` is a hypothesis with its deviations applied.
ProbeReplay replay_probe(const Machine& actual, const Counterpart& against,
                         const AxisReplays& axes);

/// Poses of the tool at the end of every cycle.
using Poses = std::vector<ToolPose>;
Poses replay_poses(const Machine& actual, const AxisReplays& axes);

/// How poses change with the axes around a machine whose axes are `axes`:
///
///   p_WT' = p_WT + J dq,   R_WT' = (1 + [w_A dA + w_C dC]x) R_WT
///
/// What errors of the geometry do at another place is neglected, as are squares of dq.
class NearbyPoses {
 public:
  NearbyPoses(const Machine& actual, const AxisReplays& axes);

  const AxisReplays& axes() const { return axes_; }
  /// Of the machine itself.
  const Poses& poses() const { return poses_; }

  /// Poses of a similar machine on other axes, of which those on the axes of this one are `poses`.
  class Course {
   public:
    Course(const NearbyPoses& near, const Poses& poses, const AxisReplays& axes);
    std::size_t size() const { return poses_.size(); }
    /// Of one cycle, until the next one is asked for.
    const ToolPose& operator[](std::size_t cycle);

   private:
    const NearbyPoses& near_;
    const Poses& poses_;
    const AxisReplays& axes_;
    std::vector<std::size_t> moved_;  ///< axes that move otherwise
    ToolPose pose_;
  };

 private:
  struct Change {
    Eigen::Matrix<double, 3, 5> J;  ///< [m/m], [m/rad]
    Vec3 w_A, w_C;                  ///< what R_WT turns about
  };
  AxisReplays axes_;
  Poses poses_;
  std::vector<Change> changes_;
};

/// Quickly: the true deflection of the ball.
Deflections replay_contact(const Machine& actual, const Counterpart& against,
                           NearbyPoses::Course poses);
/// Quickly: what the probe says of it, with the errors of its signals taken where the ball is moved
/// by `moved`; null: where it is.
Deflections replay_sensing(const Machine& actual, const Deflections& ball, const AxisReplays& axes,
                           const Deflections* moved = nullptr);

/// A piece that is lifted now and then: any difference is only known in full.
bool lifts(const Machine& actual);

/// What only the full probe tells: the hysteresis of the guides, whose friction depends on the
/// sliding within a cycle. The quick one leaves it out, so it tells differences between machines
/// that agree in this.
std::string fingerprint_of_full_probe(const Machine& actual);

/// Whether some effect makes errors of the sin/cos signals that stay in the reading, uncorrected,
/// and repeat with their period.
bool signals_err(const Machine& actual);

/// Whether errors of the geometry follow the axes' accelerations, or remember: then those near
/// other axes are not those of a machine near.
bool poses_follow_dynamics(const Machine& actual);

/// What replay_contact() and replay_sensing() depend on besides the axes.
std::string fingerprint_of_contact(const Machine& actual);
std::string fingerprint_of_sensing(const Machine& actual);

}  // namespace vcnc
