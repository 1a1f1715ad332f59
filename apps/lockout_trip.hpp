// What one run of the machine shows of its overtravel protection: log, figures, judgement.
//
// The chain (docs/time.md): the deflection at t_k is digitised and sent in cycle k. The NC unit
// judges it at the end of cycle k, its command acts in cycle k+1. The overtravel module judges it
// in cycle k+1, drives and spindle act on that in cycle k+2, the NC unit at the end of cycle k+1,
// so in k+2 as well. Hence, with T the physical crossing of a threshold and k = ceil(T / 1 ms) the
// first sample that can show it,
//   the axes brake from t_k+1 on at the earliest, from t_k+2 on at the latest (one path dead),
//   reaction = t_action - T is within (1 ms, 2 ms] with both paths, (2 ms, 3 ms] with the module's
//   alone.
// The bound that is checked is k+2: one path may be dead.
//
// Required is a reaction to a sample that shows
//   beyond the usable range                any stop
//   beyond 125 % of it, or at the limit    a quick stop
// but only the limit where the scenario does not ask for more (within_limit = false) and the ball
// moves faster than its periods can be counted (signal period / 200 us): then the sensor cannot
// know, and the mechanical switch is what is left.
// A deflection may be read wrong by the scenario's reading error.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "bus/frame.hpp"
#include "bus/main_loop.hpp"
#include "bus/messages.hpp"
#include "bus/telemetry.hpp"
#include "configs/scenario.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

class OvertravelNode;
class VirtualMachine;

inline constexpr Tick kDetectionChain = 2;  ///< sample k, judged k+1, acts k+2

/// One cycle as an observer sees it.
struct TripCycle {
  AxisVector commanded{}, measured{};
  std::array<Vec3, kLoopStepsPerCycle> deflection;  ///< true; the last one is of t_k
  OvertravelState::State module = OvertravelState::State::normal;
  OvertravelState::Cause cause = OvertravelState::Cause::none;
  bool emergency = false;  ///< EMCY FF10h
  bool nc_alarm = false;   ///< the command asks for the lock
  int drives_in_operation = 0;
  bool spindle_locked = false;
  double spindle_speed = 0;

  // What is, whatever the frames say.
  AxisVector axes{};            ///< where they are at t_k
  bool left_operation = false;  ///< a drive that was in operation is no more
  bool spindle_safe = false;    ///< locked, or stands
  bool lock = false;            ///< the spindle cannot turn
  OvertravelState::State protection = OvertravelState::State::normal;  ///< of the module
};

using TripLog = std::vector<TripCycle>;

/// Fills a log from the frames on the bus and from what is true in the modules. All outlive it.
class TripTap : public FrameTap {
 public:
  /// `overtravel` is the one in use.
  TripTap(const VirtualMachine& modules, const OvertravelNode& overtravel, TripLog& log)
      : modules_(modules), overtravel_(overtravel), log_(log) {}
  void cycle(Tick k, std::span<const Frame> frames) override;

 private:
  void look_inside(TripCycle& cycle);

  const VirtualMachine& modules_;
  const OvertravelNode& overtravel_;
  TripLog& log_;
  int most_in_operation_ = 0;
};

inline constexpr double kNever = std::numeric_limits<double>::quiet_NaN();

/// Times in seconds of the run; kNever where it did not happen.
struct TripFigures {
  bool soft = false, hard = false;  ///< commands braked in operation; drives left operation
  OvertravelState::Cause cause = OvertravelState::Cause::none;
  double threshold = kNever;          ///< T: the true deflection leaves the usable range
  double hard_threshold = kNever;     ///< it passes 125 % of the range, or the limit
  double action = kNever;             ///< the axes begin to brake
  double quick_stop = kNever;         ///< all drives have left operation
  double standstill = kNever;         ///< first after the action
  double locked = kNever;             ///< the spindle says that it is locked
  double stopping_distance = kNever;  ///< way of the controlled point from T to stand-still [m]
  double deepest = 0;                 ///< true deflection [m]
  double limit_share = 0;             ///< deepest, as a share of the mechanical limit
  double force = 0;                   ///< of the suspension [N]
  double speed = 0;                   ///< of the controlled point at T [m/s]
  bool countable = true;  ///< the ball never moved too fast for the sensor before the stop

  bool tripped() const { return soft || hard; }
  double reaction() const { return action - threshold; }
  double hard_reaction() const { return quick_stop - hard_threshold; }
};

/// How the run ended, besides what the log shows.
struct TripEnd {
  bool refused = false;
  bool complete = false, alarmed = false;
  std::string reason;
  std::size_t rows = 0;                         ///< telemetry
  bool soft_alarm = false, hard_alarm = false;  ///< 1003, 1004; 1001, 1002
  std::vector<Alarm> alarms{};
  bool spindle_stays_locked = true;  ///< M3 after the trip, without and with the NC unit's lock
  Tick run_down = 0;  ///< cycles in which the last axis comes to rest when the bus ends, -1: never
  bool module_stays_latched = true;  ///< with a probe that reads zero again
};

TripFigures measure(const TripLog& log, const Machine& machine);

/// What is not as it must be, one sentence each; empty: all as expected.
std::vector<std::string> judge(const Scenario& scenario, bool within_limit, const TripLog& log,
                               const TripFigures& figures, const TripEnd& end,
                               const Machine& machine);

/// Whether the axes stand from cycle k on for some cycles, as they truly are.
bool truly_standing(const TripLog& log, Tick k);

/// The deflection as a share of where the probe's own protection unit switches.
double limit_share(const ProbeParams& probe, const Vec3& deflection);
/// What to say when that was 1 or more although the feed had been allowed.
std::string beyond_limit(double share);

}  // namespace vcnc
