// The machine as data: every parameter a machine file may hold.
//
// What stands outside `effects` is the declared machine: what its builder says it is. `effects`
// holds what a real machine does besides; every effect is absent by default (its null value), so
// that a file without an [effects] table is the ideal machine. The analysis is only ever given the
// declared part (see declared()).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/axes.hpp"
#include "model/compensation.hpp"
#include "model/effects/effects.hpp"
#include "model/fields.hpp"

namespace vcnc {

/// Which body carries the rotary axes. Equations: model/geometry/kinematics.hpp.
struct KinematicsParams {
  enum class Type { trunnion, head };
  Type type = Type::trunnion;
  Vec3 p_MA = Vec3::Zero();  ///< a point on the A axis, machine frame, axes at zero (trunnion)
  Vec3 p_MC = Vec3::Zero();  ///< a point on the C axis, machine frame, axes at zero (trunnion)
  Vec3 p_CA = Vec3::Zero();  ///< from the C axis to the A axis at zero (head)
  Vec3 p_AG{0, 0, -0.2};     ///< from the A axis to the spindle gauge point at zero (head)
  bool a_reversed = false;   ///< the control counts A against ISO 841
  bool c_reversed = false;   ///< the control counts C against ISO 841

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit.choice("type", p.type, {{"trunnion", Type::trunnion}, {"head", Type::head}},
                 "trunnion: A carries the C table; head: C carries the A spindle head");
    visit("a_axis_point_mm", p.p_MA, unit::mm, Range{-1e4, 1e4}, "trunnion: a point on the A axis");
    visit("c_axis_point_mm", p.p_MC, unit::mm, Range{-1e4, 1e4}, "trunnion: a point on the C axis");
    visit("c_to_a_mm", p.p_CA, unit::mm, Range{-1e4, 1e4}, "head: from the C axis to the A axis");
    visit("a_to_gauge_mm", p.p_AG, unit::mm, Range{-1e4, 1e4},
          "head: from the A axis to the spindle gauge point (pivot length along -z)");
    visit("a_reversed", p.a_reversed, "A counts against ISO 841");
    visit("c_reversed", p.c_reversed, "C counts against ISO 841");
  }
};

/// Travel and motion limits of one axis, SI (m or rad).
struct AxisLimits {
  double min = -1, max = 1, start = 0;
  double velocity = 0.5, acceleration = 5, jerk = 50;
  double following_window = 0;     ///< drive fault beyond it; 0: AxisParams::following_window
  double switch_distance = 0.005;  ///< limit switches beyond the travel limits

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    const Range any{-1e6, 1e6}, positive{1e-3, 1e7};
    visit(rotary ? "min_deg" : "min_mm", p.min, rotary ? unit::deg : unit::mm, any,
          "lower travel limit");
    visit(rotary ? "max_deg" : "max_mm", p.max, rotary ? unit::deg : unit::mm, any,
          "upper travel limit");
    visit(rotary ? "start_deg" : "start_mm", p.start, rotary ? unit::deg : unit::mm, any,
          "position at switch-on; also the G28 reference position");
    visit(rotary ? "velocity_deg_s" : "velocity_mm_s", p.velocity,
          rotary ? unit::deg_s : unit::mm_s, positive, "largest velocity");
    visit(rotary ? "acceleration_deg_s2" : "acceleration_mm_s2", p.acceleration,
          rotary ? unit::deg_s2 : unit::mm_s2, positive, "largest acceleration");
    visit(rotary ? "jerk_deg_s3" : "jerk_mm_s3", p.jerk, rotary ? unit::deg_s3 : unit::mm_s3,
          positive, "largest jerk");
    visit(rotary ? "following_window_deg" : "following_window_mm", p.following_window,
          rotary ? unit::deg : unit::mm, Range{0, 1000},
          "following error that faults the drive; 0: 1.5 x velocity / Kv and 1 mm or 1 deg");
    visit(rotary ? "switch_distance_deg" : "switch_distance_mm", p.switch_distance,
          rotary ? unit::deg : unit::mm, Range{0, 1000},
          "limit switches stand this far outside the travel limits");
  }
};

