// Compensation settings of the NC unit: what it knows of the errors of its machine, as numbers.
// What it makes of them: controller/compensation.hpp.
//
// Sign: every error is written as it is measured, x = actual - commanded (ISO 230-2), and the NC
// unit takes it off. Backlash is positive where the encoder is ahead of the table, the normal case
// of a motor encoder (the convention of Heidenhain).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/axes.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AxisParams;

/// Pulse of velocity at a reversal, against the quadrant error of friction:
///   u = A (exp(-t/T) - exp(-t/T_r)),  t since the reversal; T_r = 0: A exp(-t/T)
/// A follows the acceleration a at the reversal: A a/a1 below a1, A up to a2, from there straight
/// to A_min at a3 and constant beyond; a3 = 0: A at any acceleration.
struct ReversalPulse {
  double amplitude = 0;           ///< A [m/s or rad/s]
  double decay = 8e-3, rise = 0;  ///< T, T_r [s]
  double least = 0;               ///< A_min [m/s or rad/s]
  double a1 = 0, a2 = 0, a3 = 0;  ///< [m/s^2 or rad/s^2]

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    const Unit speed = rotary ? unit::deg_s : unit::mm_s;
    const Unit acceleration = rotary ? unit::deg_s2 : unit::mm_s2;
    const auto key = [&](const char* linear, const char* turning) {
      return rotary ? turning : linear;
    };
    const Range strong{0, 1e6};
    visit(key("amplitude_mm_s", "amplitude_deg_s"), p.amplitude, speed, Range{-100, 100},
          "of the velocity pulse in the new direction, 0: none");
    visit("decay_ms", p.decay, unit::ms, Range{0.5, 1000}, "time constant with which it fades");
    visit("rise_ms", p.rise, unit::ms, Range{0, 1000},
          "time constant with which it rises, below decay_ms; 0: at once");
    visit(key("least_mm_s", "least_deg_s"), p.least, speed, Range{-100, 100},
          "amplitude at accelerations beyond a3");
    visit(key("a1_mm_s2", "a1_deg_s2"), p.a1, acceleration, strong,
          "up to this acceleration at the reversal the amplitude rises from 0");
    visit(key("a2_mm_s2", "a2_deg_s2"), p.a2, acceleration, strong, "up to this one it is full");
    visit(key("a3_mm_s2", "a3_deg_s2"), p.a3, acceleration, strong,
          "from this one on it is the least; 0: full at every acceleration");
  }

  /// A for a reversal at the acceleration |a|.
  double amplitude_at(double a) const;
};

/// What is compensated on one axis by itself.
struct AxisCompensation {
  double backlash = 0;         ///< [m or rad]
  double transition = 0;       ///< of backlash and of tables with two directions [s]
  double scale = 0;            ///< error of the travel, share
  double scale_reference = 0;  ///< where it is none [m or rad]
  double lead = 0;             ///< the set-point goes out this much earlier [s]
  ReversalPulse friction;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "backlash_arcsec" : "backlash_um", p.backlash, rotary ? unit::arcsec : unit::um,
          Range{-2000, 2000}, "the encoder is this much ahead of the table, whole gap");
    visit("transition_ms", p.transition, unit::ms, Range{0, 1000},
          "duration of what changes at a reversal (backlash, tables with two directions); 0: as "
          "fast as half of the axis' limits allow");
    visit(rotary ? "scale_urad_per_rad" : "scale_um_per_m", p.scale,
          Unit{rotary ? "urad_per_rad" : "um_per_m", 1e-6}, Range{-10000, 10000},
          "true travel less measured travel");
    visit(rotary ? "scale_reference_deg" : "scale_reference_mm", p.scale_reference,
          rotary ? unit::deg : unit::mm, Range{-1e4, 1e4}, "position at which the scale is right");
    visit("lead_us", p.lead, unit::us, Range{-5000, 5000},
          "the axis lags by this: its set-point goes out so much earlier");
    visit.group("friction", p.friction, "velocity pulse at a reversal", rotary);
  }
};

/// An error of one axis over the position of an axis, the same or another one: pitch, straightness,
/// sag. Between the points linear, beyond the ends constant.
struct CompensationTable {
  enum class OfAxis { X, Y, Z, A, C };
  enum class FileType { actual, trim };

