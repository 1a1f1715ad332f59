#include "apps/lockout_fault.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "controller/alarms.hpp"
#include "model/probe/contact.hpp"

namespace vcnc {

namespace {

using Kind = BusFault::Kind;
using State = OvertravelState::State;

/// The run ends when the measured axes are slower than 1 um per cycle; the true ones are near.
constexpr double kRest = 2e-6, kRestRotary = 2e-5;
constexpr Tick kRunDown = 10;  ///< cycles after the end: silence found out, and a standing brake
/// A reading that jumps further than this in a cycle is found out (model/safety/protection.hpp).
constexpr double kCountable = 5;

const std::vector<FaultTolerance>& tolerances() {
  static const std::vector<FaultTolerance> table{
      {Kind::mute, 0, false, {3201, 3202, 2103, 2104, 3101}},
      {Kind::silent, 0, false, {3202, 2103, 2104, 3101}},
      {Kind::deaf, 0, false, {2002, 3202, 2103, 2104}},
      {Kind::drop, 0, false, {2002, 3202, 2103, 2104}},
      // A bit changes the reading by its weight when it comes and by twice that at a carry.
      {Kind::corrupt, 2 * kCountable, false, {2001, 2002, 2101, 2103, 2104, 3001, 3101, 3202}},
      {Kind::delay, 0, false, {2103, 2104, 3101, 3202}},
      {Kind::duplicate, 0, false, {3101}},
      {Kind::lose_sync, 0, false, {2103, 2104, 3101, 3202}},
      {Kind::babble, 0, false, {3101, 3103}},
      {Kind::stuck, 0, false, {3202}},
      {Kind::power_loss, 0, false, {4001, 4003}},
      {Kind::bus_off, 0, false, {3201, 3202, 2103, 2104, 3101}},
      {Kind::encoder_jump, 0, true, {2101, 2102}},
      {Kind::fault, 0, false, {2105, 2001}},
      {Kind::wire_break, 0, false, {}},
      {Kind::stuck_adc, 0, false, {}},
      {Kind::saturated, 0, false, {}},
      {Kind::slip, kCountable, false, {}},
  };
  return table;
}

class FaultJudge {
 public:
  FaultJudge(const Scenario& scenario, const LockoutCase& the_case, const BusFaults& faults,
             const TripLog& log, const TripFigures& figures, const TripEnd& end)
      : s_(scenario),
        case_(the_case),
        faults_(faults),
        log_(log),
        f_(figures),
        end_(end),
        range_(usable_range(the_case.machine.probe)) {}

  std::vector<std::string> found() {
    if (end_.refused || log_.empty()) return {};
    for (const BusFault& fault : faults_) {
      const FaultTolerance& t = tolerance_of(fault.kind);
      misread_ += t.periods * case_.machine.probe.signal_period;
      moves_axes_ = moves_axes_ || t.moves_axes;
    }
    reaction();
    if (end_.alarmed) stopped();
    if (!end_.alarmed && !end_.complete)
      say("no alarm, but the program did not end: " + end_.reason);
    if (case_.within_limit && !moves_axes_ && f_.limit_share >= 1)
      say(beyond_limit(f_.limit_share));
    return std::move(found_);
  }

 private:
  void say(std::string sentence) { found_.push_back(std::move(sentence)); }
  Tick size() const { return static_cast<Tick>(log_.size()); }
  const TripCycle& at(Tick k) const { return log_[static_cast<std::size_t>(k)]; }
  template <class F>
  Tick first(F&& f, Tick from = 0) const {
    for (Tick k = from; k < size(); ++k)
      if (f(at(k))) return k;
    return -1;
  }
  /// From this cycle on the axes are braked: a command that asks for the lock acts in the next.
  Tick braking() const {
    const Tick alarm = first([](const TripCycle& c) { return c.nc_alarm; });
    const Tick left = first([](const TripCycle& c) { return c.left_operation; });
    if (alarm < 0) return left;
    return left < 0 ? alarm + 1 : std::min(left, alarm + 1);
  }

  void reaction() {
    const double smallest = std::min({range_.positive.minCoeff(), range_.negative.minCoeff()});
    const double margin = 1 + (s_.reading_error + misread_) / smallest;
    if (!f_.countable && !case_.within_limit) return;  // the sensor cannot know
    const Tick out =
        first([&](const TripCycle& c) { return range_.share(c.deflection.back()) > margin; });
    const Tick due = out + kDetectionChain + kFaultDelay;
    const Tick action = braking();
    if (out < 0 || due >= size() || (action >= 0 && action <= due)) return;
    say(fmt::format("out of range in the sample of cycle {}, but {}", out,
                    action < 0 ? std::string("the axes do not brake")
                               : fmt::format("the axes brake from cycle {} on", action)));
  }