/// Controller of one drive. Equations: model/drive/axis_drive.hpp, sampled_controller.hpp.
struct ServoParams {
  enum class Feedback { motor, load };
  enum class Controller { cascade, sampled };
  Controller controller = Controller::cascade;
  double kv_per_s = 40;            ///< position loop gain
  double velocity_bandwidth = 80;  ///< velocity loop crossover [Hz]; Kp = 2 pi f J
  double velocity_gain = 0;        ///< Kp itself [N s/m or N m s/rad]; 0: by the crossover
  double integral_time = 0.010;    ///< velocity loop integral time Ti [s], cascade only
  double dead_time = 0;            ///< from a sample to its force [s], sampled only
  double velocity_ff = 1;          ///< 1 = full velocity feed-forward
  double acceleration_ff = 1;      ///< 1 = full acceleration feed-forward
  double current_lag = 0;          ///< first-order lag of the force/torque [s]
  double position_lag = 0;         ///< first-order lag of the position loop [s], cascade only
  double setpoint_lag = 0;         ///< of the set-point of the position loop [s], cascade only
  double velocity_lag = 0;         ///< of the filter of the measured velocity [s], cascade only
  double feedforward_lag = 0;      ///< of both feed-forwards [s], cascade only
  Feedback feedback = Feedback::load;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit.choice("controller", p.controller,
                 {{"cascade", Controller::cascade}, {"sampled", Controller::sampled}},
                 "cascade: fast loops in the drive; sampled: P position, P velocity, once a cycle");
    visit("kv_per_s", p.kv_per_s, unit::per_s, Range{0.1, 1000},
          "position loop gain; with full feed-forward an ideal drive does not show it");
    visit("velocity_bandwidth_Hz", p.velocity_bandwidth, unit::hz, Range{1, 1000},
          "velocity loop crossover frequency");
    visit(rotary ? "velocity_gain_Nms_per_rad" : "velocity_gain_Ns_per_m", p.velocity_gain,
          rotary ? unit::nm_s_per_rad : unit::n_s_per_m, Range{0, 1e8},
          "velocity loop gain where it is known; 0: from the crossover frequency and the inertia");
    visit("integral_time_ms", p.integral_time, unit::ms, Range{0.5, 10000},
          "velocity loop integral time of a cascade");
    visit("dead_time_ms", p.dead_time, unit::ms, Range{0, 20},
          "sampled controller: from the sample to the force it demands");
    visit("velocity_ff", p.velocity_ff, unit::none, Range{0, 2}, "velocity feed-forward, 1 = full");
    visit("acceleration_ff", p.acceleration_ff, unit::none, Range{0, 2},
          "acceleration feed-forward, 1 = the force that the declared inertia needs");
    visit("current_lag_us", p.current_lag, unit::us, Range{0, 5000}, "lag of the current loop");
    visit("position_lag_us", p.position_lag, unit::us, Range{0, 5000},
          "lag of the position loop of a cascade: half its cycle, and its computing time; "
          "feed-forward passes by it");
    visit("setpoint_lag_us", p.setpoint_lag, unit::us, Range{0, 5000},
          "lag of the set-point of a cascade's position loop, feed-forward passes by it: the "
          "balancing filter, which waits for the velocity loop");
    visit("velocity_lag_us", p.velocity_lag, unit::us, Range{0, 5000},
          "lag of the filter of a cascade's measured velocity");
    visit("feedforward_lag_us", p.feedforward_lag, unit::us, Range{0, 5000},
          "lag of a cascade's feed-forward of velocity and acceleration; of differences of "
          "set-points "
          "half a cycle and more");
    visit.choice(
        "feedback", p.feedback, {{"motor", Feedback::motor}, {"load", Feedback::load}},
        "measuring system of the position loop: indirect (motor) or direct (load); the speed is "
        "the motor's");
  }
};