  OfAxis axis = OfAxis::X;  ///< that is corrected
  OfAxis over = OfAxis::X;  ///< by whose position
  std::vector<double> at;   ///< points, ascending
  std::vector<double> error;
  std::vector<double> error_reverse;  ///< moving towards smaller positions; empty: as `error`
  bool modulo = false;                ///< repeats: the last point is the first one again
  std::string file;                   ///< instead of the points
  FileType file_type = FileType::actual;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    axis_field("axis", p.axis, visit, "the axis that is corrected");
    axis_field("over", p.over, visit, "the axis by whose position");
    const bool turning = rotary(p.over), turned = rotary(p.axis);
    visit(turning ? "at_deg" : "at_mm", p.at, turning ? unit::deg : unit::mm, Range{-1e5, 1e5},
          "positions, ascending");
    visit(turned ? "error_arcsec" : "error_um", p.error, turned ? unit::arcsec : unit::um,
          Range{-1e5, 1e5}, "actual less commanded position there");
    visit(turned ? "error_reverse_arcsec" : "error_reverse_um", p.error_reverse,
          turned ? unit::arcsec : unit::um, Range{-1e5, 1e5},
          "the same when `over` moves towards smaller positions; empty: no difference");
    visit("modulo", p.modulo, "the table repeats, its last point being the first one again");
    visit("file", p.file,
          "file of points instead, relative to this one: lines of nominal, forward, reverse "
          "[mm or deg], as of LinuxCNC");
    visit.choice("file_type", p.file_type, {{"actual", FileType::actual}, {"trim", FileType::trim}},
                 "its second and third number: actual positions, or nominal less actual");
  }

  static bool rotary(OfAxis a) { return is_rotary(static_cast<std::size_t>(a)); }
  std::size_t axis_index() const { return static_cast<std::size_t>(axis); }
  std::size_t over_index() const { return static_cast<std::size_t>(over); }
  /// Largest difference of the two directions [m or rad].
  double largest_jump() const;
  /// Largest error [m or rad].
  double largest() const;

 private:
  template <class Axis, class Visit>
  static void axis_field(const char* key, Axis& a, Visit& visit, const char* doc) {
    using enum OfAxis;
    visit.choice(key, a, {{"X", X}, {"Y", Y}, {"Z", Z}, {"A", A}, {"C", C}}, doc);
  }
};

/// Squareness of the linear axes, as the effect of that name has it: dx = S_xy y + S_xz z,
/// dy = S_yz z. Positive: the angle between the positive axes is less than 90 deg.
struct SquarenessCompensation {
  double xy = 0, xz = 0, yz = 0;  ///< [rad]

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit um_per_m{"um_per_m", 1e-6};
    constexpr Range range{-5000, 5000};
    visit("xy_um_per_m", p.xy, um_per_m, range, "error in X per way in Y");
    visit("xz_um_per_m", p.xz, um_per_m, range, "error in X per way in Z");
    visit("yz_um_per_m", p.yz, um_per_m, range, "error in Y per way in Z");
  }
};

/// All of it; by default nothing is compensated.
struct CompensationParams {
  PerAxis<AxisCompensation> axes;
  SquarenessCompensation squareness;
  std::vector<CompensationTable> tables;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      visit.group(kAxisNames[i], p.axes[i], "errors of one axis", is_rotary(i));
    visit.group("squareness", p.squareness, "of the linear axes");
    visit.list("table", p.tables, "an error of one axis over the position of an axis");
  }

  /// Largest jump of the correction of an axis at a reversal of `over` [m or rad].
  double largest_jump(std::size_t axis, std::size_t over) const;
  /// Empty, or what is wrong with it on these axes, in one sentence.
  std::string objection(const PerAxis<AxisParams>& machine_axes) const;
};

/// The shortest time in which an axis may change its position by `jump` along the quadratic
/// B-spline of velocity, whose peaks are 9/4 jump/T, 9 jump/T^2 and 54 jump/T^3.
double shortest_transition(double jump, double velocity, double acceleration, double jerk);

}  // namespace vcnc
