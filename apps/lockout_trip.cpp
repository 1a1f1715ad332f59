#include "apps/lockout_trip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/virtual_machine.hpp"
#include "bus/cia402.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/probe/contact.hpp"
#include "model/safety/protection.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc {

namespace {

using Expect = Scenario::Expect;
using State = OvertravelState::State;
using Cause = OvertravelState::Cause;

constexpr double kSampleTime = kCycle / kLoopStepsPerCycle;
constexpr double kStandingLinear = 1e-6, kStandingRotary = 1e-5;  ///< per cycle
constexpr Tick kStandingCycles = 5;

Tick size_of(const TripLog& log) { return static_cast<Tick>(log.size()); }
const TripCycle& at(const TripLog& log, Tick k) { return log[static_cast<std::size_t>(k)]; }
/// The deflection that the sample of cycle k shows.
const Vec3& sampled(const TripLog& log, Tick k) { return at(log, k).deflection.back(); }

/// Time of sub-sample j of cycle k.
double time_of(Tick k, std::size_t j) {
  return seconds(k) - static_cast<double>(kLoopStepsPerCycle - 1 - j) * kSampleTime;
}

/// First cycle for which `f` holds, -1: none.
template <class F>
Tick first(const TripLog& log, F&& f, Tick from = 0) {
  for (Tick k = std::max<Tick>(from, 0); k < size_of(log); ++k)
    if (f(k)) return k;
  return -1;
}

/// When `value` of the true deflection first exceeds 1, between two sub-samples by a line.
template <class F>
double crossing(const TripLog& log, F&& value) {
  double before = 0;
  for (Tick k = 0; k < size_of(log); ++k)
    for (std::size_t j = 0; j < kLoopStepsPerCycle; ++j) {
      const double now = value(at(log, k).deflection[j]);
      if (now > 1)
        return time_of(k, j) - (now > before ? (now - 1) / (now - before) : 0) * kSampleTime;
      before = now;
    }
  return kNever;
}

bool standing(const TripLog& log, Tick k) {
  if (k < 1) return false;
  for (Tick c = k; c < std::min(k + kStandingCycles, size_of(log)); ++c)
    for (std::size_t i = 0; i < kAxisCount; ++i)
      if (std::abs(at(log, c).measured[i] - at(log, c - 1).measured[i]) >
          (is_rotary(i) ? kStandingRotary : kStandingLinear))
        return false;
  return true;
}

}  // namespace

bool truly_standing(const TripLog& log, Tick k) {
  if (k < 1) return false;
  for (Tick c = k; c < std::min(k + kStandingCycles, size_of(log)); ++c)
    for (std::size_t i = 0; i < kAxisCount; ++i)
      if (std::abs(at(log, c).axes[i] - at(log, c - 1).axes[i]) >
          (is_rotary(i) ? kStandingRotary : kStandingLinear))
        return false;
  return true;
}

namespace {

bool in_operation(const TripLog& log, Tick k) {
  return at(log, k).drives_in_operation == static_cast<int>(kAxisCount);
}

/// First cycle in which every drive has left operation.
Tick left_operation(const TripLog& log) {
  const Tick enabled = first(log, [&](Tick k) { return in_operation(log, k); });
  if (enabled < 0) return -1;
  return first(
      log, [&](Tick k) { return at(log, k).drives_in_operation == 0; }, enabled);
}

/// Controlled point at the end of cycle k, workpiece frame.
Vec3 tip(const TripLog& log, const Kinematics& kinematics, Tick k) {
  return kinematics.forward(at(log, k).measured).p_WT;
}

/// Largest change of a component of the true deflection per sample up to the end of cycle k, in
/// signal periods.
double fastest(const TripLog& log, double period, Tick until) {
  double most = 0;
  Vec3 before = Vec3::Zero();
  for (Tick k = 0; k <= std::min(until, size_of(log) - 1); ++k)
    for (const Vec3& d : at(log, k).deflection) {
      most = std::max(most, (d - before).cwiseAbs().maxCoeff());
      before = d;
    }
  return most / period;
}

}  // namespace