/// Moving masses and motor of one drive, SI (kg, N for linear; kg m^2, N m for rotary).
struct MechanicsParams {
  double load = 500;               ///< table and what it carries
  double motor_inertia = 0.01;     ///< motor and screw [kg m^2]
  double travel_per_turn = 0.012;  ///< [m] or [rad] per motor turn
  double force_limit = 4e4;        ///< largest force or torque, load side

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "load_kgm2" : "load_kg", p.load, rotary ? unit::kgm2 : unit::kg,
          Range{1e-4, 1e5}, "moving mass or inertia on the load side");
    visit("motor_inertia_kgm2", p.motor_inertia, unit::kgm2, Range{0, 100},
          "motor and screw inertia");
    visit(rotary ? "travel_per_turn_deg" : "travel_per_turn_mm", p.travel_per_turn,
          rotary ? unit::deg : unit::mm, Range{0.01, 360}, "axis travel per motor turn");
    visit(rotary ? "torque_limit_Nm" : "force_limit_N", p.force_limit,
          rotary ? unit::newton_m : unit::newton, Range{0.1, 1e6},
          "largest drive force, load side");
  }

  /// Motor inertia seen from the load: J_m (2 pi / travel_per_turn)^2 [kg or kg m^2].
  double reflected_inertia() const {
    const double turns = 2 * kPi / travel_per_turn;
    return motor_inertia * turns * turns;
  }
  double total_inertia() const { return load + reflected_inertia(); }
};

struct AxisParams {
  AxisLimits limits;
  ServoParams servo;
  MechanicsParams mechanics;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    AxisLimits::fields(p.limits, visit, rotary);
    ServoParams::fields(p.servo, visit, rotary);
    MechanicsParams::fields(p.mechanics, visit, rotary);
  }

  /// Following error that faults the drive [m or rad]. By default one and a half times what an axis
  /// at full speed lags without feed-forward, and a little.
  double following_window(bool rotary) const {
    if (limits.following_window > 0) return limits.following_window;
    return 1.5 * limits.velocity / servo.kv_per_s + (rotary ? kDegree : 1e-3);
  }
};

struct SpindleParams {
  double max_speed = 12000 * unit::rpm.to_si;  ///< [rad/s]
  double acceleration = 400;                   ///< [rad/s^2]
  double orient_angle = 0;                     ///< M19 position [rad]

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("max_speed_rpm", p.max_speed, unit::rpm, Range{1, 200000}, "largest spindle speed");
    visit("acceleration_rad_s2", p.acceleration, Unit{"rad_s2", 1}, Range{1, 1e5},
          "spindle acceleration");
    visit("orient_angle_deg", p.orient_angle, unit::deg, Range{-360, 360}, "M19 position");
  }
};