  void stopped() {
    const Tick last = size() - 1;
    const Tick action = braking();
    for (std::size_t i = 0; i < kAxisCount && last > 0; ++i)
      if (std::abs(at(last).axes[i] - at(last - 1).axes[i]) > (is_rotary(i) ? kRestRotary : kRest))
        say(fmt::format("axis {} still moves at the end", kAxisNames[i]));
    if (end_.run_down < 0 || end_.run_down > kRunDown) say("a drive does not come to rest");
    Tick still = -1;
    for (Tick k = std::max<Tick>(action, 1); k < size() && still < 0; ++k)
      if (truly_standing(log_, k)) still = k;
    if (still >= 0 && !at(still).spindle_safe)
      say("the spindle was neither locked nor at rest when the axes stood still");
    if (for_want_of_mains()) return;
    if (!at(last).lock) say("at the end the spindle was neither locked nor out of operation");
    if (!end_.spindle_stays_locked) say("the spindle could be started after the stop");
    State highest = State::normal;
    for (const TripCycle& c : log_) {
      if (c.protection < highest && highest >= State::soft_stop) {
        say("the overtravel module's state was not latched");
        break;
      }
      highest = std::max(highest, c.protection);
    }
    if (!end_.module_stays_latched) say("the overtravel module fell back without a reset");
    if (std::none_of(end_.alarms.begin(), end_.alarms.end(),
                     [&](const Alarm& a) { return names(a); }))
      say("no alarm names the fault or the protection that acted: " + end_.reason);
  }

  /// Held and retracted because the mains are away: nothing is wrong, so nothing is locked.
  bool for_want_of_mains() const {
    return std::any_of(faults_.begin(), faults_.end(),
                       [](const BusFault& f) { return f.of_supply(); }) &&
           std::all_of(end_.alarms.begin(), end_.alarms.end(), [](const Alarm& a) {
             return a.code >= static_cast<int>(AlarmCode::mains_lost);
           });
  }

  bool names(const Alarm& alarm) const {
    if (alarm.code >= 1000 && alarm.code < 2000) return true;
    return std::any_of(faults_.begin(), faults_.end(), [&](const BusFault& f) {
      const std::vector<int>& codes = tolerance_of(f.kind).alarms;
      return alarm.source == f.node || alarm.text.find(f.node) != std::string::npos ||
             std::find(codes.begin(), codes.end(), alarm.code) != codes.end();
    });
  }

  const Scenario& s_;
  const LockoutCase& case_;
  const BusFaults& faults_;
  const TripLog& log_;
  const TripFigures& f_;
  const TripEnd& end_;
  const UsableRange range_;
  double misread_ = 0;  ///< [m]
  bool moves_axes_ = false;
  std::vector<std::string> found_;
};

}  // namespace

const FaultTolerance& tolerance_of(BusFault::Kind kind) {
  static const FaultTolerance strict{kind, 0, false, {}};
  const auto found = std::find_if(tolerances().begin(), tolerances().end(),
                                  [&](const FaultTolerance& t) { return t.kind == kind; });
  return found == tolerances().end() ? strict : *found;
}

std::vector<std::string> judge_faulted(const Scenario& scenario, const LockoutCase& the_case,
                                       const BusFaults& faults, const TripLog& log,
                                       const TripFigures& figures, const TripEnd& end) {
  return FaultJudge(scenario, the_case, faults, log, figures, end).found();
}

std::string fault_tolerances_markdown() {
  std::string text =
      "| kind | reading may be wrong by | moves an axis itself | alarms that name it |\n"
      "|---|---|---|---|\n";
  for (const FaultTolerance& t : tolerances()) {
    const auto kind = std::find_if(fault_kinds().begin(), fault_kinds().end(),
                                   [&](const FaultKind& k) { return k.kind == t.kind; });
    text += fmt::format("| `{}` | {} | {} | {} |\n", kind->name,
                        t.periods > 0 ? fmt::format("{:g} periods", t.periods) : "",
                        t.moves_axes ? "yes" : "", fmt::join(t.alarms, ", "));
  }
  return text;
}

}  // namespace vcnc