double limit_share(const ProbeParams& p, const Vec3& deflection) {
  const double lateral = std::min(p.overtravel_lateral, p.overtravel_force_lateral / p.spring_rate);
  const double axial = std::min(p.overtravel_axial, p.overtravel_force_axial / p.spring_rate);
  return std::max(deflection.head<2>().norm() / lateral, std::abs(deflection.z()) / axial);
}

std::string beyond_limit(double share) {
  return fmt::format(
      "the deflection reached {:.1f} % of the mechanical limit at a feed the NC unit had allowed",
      100 * share);
}

void TripTap::cycle(Tick, std::span<const Frame> frames) {
  TripCycle cycle;
  if (!log_.empty()) cycle.measured = log_.back().measured;  // of a drive that is not heard
  look_inside(cycle);
  for (const Frame& frame : frames) {
    if (const auto status = decode_drive_status(frame)) {
      if (status->node == kSpindleNode) {
        cycle.spindle_locked = (status->statusword & cia402::kInternalLimit) != 0;
        cycle.spindle_speed = status->second_encoder;
        continue;
      }
      cycle.measured[static_cast<std::size_t>(status->node - 1)] = status->position;
      if (cia402::state_of(status->statusword) == cia402::State::operation_enabled)
        ++cycle.drives_in_operation;
    } else if (const auto module = decode_overtravel_state(frame)) {
      cycle.module = module->state;
      cycle.cause = module->cause;
    } else if (const auto command = decode_group_command(frame)) {
      for (std::size_t i = 0; i < kAxisCount; ++i) cycle.commanded[i] = command->axes[i].position;
      cycle.nc_alarm = (command->flags & kSpindleLock) != 0;
    } else if (const auto emergency = decode_emergency(frame)) {
      cycle.emergency = cycle.emergency || emergency->code == kOvertravelEmergency;
    }
  }
  log_.push_back(cycle);
}

void TripTap::look_inside(TripCycle& cycle) {
  cycle.deflection = modules_.probe().true_deflections();
  cycle.axes = modules_.probe().true_axes();
  int in_operation = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    in_operation += dynamic_cast<const DriveNode&>(modules_.module(drive_node(i))).state() ==
                    cia402::State::operation_enabled;
  most_in_operation_ = std::max(most_in_operation_, in_operation);
  cycle.left_operation = in_operation < most_in_operation_;
  const auto& spindle = dynamic_cast<const SpindleNode&>(modules_.module(kSpindleNode));
  cycle.lock = spindle.cannot_turn();
  cycle.spindle_safe = spindle.cannot_turn() || spindle.at_rest();
  cycle.protection = static_cast<State>(overtravel_.protection().state());
}

TripFigures measure(const TripLog& log, const Machine& machine) {
  const ProbeParams& probe = machine.probe;
  const UsableRange range = usable_range(probe);
  TripFigures f;
  f.threshold = crossing(log, [&](const Vec3& d) { return range.share(d); });
  f.hard_threshold = crossing(log, [&](const Vec3& d) {
    return std::max(range.share(d) / Protection::kRunawayShare, limit_share(probe, d));
  });
  const Tick alarm = first(log, [&](Tick k) { return at(log, k).nc_alarm; });
  Tick quick = left_operation(log);
  const bool operated = first(log, [&](Tick k) { return in_operation(log, k); }) >= 0;
  if (!operated && alarm >= 0) quick = alarm + 1;  // and never will
  f.hard = quick >= 0;
  // A command that asks for the lock is the first that brakes; it acts one cycle later.
  f.soft = alarm >= 0 && !(f.hard && quick <= alarm + kDetectionChain);
  if (f.hard) f.quick_stop = seconds(quick);
  if (alarm >= 0) f.action = seconds(alarm + 1);
  if (f.hard && !(f.action <= f.quick_stop)) f.action = f.quick_stop;
  const Tick locked = first(log, [&](Tick k) { return at(log, k).spindle_locked; });
  if (locked >= 0) f.locked = seconds(locked);
  const Tick module = first(log, [&](Tick k) { return at(log, k).module >= State::soft_stop; });
  if (module >= 0) f.cause = at(log, module).cause;

  Tick still = -1;
  if (f.tripped()) {
    const Tick from = static_cast<Tick>(std::lround(f.action / kCycle));
    still = first(
        log, [&](Tick k) { return standing(log, k); }, from);
    if (still >= 0) f.standstill = seconds(still);
  }
  const Kinematics kinematics(machine.kinematics, machine.tool_length(1),
                              machine.setup.work_offset[0]);
  if (std::isfinite(f.threshold)) {
    const Tick k = static_cast<Tick>(std::floor(f.threshold / kCycle));  // T within cycle k
    if (k >= 1 && k < size_of(log)) {
      const double way = (tip(log, kinematics, k) - tip(log, kinematics, k - 1)).norm();
      f.speed = way / kCycle;
      if (still >= 0) {
        f.stopping_distance = way * (static_cast<double>(k + 1) - f.threshold / kCycle);
        for (Tick c = k + 1; c <= still; ++c)
          f.stopping_distance += (tip(log, kinematics, c) - tip(log, kinematics, c - 1)).norm();
      }
    }
  }
  for (const TripCycle& cycle : log)
    for (const Vec3& d : cycle.deflection) {
      f.deepest = std::max(f.deepest, d.norm());
      f.limit_share = std::max(f.limit_share, limit_share(probe, d));
    }
  f.force = probe.spring_rate * f.deepest;
  const Tick until = f.tripped() ? static_cast<Tick>(std::lround(f.action / kCycle)) : size_of(log);
  f.countable = fastest(log, probe.signal_period, until) < 0.5;
  return f;
}