/// Scanning probe and its acquisition module. Equations: model/probe/*.hpp.
struct ProbeParams {
  enum class Mounting { vertical, horizontal };
  enum class Correction { off, heydemann };
  bool in_spindle = true;  ///< locks out M3/M4
  double ball_radius = 3e-3;
  double length = 0.150;      ///< gauge line to ball centre: the tool length of the probe
  double spring_rate = 1324;  ///< [N/m], 135 gf/mm
  double moving_mass = 0.055;
  double stylus_mass = 0.010;
  double damping_ratio = 0.3;
  Mounting mounting = Mounting::vertical;
  double range = 2.0e-3;  ///< measuring range each side, before the shift by gravity
  double overtravel_lateral = 18e-3;
  double overtravel_axial = 5e-3;
  double overtravel_force_lateral = 20;
  double overtravel_force_axial = 400;
  double signal_period = 20e-6;
  int adc_bits = 16;
  Correction correction = Correction::off;
  double min_deflection = 10e-6;  ///< below it there is no belief in contact

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("in_spindle", p.in_spindle, "the probe is in the spindle: M3 and M4 are locked out");
    visit("ball_radius_mm", p.ball_radius, unit::mm, Range{0.1, 20}, "stylus ball radius");
    visit("length_mm", p.length, unit::mm, Range{10, 1000}, "spindle gauge line to ball centre");
    visit("spring_rate_N_per_mm", p.spring_rate, unit::n_per_mm, Range{0.01, 100},
          "suspension stiffness");
    visit("moving_mass_g", p.moving_mass, unit::g, Range{1, 1000}, "moving mass without stylus");
    visit("stylus_mass_g", p.stylus_mass, unit::g, Range{0.1, 500}, "stylus mass");
    visit("damping_ratio", p.damping_ratio, unit::none, Range{0, 2},
          "of the suspension in free air");
    visit.choice("mounting", p.mounting,
                 {{"vertical", Mounting::vertical}, {"horizontal", Mounting::horizontal}},
                 "how the probe hangs: gravity shifts its range");
    visit("range_mm", p.range, unit::mm, Range{0.1, 20}, "measuring range each side, unloaded");
    visit("overtravel_lateral_mm", p.overtravel_lateral, unit::mm, Range{0.1, 50},
          "lateral deflection that trips the overtravel protection");
    visit("overtravel_axial_mm", p.overtravel_axial, unit::mm, Range{0.1, 50},
          "axial deflection that trips the overtravel protection");
    visit("overtravel_force_lateral_N", p.overtravel_force_lateral, unit::newton, Range{0.1, 1000},
          "lateral force that trips the overtravel protection");
    visit("overtravel_force_axial_N", p.overtravel_force_axial, unit::newton, Range{0.1, 5000},
          "axial force that trips the overtravel protection");
    visit("signal_period_um", p.signal_period, unit::um, Range{0.1, 1000},
          "period of the sin/cos signals");
    visit("adc_bits", p.adc_bits, Range{12, 16}, "converter resolution, 12 or 16");
    visit.choice("correction", p.correction,
                 {{"off", Correction::off}, {"heydemann", Correction::heydemann}},
                 "online correction of the sin/cos signals");
    visit("min_deflection_um", p.min_deflection, unit::um, Range{1, 1000},
          "smallest deflection that counts as contact");
  }
};

struct BusParams {
  double nominal_bit_rate = 1e6;  ///< [bit/s] arbitration phase
  double data_bit_rate = 5e6;     ///< [bit/s] data phase
  double heartbeat_time = 0.1;    ///< producer heartbeat of every module [s]; 0: none

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("nominal_Mbit_s", p.nominal_bit_rate, unit::mbit_s, Range{0.125, 1},
          "arbitration bit rate");
    visit("data_Mbit_s", p.data_bit_rate, unit::mbit_s, Range{0.125, 8}, "CAN FD data bit rate");
    visit("heartbeat_ms", p.heartbeat_time, unit::ms, Range{0, 10000},
          "producer heartbeat of every module (1017h), 0: none");
  }
};

/// Mains and the uninterruptible supply of NC unit, modules and drives (model/safety/supply.hpp).
struct SupplyParams {
  double hold_up_energy = 1500;    ///< [J] that a charged store can give
  double electronics_power = 150;  ///< [W] NC unit, probe, overtravel module, drive electronics
  double drive_power = 20;         ///< [W] of each drive that holds its axis
  double efficiency = 0.85;        ///< from the store to the motion
  double signal_delay = 5e-3;      ///< from the loss of the mains to the power-fail signal [s]

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("hold_up_energy_J", p.hold_up_energy, unit::joule, Range{0, 1e6},
          "energy of the uninterruptible supply, 0: there is none");
    visit("electronics_W", p.electronics_power, unit::watt, Range{1, 1e5},
          "what NC unit and modules take");
    visit("drive_W", p.drive_power, unit::watt, Range{0, 1e5},
          "what each drive takes to hold its axis");
    visit("efficiency", p.efficiency, unit::none, Range{0.1, 1}, "from the store to the motion");
    visit("signal_ms", p.signal_delay, unit::ms, Range{0, 1000},
          "from the loss of the mains to the power-fail signal");
  }
};

