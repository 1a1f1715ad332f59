// Plays a G-code program: interpreter, planner and interpolator behind one call per cycle.
#pragma once

#include <memory>
#include <string>

#include "controller/program_error.hpp"
#include "model/axes.hpp"
#include "model/input_error.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// What the machine shall do in one cycle.
struct PlayerStep {
  enum class Spindle { off, clockwise, counter_clockwise, orient };
  AxisVector position{};  ///< axis positions at the end of the cycle [m, rad]
  AxisVector velocity{};  ///< their velocities there
  double feed = 0;        ///< commanded speed of the controlled point [m/s]
  int line = 0;           ///< program line (1-based line of the file)
  Spindle spindle = Spindle::off;
  double spindle_speed = 0;  ///< [rad/s]
  bool dwell = false;        ///< G4, M0 or waiting for the spindle
  bool done = false;         ///< M2/M30 reached, axes at rest
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
  ///   d tau / dt = 1 - (3 s^2 - 2 s^3),  s = t / T_h
  /// with T_h so long that braking takes at most half of every axis' acceleration limit besides
  /// what the program needs. There is no going on yet.
  void hold();
  bool held() const;  ///< at rest after a hold

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vcnc
