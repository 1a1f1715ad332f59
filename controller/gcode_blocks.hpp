// What a program asks for, as typed blocks: moves, dwells, spindle words, stops, the end.
#pragma once

#include <cmath>
#include <optional>
#include <variant>

#include "model/geometry/kinematics.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Coordinates a program speaks: (X, Y, Z, A, C), either the controlled point with the rotary axes
/// (RTCP) or five axis positions [m, rad].
using Coordinates = Eigen::Matrix<double, 5, 1>;

/// Where the axes stand at switch-on, as axis positions.
Coordinates start_coordinates(const Machine& machine);

/// Five numbers by axis, as they are.
AxisVector as_axes(const Coordinates& x);

/// What the coordinates of a move mean. Under a tilted plane they are those of a frame F in the
/// workpiece:  p_W = tilt_origin + Rz(tilt[0]) Rx(tilt[1]) Rz(tilt[2]) p_F.
struct MotionFrame {
  bool rtcp = false;                ///< false: axis positions; the rest has no meaning then
  Vec3 p_MW = Vec3::Zero();         ///< work offset [m]
  double tool_length = 0;           ///< [m]
  Vec3 tilt_origin = Vec3::Zero();  ///< [m]
  Vec3 tilt = Vec3::Zero();         ///< Euler angles z, x', z'' [rad]
  friend bool operator==(const MotionFrame&, const MotionFrame&) = default;
};

/// Converts between the coordinates of a frame and axis positions.
class FrameMap {
 public:
  FrameMap(const KinematicsParams& params, const MotionFrame& frame);
  Coordinates to_axes(const Coordinates& x) const;
  Coordinates from_axes(const Coordinates& q) const;

 private:
  std::optional<Kinematics> kinematics_;
  bool tilted_ = false;
  Vec3 origin_;
  Mat3 R_WF_;
};

/// Rz(angles[0]) Rx(angles[1]) Rz(angles[2]).
Mat3 tilt_rotation(const Vec3& angles);

/// Circle (or spiral, within the radius tolerance) about an axis parallel to X, Y or Z.
struct Arc {
  Vec3 centre = Vec3::Zero();  ///< its component along the normal has no meaning
  std::size_t normal = kZ;     ///< index of the plane's normal
  double sweep = 0;            ///< [rad], positive counter-clockwise seen from +normal
};

struct Move {
  enum class Kind { rapid, line, arc };
  enum class Feed { none, tip, rotary, time };  ///< none: rapid; rotary: only A, C move
  Kind kind = Kind::line;
  Coordinates start = Coordinates::Zero(), end = Coordinates::Zero();
  MotionFrame frame;
  Arc arc;
  Feed feed_mode = Feed::none;
  double feed = 0;       ///< tip [m/s], rotary [rad/s], time [s] for the whole move
  bool exact = false;    ///< G61
  double tolerance = 0;  ///< G64: of the controlled point [m]
  NcParams::Dynamics dynamics = NcParams::Dynamics::smooth;
  bool alone = false;  ///< begins and ends at rest (G28, G53, probing)
  /// G31, G38.n: ends where the probe touches, or lets go; at its end only if that is allowed.
  enum class Probe { none, touch, touch_or_end, leave, leave_or_end };
  Probe probe = Probe::none;
  /// What the operator's overrides may do: `fixed` runs at 100 % (M49, probing), `locked` cannot be
  /// held before its end either (threads).
  enum class Panel { acts, fixed, locked };
  Panel panel = Panel::acts;
  /// Feed as the program gives it where that is not per minute: [m] per turn of the spindle (G95).
  double feed_per_turn = 0;
  int line = 0, column = 0;  ///< of the word that asks for it; 0: not from a program
};

struct Dwell {
  double seconds = 0;
  int line = 0;
};

/// G96: the spindle turns as fast as its surface at the distance of X from the axis of rotation is
/// to pass the tool,  n = v / |x - axis|,  up to a limit.
struct SurfaceSpeed {
  double speed = 0;  ///< v [m/s]
  double axis = 0;   ///< X of the frame that programs call 0 [m]
  double most = 0;   ///< [rad/s]
  double at(double x) const {
    const double radius = std::abs(x - axis);
    return radius * most > speed ? speed / radius : most;
  }
};

struct SpindleWord {
  enum class Mode { off, clockwise, counter_clockwise, orient };
  Mode mode = Mode::off;
  double speed = 0;  ///< [rad/s]; under G96 the one where it is said
  int line = 0;
  std::optional<SurfaceSpeed> surface{};  ///< from here on
};

/// M0 (waits), M1 (waits where the switch for it is on) and M6, all with the axes at rest.
struct ProgramStop {
  bool optional = false;  ///< M1, M6
  int line = 0;
  bool tool_change = false;  ///< M6
};

struct ProgramEnd {
  int line = 0;
};

/// A probing move that waits for the probe to let go.
constexpr bool leaves(Move::Probe probe) { return probe >= Move::Probe::leave; }
/// One that may not come to its end.
constexpr bool must_find(Move::Probe probe) {
  return probe == Move::Probe::touch || probe == Move::Probe::leave;
}

using Block = std::variant<Move, Dwell, SpindleWord, ProgramStop, ProgramEnd>;

}  // namespace vcnc