/// What the NC unit knows besides the axes.
struct NcParams {
  enum class Dynamics { smooth, fast };     ///< controller/planner.hpp
  double blend_tolerance = 10e-6;           ///< G64 without P [m]
  double angle_tolerance = 0.01 * kDegree;  ///< orientation tolerance of blends [rad]
  double rapid_limit = 1.0;                 ///< share of the axis limits used by G0
  Dynamics dynamics = Dynamics::smooth;     ///< of programs that do not choose
  CompensationParams compensation;          ///< of the machine's errors
  std::string program_path;                 ///< folders of subprograms, separated by ':'

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("blend_tolerance_um", p.blend_tolerance, unit::um, Range{0.1, 1000},
          "tip tolerance of G64 without P");
    visit("angle_tolerance_deg", p.angle_tolerance, unit::deg, Range{1e-5, 1},
          "orientation tolerance of blends");
    visit("rapid_limit", p.rapid_limit, unit::none, Range{0.01, 1},
          "share of the axis limits used by G0");
    visit.choice("dynamics", p.dynamics, {{"smooth", Dynamics::smooth}, {"fast", Dynamics::fast}},
                 "of programs that do not choose: gentle, or fastest within the axis limits");
    visit.group("compensation", p.compensation, "of the machine's errors, by the NC unit");
    visit("program_path", p.program_path,
          "folders of subprograms, relative to this file, separated by ':'; the program's own is "
          "searched first");
  }
};

/// Workpiece, work offsets, tool lengths and what the evaluation needs.
struct SetupParams {
  std::string piece;  ///< path of a piece file; empty: no workpiece
  std::array<Vec3, 9> work_offset{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(),
                                  Vec3::Zero(), Vec3::Zero(), Vec3::Zero(),
                                  Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< G54..G59.3 [m]
  std::vector<double> tool_length;    ///< H1, H2, ... [m]; the probe is H1 when empty
  std::vector<double> tool_diameter;  ///< D1, D2, ... [m]; that of the ball is D1 when empty
  double predeflection = 0.5e-3;      ///< programmed interference with the piece
  double tolerance = 50e-6;           ///< verdict: |e_n| must stay within
  double bin_length = 1e-3;           ///< arc-length bins of the coverage

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("piece", p.piece, "piece file, relative to this file; empty: nothing to touch");
    constexpr std::array<const char*, 9> keys{"g54_mm", "g55_mm",   "g56_mm",   "g57_mm",  "g58_mm",
                                              "g59_mm", "g59_1_mm", "g59_2_mm", "g59_3_mm"};
    for (std::size_t i = 0; i < keys.size(); ++i)
      visit(keys[i], p.work_offset[i], unit::mm, Range{-1e4, 1e4},
            "work offset, machine frame at A = C = 0");
    visit("tool_length_mm", p.tool_length, unit::mm, Range{0, 1000},
          "tool lengths H1, H2, ...; H1 is the probe's length when empty");
    visit("tool_diameter_mm", p.tool_diameter, unit::mm, Range{0, 1000},
          "tool diameters D1, D2, ...; D1 is that of the probe's ball when empty");
    visit("predeflection_mm", p.predeflection, unit::mm, Range{0.01, 5},
          "how deep the program drives the ball into the piece");
    visit("tolerance_um", p.tolerance, unit::um, Range{0.1, 10000},
          "verdict: e_n must stay within plus and minus this");
    visit("bin_length_mm", p.bin_length, unit::mm, Range{0.05, 100},
          "arc-length bins of the coverage");
  }
};

