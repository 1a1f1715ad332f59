// Plays a G-code program: interpreter, planner and interpolator behind one call per cycle.
#pragma once

#include <memory>
#include <string>

#include "bus/tick.hpp"
#include "controller/program_error.hpp"
#include "model/axes.hpp"
#include "model/input_error.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// What the machine shall do in one cycle.
struct PlayerStep {
  enum class Spindle { off, clockwise, counter_clockwise, orient };
  AxisVector position{};    ///< axis positions at the end of the cycle [m, rad]
  AxisVector velocity{};    ///< their velocities there
  Vec3 tip = Vec3::Zero();  ///< controlled point (RTCP) or X, Y, Z, where it last moved [m]
  double feed = 0;          ///< commanded speed of the controlled point [m/s]
  int line = 0;             ///< program line (1-based line of the file)
  Spindle spindle = Spindle::off;
  double spindle_speed = 0;  ///< [rad/s]
  bool dwell = false;        ///< G4, M0 or waiting for the spindle
  bool done = false;         ///< M2/M30 reached, axes at rest
};

/// A moment of a program, in the program's own time: where it would be without any hold. The same
/// program on the same machine is at the same place at the same moment, always.
struct ProgramTime {
  Tick cycles = 0;     ///< whole cycles since the program began
  double on_path = 0;  ///< exact time on the path of the motion going on [s]
};

class Player {
 public:
  /// Reads and checks the whole program before anything moves: syntax, unknown words, axis limits
  /// of end points, missing feed, ... Throws ProgramError.
  Player(const std::string& path, const Machine& machine);
  ~Player();

  /// Next cycle. `start` positions are those of the machine file.
  PlayerStep step();

  /// Feed hold: from the next cycle on the axes come to rest on the path, along
  ///   d tau / dt = r (1 - 3 s^2 + 2 s^3),  s = t / T_h
  /// from the rate r at which the path is being run (1, or less while go_on() is speeding up), with
  /// T_h so long that braking takes at most half of every axis' acceleration limit besides what the
  /// program needs.
  void hold();
  bool held() const;  ///< at rest after a hold

  /// Ends a hold once the axes are at rest, else does nothing. The feed rises along
  ///   d tau / dt = 3 s^2 - 2 s^3,  s = t / T_g
  /// which passes T_g / 2 of the path's time. T_g is as long as braking takes, and a little more,
  /// so that from its end on the program is at whole cycles of its own time again: every set-point
  /// is one of the uninterrupted program, to the bit.
  void go_on();
  bool at_full_rate() const;  ///< neither held nor speeding up

  /// Where the program is; during a hold: where it comes to rest.
  ProgramTime time() const;
  AxisVector rest() const;  ///< axis positions there

  /// Takes a player that has not begun to a moment and holds it there. Throws std::out_of_range
  /// when the program ends before.
  void seek(const ProgramTime& time);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vcnc
