// Plays a G-code program: interpreter, planner and interpolator behind one call per cycle.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/tick.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/operation.hpp"
#include "controller/program_error.hpp"
#include "controller/touch_trigger.hpp"
#include "model/axes.hpp"
#include "model/input_error.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// From a standing spindle into its M19 position [s].
inline constexpr double kOrientSeconds = 0.2;

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
  bool dwell = false;        ///< G4, M0, or waiting for the spindle or the operator
  bool done = false;         ///< M2/M30 reached, axes at rest
};

/// A moment of a program, in the program's own time: where it would be without any hold. The same
/// program on the same machine is at the same place at the same moment, always.
struct ProgramTime {
  Tick cycles = 0;     ///< whole cycles since the program began
  double on_path = 0;  ///< exact time on the path of the motion going on [s]
};

struct PlayerOptions {
  InterpreterOptions interpreter{};
  int from_line = 0;   ///< the program begins there (controller/gcode/block_search.hpp); 0: not
  bool feels = false;  ///< feel() is told what the probe reads
};

/// Why a program cannot go on behind a probing move.
enum class ProbeFault {
  none,
  not_found,  ///< its end was reached, which it must not be
  at_begin    ///< what it looks for is there before it begins
};

class Player {
 public:
  /// Reads and checks the whole program before anything moves: syntax, unknown words, axis limits
  /// of end points, missing feed, ... Throws ProgramError.
  Player(const std::string& path, const Machine& machine, const PlayerOptions& options = {});
  ~Player();

  /// Where the program begins, if that is in its middle. The axes go there on their own: Z up, the
  /// rotary axes, X and Y, Z down to kStandOff before the place along the tool, spindle, the rest
  /// at kApproachSpeed.
  const std::optional<BlockStart>& begins_at() const;
  static constexpr double kStandOff = 20e-3, kApproachSpeed = 10e-3;

  /// Next cycle. `start` positions are those of the machine file. Throws ProgramError only where
  /// the switch for block delete, or what was probed, has made another program of the one that was
  /// checked.
  PlayerStep step();

  /// What the probe reads, before the step of each cycle in which it was heard. A probing move
  /// (G31, G38.n) brakes within the limits of the axes as soon as its trigger (touch_trigger.hpp)
  /// says so, and the program goes on reading from where they stand; before one, and at the end of
  /// one that has found nothing, up to kSettleSeconds are waited for the reading. Who never feels
  /// has the contact at the end of each.
  void feel(const ProbeReading& reading);
  static constexpr double kSettleSeconds = 0.1;
  ProbeFault probe_fault() const;  ///< the program stands there
  /// What the probing moves have come to, in the order of the program.
  const std::vector<ProbeTouch>& touches() const;

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

  /// The switches of the panel, from the next cycle on. The overrides change the rate at which the
  /// path is run, see controller/rate_planner.hpp. Single block stops where the path passes from
  /// one block to the next, rounded corners included, and after everything else that takes time.
  /// Block delete acts on what has not been read yet: the blocks behind the next stop.
  void operate(const PanelSwitches& switches);
  /// The operator's feed hold: to rest on the path within the limits of the axes; a dwell stops.
  void feed_hold();
  /// Ends a feed hold and the wait for cycle start after M0, M1 or a single block.
  void cycle_start();
  /// Whether somebody will press cycle start; otherwise every such wait lasts kProgramStopSeconds.
  void attended(bool somebody);
  bool waiting() const;         ///< at rest, for cycle start
  bool stands_at_zero() const;  ///< at rest, for an override above 0 %

  /// What is kept of offsets, parameters and tools, as at the last stop of the axes; a stop being
  /// at most one block further than the program has been played.
  const NcData& data() const;

  /// Where the program is; during a hold: where it comes to rest.
  ProgramTime time() const;
  AxisVector rest() const;  ///< axis positions there

  /// Takes a player that has not begun to a moment and holds it there. Throws std::out_of_range
  /// when the program ends before.
  void seek(const ProgramTime& time);

 private:
  struct Search;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vcnc