/// How well a number of the file is known where a diagnosis is to believe something else of it than
/// it does of its kind (diagnosis/candidates/freed_number.hpp).
struct Uncertainty {
  std::string key;      ///< any number of the machine, effects included
  double standard = 0;  ///< standard uncertainty, in the unit of the key
  /// Bounds, in the unit of the key; empty: those of the key. With bounds and no standard
  /// uncertainty nothing is known but these.
  std::vector<double> between;

  bool exact() const { return standard == 0 && between.empty(); }
  /// Whether no value within the bounds is more likely than another.
  bool free() const { return standard == 0 && !between.empty(); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("key", p.key, "a number of this file, effects included, e.g. axes.X.kv_per_s");
    visit("standard", p.standard, Unit{"", 1}, Range{0, 1e12},
          "standard uncertainty in the unit of the key; 0 without bounds: known exactly");
    visit("between", p.between, Unit{"", 1}, Range{-1e12, 1e12},
          "[least, most] in the unit of the key; without a standard uncertainty: free within");
  }
};

/// What a model that was fitted to a healthy run leaves of one of its signals, noise aside: the
/// error of the model's form, which is nothing that needs a cause.
struct CommissionedSignal {
  std::string signal;  ///< "position X", "force X", "deflection x"
  double left = 0;     ///< RMS [m, rad, N or N m]

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("signal", p.signal, "position X, twist X, force X, deflection x, ...");
    visit("left_si", p.left, Unit{"", 1}, Range{0, 1e6},
          "RMS that the model leaves of it in a healthy run, noise aside, in m, rad, m/s, rad/s, N "
          "or Nm");
  }
};

// ---------------------------------------------------------------------------------- machine

struct Machine {
  std::string name = "unnamed";
  KinematicsParams kinematics;
  PerAxis<AxisParams> axes;
  SpindleParams spindle;
  ProbeParams probe;
  BusParams bus;
  SupplyParams supply;
  NcParams nc;
  SetupParams setup;
  Effects effects;
  std::vector<Uncertainty> uncertainties;
  std::vector<CommissionedSignal> commissioned;

  Machine();  ///< sensible limits and masses for every axis

  /// Length offset H = 1, 2, ...; 0 gives 0. Throws std::out_of_range for an unknown H.
  double tool_length(int h) const;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("name", p.name, "shown in reports");
    visit.group("kinematics", p.kinematics, "how the rotary axes are carried");
    visit.section("axes", "the five axes", [&](auto& table) {
      for (std::size_t i = 0; i < kAxisCount; ++i)
        table.group(kAxisNames[i], p.axes[i], "one axis", is_rotary(i));
    });
    visit.group("spindle", p.spindle, "spindle drive");
    visit.group("probe", p.probe, "scanning probe and acquisition module");
    visit.group("bus", p.bus, "field bus");
    visit.group("supply", p.supply, "mains and uninterruptible supply");
    visit.group("nc", p.nc, "NC unit");
    visit.group("setup", p.setup, "workpiece, offsets, evaluation");
    visit.group("effects", p.effects, "what a real machine does besides");
    visit.list("uncertainty", p.uncertainties,
               "how well a number is known, for a diagnosis; others are of the tolerance of their "
               "kind (docs/diagnosis.md)");
    visit.list("commissioned", p.commissioned,
               "what a fit to a healthy run left (vcnc commission)");
  }
};

/// The machine as declared: the same machine with every effect at its null value. All that the
/// analysis is ever given.
Machine declared(Machine machine);

/// The machine as it is: every deviation applied to the parameter it names. What the simulators
/// build. Throws std::invalid_argument where a deviation names no number or is out of its range.
Machine actual(Machine machine);

/// What the NC unit has: the declared machine, but with those deviations that are in its own
/// settings ([nc] and the velocity, acceleration and jerk limits of the axes), and with the effects
/// of [effects.nc].
Machine as_nc_believes(const Machine& machine);

}  // namespace vcnc
