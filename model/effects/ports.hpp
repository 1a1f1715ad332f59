// The ports at which effects act: for each a signal that effects change and a context they read.
//
// In the order in which a set-point becomes a reading:
//
//   port          once per   signal                            lives in
//   Plan          run        tolerances of the planner         NC unit
//   Interpolation 1 ms       set-points of all axes            NC unit
//   Reception     1 ms       the set-point a drive receives    drive
//   Setpoint      100 us     the set-point of the loops        drive
//   Servo         start      gains and limits of the loops     drive
//   Encoder       reading    what a measuring system counts    drive
//   MotorForce    50 us      force of the motor                drive
//   Transmission  start      gap, compliance                   drive
//   LoadForce     50 us      further force on the table        drive
//   Friction      50 us      terms of the friction law         drive
//   Displacement  100 us     tool centre against its scale     drive
//   Pose          100 us     errors of guides, axes, piece     probe module
//   Touch         100 us     ball and its contact              probe module
//   Deflection    100 us     what the sensor feels             probe module
//   Analogue      100 us     sin/cos pair of one channel       probe module
//   Reading       100 us     what the counter says             probe module
//
// SI units throughout; of a rotary axis rad, N m, kg m^2. T is double or a dual number.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "model/axes.hpp"
#include "model/math.hpp"

namespace vcnc {

template <class T>
using Vec3Of = Eigen::Matrix<T, 3, 1>;

/// When a step happens; t = count * dt without accumulation.
struct Moment {
  double t = 0;            ///< since the first cycle [s]
  double dt = 0;           ///< between steps of the port [s]
  std::int64_t count = 0;  ///< steps before this one
};

/// Motion of one axis.
template <class T>
struct Motion {
  T position{}, velocity{}, acceleration{};
};
template <class T>
using Motions = PerAxis<Motion<T>>;

// ------------------------------------------------------------------------------------- NC unit

/// What the planner allows itself.
struct PlanPort {
  static constexpr std::string_view name = "plan";
  template <class T>
  struct Signal {
    T blend_tolerance{};  ///< added to the tolerance of G64 [m]
    T sagitta{};          ///< arcs become chords with this height [m]; 0: true arcs
  };
  template <class T>
  struct Context {};
};

/// Set-points of all axes for one cycle.
struct InterpolationPort {
  static constexpr std::string_view name = "interpolation";
  template <class T>
  struct Signal {
    PerAxis<T> position{}, velocity{};
  };
  template <class T>
  struct Context {
    Moment moment;
  };
};

// --------------------------------------------------------------------------------------- drive

/// The set-point that a drive takes from the bus, for the end of the cycle.
struct ReceptionPort {
  static constexpr std::string_view name = "reception";
  template <class T>
  struct Signal {
    T position{}, velocity{};
  };
  template <class T>
  struct Context {
    Moment moment;
  };
};

/// The set-point of the loops.
struct SetpointPort {
  static constexpr std::string_view name = "setpoint";
  template <class T>
  struct Signal {
    T position{}, velocity{};
  };
  template <class T>
  struct Context {
    Moment moment;             ///< for which the set-point is; one may come anew
    T acceleration{};          ///< of the set-point
    const Motions<T>* axes{};  ///< see MotorForcePort
  };
};

/// How the loops are set. The gains act as in model/drive/axis_drive.hpp.
struct ServoPort {
  static constexpr std::string_view name = "servo";
  template <class T>
  struct Signal {
    T kv{};             ///< position loop [1/s]
    T velocity_gain{};  ///< Kp over its declared value
    T integral_time{};  ///< Ti [s]
    T velocity_ff{}, acceleration_ff{};
    T current_lag{};  ///< [s]
    T force_limit{};  ///< [N or N m]
  };
  template <class T>
  struct Context {};
};

/// What a measuring system counts; has no memory.
struct EncoderPort {
  static constexpr std::string_view name = "encoder";
  template <class T>
  struct Signal {
    T position{};
  };
  template <class T>
  struct Context {
    bool of_load{};                ///< the measuring system on the load; else that on the motor
    T velocity{}, acceleration{};  ///< of the load
  };
};

/// Force of the motor, on the load side.
struct MotorForcePort {
  static constexpr std::string_view name = "motor force";
  template <class T>
  struct Signal {
    T force{};
  };
  template <class T>
  struct Context {
    Moment moment;
    T position{}, velocity{};  ///< of the motor side
    double travel_per_turn{};  ///< of the motor [m or rad]
    double force_limit{};      ///< declared
    /// All axes: this one as it moves, the others as commanded; may be null where no law needs it.
    const Motions<T>* axes{};
  };
};

/// Between motor and load.
struct TransmissionPort {
  static constexpr std::string_view name = "transmission";
  template <class T>
  struct Signal {
    T gap{};            ///< [m or rad]
    T compliance{};     ///< [m/N or rad/(N m)], 0 = rigid
    T damping_ratio{};  ///< of the free resonance
    T lead{};           ///< the load is ahead of the motor by this much of the travel [m/m]
    /// The load is ahead of the motor by wave sin(2 pi q/period + phase); none where wave is 0.
    T wave{}, wave_period{}, wave_phase{};
    T motor_dry{};        ///< friction on the motor's side, seen from the load [N or N m]
    T motor_viscous{};    ///< [N s/m or N m s/rad]
    T motor_stiffness{};  ///< of its bristles [N/m or N m/rad], 0: none
  };
  template <class T>
  struct Context {};
};

/// Further force on the load, positive along the axis.
struct LoadForcePort {
  static constexpr std::string_view name = "load force";
  template <class T>
  struct Signal {
    T force{};
  };
  template <class T>
  struct Context {
    Moment moment;
    T position{}, velocity{};  ///< of the load
    const Motions<T>* axes{};  ///< as in MotorForcePort
  };
};

/// Terms of the friction law (model/drive/friction.hpp); nothing below zero.
struct FrictionPort {
  static constexpr std::string_view name = "friction";
  template <class T>
  struct Signal {
    T dry{};        ///< level of dry friction at this velocity [N]
    T skew{};       ///< it slides at skew +- dry [N], |skew| <= dry
    T viscous{};    ///< [N s/m]
    T stiffness{};  ///< of the bristles, sigma0 [N/m]; 0: sticks without sliding
    T damping{};    ///< of the bristles, sigma1 [N s/m]