namespace {

class Judge {
 public:
  Judge(const Scenario& scenario, const TripLog& log, const TripFigures& figures,
        const TripEnd& end, const Machine& machine)
      : s_(scenario),
        log_(log),
        f_(figures),
        end_(end),
        probe_(machine.probe),
        range_(usable_range(machine.probe)) {}

  std::vector<std::string> found(bool within_limit) {
    within_limit_ = within_limit;
    outcome();
    if (end_.refused) return std::move(found_);
    recorded();
    if (!s_.faults.empty()) return std::move(found_);  // see apps/lockout_fault.hpp
    reaction();
    reason();
    if (f_.tripped()) after_trip();
    if (within_limit && f_.limit_share >= 1) say(beyond_limit(f_.limit_share));
    return std::move(found_);
  }

 private:
  void say(std::string sentence) { found_.push_back(std::move(sentence)); }

  void outcome() {
    const char* expected = to_string(s_.expect);
    const auto wrong = [&](const char* is) {
      say(fmt::format("expected {}, but {} ({})", expected, is, end_.reason));
    };
    if (end_.refused) {
      if (s_.expect != Expect::refused && s_.expect != Expect::safe &&
          s_.expect != Expect::fault_safe)
        wrong("the program was refused");
      return;
    }
    switch (s_.expect) {
      case Expect::refused:
        wrong("the program was accepted");
        break;
      case Expect::none:
        if (f_.tripped())
          wrong("the machine stopped");
        else if (!end_.complete || end_.alarmed)
          wrong("the program did not come to its end");
        break;
      case Expect::soft_stop:
        if (!f_.tripped())
          wrong("no trip");
        else if (f_.hard || !end_.soft_alarm)
          wrong("a quick stop");
        break;
      case Expect::hard:
        if (!f_.tripped())
          wrong("no trip");
        else if (!f_.hard || !end_.hard_alarm)
          wrong("no quick stop");
        break;
      case Expect::fault_safe:
        break;
      case Expect::trip:
      case Expect::safe:
        if (!f_.tripped())
          wrong("no trip");
        else if (!end_.alarmed || !(end_.soft_alarm || end_.hard_alarm))
          wrong("no alarm of the overtravel protection");
        break;
    }
  }

  void recorded() {
    const bool dark = end_.reason.find("4003") != std::string::npos;  // a cycle without a row
    if (end_.rows + (dark ? 1 : 0) != log_.size())
      say(fmt::format("{} cycles, but {} rows recorded", log_.size(), end_.rows));
  }