    Signal& operator+=(const Signal& s) {
      dry += s.dry, skew += s.skew, viscous += s.viscous;
      stiffness += s.stiffness, damping += s.damping;
      return *this;
    }
  };
  template <class T>
  struct Context {
    Moment moment;
    T position{}, velocity{};  ///< of the load
    T free_velocity{};         ///< that it would have after the step without friction
  };
};

/// Where the table is against where its scale is, along the axis.
struct DisplacementPort {
  static constexpr std::string_view name = "displacement";
  template <class T>
  struct Signal {
    T displacement{};  ///< [m or rad]
  };
  template <class T>
  struct Context {
    Moment moment;
    Motion<T> load;            ///< motion of the load, as the scale sees it
    T force{};                 ///< of the drive on it: inertia, friction, less LoadForce [N]
    const Motions<T>* axes{};  ///< as in MotorForcePort
  };
};

// -------------------------------------------------------------------------------- probe module

/// Small errors of the machine's bodies. Applied in Kinematics::forward.
template <class T>
struct GeometryErrors {
  using V = Vec3Of<T>;
  V tip = V::Zero();        ///< displacement of the tool tip by the guides, machine frame [m]
  V tool_turn = V::Zero();  ///< rotation of the tool by the guides, machine frame [rad]
  T tool_longer{};          ///< tool against its declared length [m]
  V a_shift = V::Zero();    ///< of the A axis line, machine frame at A = C = 0 [m]
  V a_tilt = V::Zero();     ///< rotation of its direction [rad]
  V c_shift = V::Zero();    ///< of the C axis line [m]
  V c_tilt = V::Zero();     ///< [rad]
  /// Displacement of the body that the A or C axis turns, in the frame of what carries the axis,
  /// which is parallel to the machine's at A = C = 0 [m].
  V a_run = V::Zero(), c_run = V::Zero();
  V piece_shift = V::Zero();  ///< of the piece, workpiece frame [m]
  V piece_tilt = V::Zero();   ///< [rad]
};

struct PosePort {
  static constexpr std::string_view name = "pose";
  template <class T>
  using Signal = GeometryErrors<T>;
  template <class T>
  struct Context {
    Moment moment;
    Motions<T> axes;  ///< true motion of all axes
    /// From the carriage of X, Y, Z to the tool tip, machine frame [m]: the arm of its tilts. The
    /// column of guides is Y on X, Z on Y, the tool on Z.
    std::array<Vec3Of<T>, 3> arm{Vec3Of<T>::Zero(), Vec3Of<T>::Zero(), Vec3Of<T>::Zero()};
  };
};

/// The ball on the surface.
struct TouchPort {
  static constexpr std::string_view name = "touch";
  template <class T>
  struct Signal {
    T radius{};          ///< effective ball radius in this direction [m]
    T friction{};        ///< Coulomb coefficient between ball and piece
    T return_to_zero{};  ///< half width of the suspension's hysteresis [m]
    T lifted{};          ///< above 0.5: the piece is not felt
  };
  template <class T>
  struct Context {
    Moment moment;
    Vec3Of<T> normal_T = Vec3Of<T>::Zero();  ///< surface normal at the last contact, probe frame
    Vec3Of<T> normal_W = Vec3Of<T>::Zero();  ///< the same in the workpiece frame
  };
};

/// What the sensor feels, probe frame.
struct DeflectionPort {
  static constexpr std::string_view name = "deflection";
  template <class T>
  struct Signal {
    Vec3Of<T> deflection = Vec3Of<T>::Zero();  ///< [m]
  };
  template <class T>
  struct Context {
    Moment moment;
    double spring_rate{};  ///< of the suspension [N/m]
  };
};

/// Sine and cosine of one channel before the converter.
struct AnaloguePort {
  static constexpr std::string_view name = "analogue";
  template <class T>
  struct Signal {
    T cosine{}, sine{};  ///< [V]; ideal: R cos(phi), R sin(phi)
  };
  template <class T>
  struct Context {
    Moment moment;
    int channel{};       ///< 0, 1, 2 for x, y, z
    double amplitude{};  ///< R [V]
  };
};

/// What the module's counters say, probe frame.
struct ReadingPort {
  static constexpr std::string_view name = "reading";
  template <class T>
  struct Signal {
    Vec3Of<T> deflection = Vec3Of<T>::Zero();  ///< [m]
  };
  template <class T>
  struct Context {
    Moment moment;
    double period{};           ///< of the signals [m]
    const Motions<T>* axes{};  ///< true motion of all axes; null where no law needs it
  };
};

}  // namespace vcnc