  /// Every sample that must lead to a stop did so in time.
  void reaction() {
    const double margin = s_.reading_error;
    const double smallest = std::min({range_.positive.minCoeff(), range_.negative.minCoeff()});
    const double late = 1 + margin / smallest;
    const bool readable = f_.countable || within_limit_;
    const Tick out =
        readable ? first(log_, [&](Tick k) { return range_.share(sampled(log_, k)) > late; }) : -1;
    const Tick hard = first(log_, [&](Tick k) {
      return limit_share(probe_, sampled(log_, k)) >= 1 + 1e-9 ||
             (readable &&
              range_.share(sampled(log_, k)) > Protection::kRunawayShare + margin / smallest);
    });
    // The last samples of a run may not have had the time.
    const auto due = [&](Tick k) { return k >= 0 && k + kDetectionChain < size_of(log_); };
    if (due(out) && !(f_.action <= seconds(out + kDetectionChain) + 1e-9))
      say(fmt::format("out of range in the sample of cycle {}, but {}", out, acted(f_.action)));
    if (due(hard) && !(f_.quick_stop <= seconds(hard + kDetectionChain) + 1e-9))
      say(fmt::format("beyond the hard threshold in the sample of cycle {}, but {}", hard,
                      acted(f_.quick_stop)));
  }
  static std::string acted(double when) {
    return std::isfinite(when) ? fmt::format("the axes brake from cycle {:.0f} on", when / kCycle)
                               : std::string("the axes do not brake");
  }

  /// No trip without a cause.
  void reason() {
    const Tick module = first(log_, [&](Tick k) { return at(log_, k).module >= State::soft_stop; });
    const Tick alarm = first(log_, [&](Tick k) { return at(log_, k).nc_alarm; });
    // The module judges the sample of the cycle before, the NC unit that of the same cycle.
    Tick sample = -1;
    if (module >= 0) sample = module - 1;
    if (alarm >= 0 && (sample < 0 || alarm < sample)) sample = alarm;
    if (sample < 0 || sample >= size_of(log_)) return;
    if (s_.expect == Expect::none) return;  // said already
    const double smallest = std::min({range_.positive.minCoeff(), range_.negative.minCoeff()});
    const bool out = range_.share(sampled(log_, sample)) > 1 - s_.reading_error / smallest;
    const bool limit = limit_share(probe_, sampled(log_, sample)) >= 1 - 1e-3;
    const bool fast = fastest(log_, probe_.signal_period, sample) > 0.2;
    if (!out && !limit && !(fast && f_.cause == Cause::slip))
      say(fmt::format("stopped on the sample of cycle {} without a reason: {:.1f} % of the range",
                      sample, 100 * range_.share(sampled(log_, sample))));
  }

  void after_trip() {
    if (!std::isfinite(f_.standstill)) say("the axes did not come to rest");
    if (!(f_.locked <= f_.standstill)) say("the spindle was not locked when the axes stood still");
    State highest = State::normal;
    bool emergency = false;
    for (const TripCycle& cycle : log_) {
      emergency = emergency || cycle.emergency;
      if (cycle.module < highest && highest >= State::soft_stop) {
        say("the overtravel module's state was not latched");
        break;
      }
      highest = std::max(highest, cycle.module);
    }
    if (highest < State::soft_stop) say("the overtravel module did not trip");
    if (highest >= State::soft_stop && !emergency) say("the overtravel module sent no EMCY FF10h");
    if (!log_.back().nc_alarm) say("the NC unit let go of its alarm");
    if (!log_.back().spindle_locked) say("the spindle was not locked at the end");
    if (!end_.spindle_stays_locked) say("the spindle could be started after the trip");
    if (!end_.module_stays_latched) say("the overtravel module fell back without a reset");
  }

  const Scenario& s_;
  const TripLog& log_;
  const TripFigures& f_;
  const TripEnd& end_;
  const ProbeParams& probe_;
  const UsableRange range_;
  bool within_limit_ = true;
  std::vector<std::string> found_;
};

}  // namespace

std::vector<std::string> judge(const Scenario& scenario, bool within_limit, const TripLog& log,
                               const TripFigures& figures, const TripEnd& end,
                               const Machine& machine) {
  return Judge(scenario, log, figures, end, machine).found(within_limit);
}

}  // namespace vcnc
