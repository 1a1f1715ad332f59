#include "diagnosis/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <mutex>

#include "diagnosis/commissioning/along_the_way.hpp"
#include "diagnosis/commissioning/best_first.hpp"
#include "diagnosis/commissioning/friction_fit.hpp"
#include "diagnosis/commissioning/machine_in_fit.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/refit.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/healthy/controller_lags.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/replica/model_comparison.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kWellOff = 10;           // times the noise
constexpr double kNearlyFarthest = 0.98;  // of what a number is believed to be off

const std::vector<std::string> kGains{"kv_error",
                                      "velocity_ff_error",
                                      "acceleration_ff_error",
                                      "velocity_gain_error",
                                      "integral_time_error",
                                      "command_delay",
                                      "position_lag_us",
                                      "setpoint_lag_us",
                                      "velocity_lag_us",
                                      "feedforward_lag_us"};

/// What a probe and the geometry of a healthy machine have, too.
const std::vector<std::string> kMeasuring{"surface_friction", "probe_gain",     "cross_talk",
                                          "stylus_bending",   "sample_latency", "squareness",
                                          "a_axis_offset",    "a_axis_tilt",    "c_axis_offset",
                                          "c_axis_tilt",      "deviation"};

class Commissioner {
 public:
  /// `leaves_noise`: a machine whose remainder is the noise, where no laps tell it; null: the
  /// declared one.
  Commissioner(const DiagnosisCase& of, const DiagnosisOptions& options,
               const KeepGoing& keep_going, const Machine* leaves_noise)
      : of_(of), keep_going_(keep_going), machine_(of, options) {
    if (leaves_noise) machine_.evidence.take_noise_from(*leaves_noise);
    if (keep_going_) machine_.evidence.stop_when([this] { return !keep_going_(now_); });
    const Machine begun = with_lags_of(of.record, of.declared);
    tell_lags(begun);
    machine_.now = fit_declared(machine_.evidence, begun, Against::reckoning);
  }

  Commissioning run() {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      if (!moves(of_.record, axis)) {
        tell_standing(axis);
        continue;
      }
      if (!go("friction and gains of " + std::string(kAxisNames[axis]), axis)) break;
      fit_axis(axis);
    }
    machine_.fit_together();
    std::vector<std::size_t> measuring;
    for (const std::string place : {"probe", "geometry", "probe.damping_ratio"})
      for (const std::size_t c : machine_.the(kMeasuring, place)) measuring.push_back(c);
    fit_best_of(machine_, measuring, "probe", nullptr,
                [&] { return go("probe and geometry", kAxisCount); });
    machine_.rest();
    machine_.fit_together();
    tell();
    return std::move(result_);
  }

  /// Whether something else is noise than this took for it.
  bool mistook_noise() const {
    const Evidence& evidence = machine_.evidence;
    return !evidence.noise().from_repetitions &&
           evidence.noise_is_another_with(machine_.now.machine);
  }

 private:
  bool go(const std::string& doing, std::size_t done) {
    now_ = {doing, static_cast<double>(done) / (kAxisCount + 1)};
    return !keep_going_ || keep_going_(now_);
  }

  void fit_axis(std::size_t axis) {
    const std::string place(kAxisNames[axis]);
    // What goes along was linear about the machine before the axis before this one.
    converge_anew(machine_.evidence, machine_.now);
    FrictionFit friction(machine_, place);
    const auto fit_gains = [&] {
      fit_best_of(machine_, machine_.the(kGains, place), place, &friction,
                  [&] { return go("gains of " + place, axis); });
    };
    friction.fit();
    fit_gains();
    machine_.rest();
    const std::vector<std::size_t> found = fit_along_the_way(
        machine_, place, [&] { return go("ripple and waves of " + place, axis); });
    if (!found.empty()) {
      friction.fit_anew(found);
      fit_gains();
    }
    converge_anew(machine_.evidence, machine_.now);
    friction.fit_part_of_motor();
    machine_.rest();
  }

  void tell_standing(std::size_t axis) {
    const std::vector<ComparedChannel>& channels = of_.replica.channels();
    if (std::any_of(channels.begin(), channels.end(), [&](const ComparedChannel& c) {
          return !is_reading(c.kind) && c.axis == axis;
        }))
      machine_.notes.push_back(fmt::format(
          "{}: stands, so its friction, gains and waves stay as declared", kAxisNames[axis]));
  }

  void tell_lags(const Machine& m) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const std::string lags = told_lags(of_.declared, m, axis);
      if (!lags.empty())
        machine_.notes.push_back(
            fmt::format("{}: by its controller's own signals, lag of {}", kAxisNames[axis], lags));
    }
  }

  void tell() {
    const std::map<std::string, Interval> intervals = intervals_of(machine_.evidence, machine_.now);
    std::vector<std::string> at_most;
    for (const FreedNumber& n : machine_.now.nuisances.numbers) {
      const auto i = intervals.find(n.number.key);
      const double half = i == intervals.end() ? 0 : i->second.half_width;
      result_.numbers.push_back({n.number.key, n.value, std::max(n.number.min, n.value - half),
                                 std::min(n.number.max, n.value + half)});
      if (at_its_most(n.number, n.value) || std::abs(n.pull()) > kNearlyFarthest * kFarthestPull)
        at_most.push_back(n.number.key);
    }
    result_.notes = std::move(machine_.notes);
    // What controllers know stays what is declared.
    result_.machine = as_hypothesis(of_.declared, machine_.now.machine);
    // What was fitted is known as well as others of its kind, and no better or worse.
    std::erase_if(result_.machine.uncertainties, [&](const Uncertainty& u) {
      return !u.exact() && has_key(machine_.now.nuisances.numbers, u.key);
    });
    result_.figures =
        figures_of(of_.record, of_.replica, of_.declared, result_.machine, "all laps");
    tell_form();
    result_.warnings = machine_.evidence.noise().warnings;
    for (const std::string& key : at_most)
      result_.warnings.push_back(key +
                                 " went to the end of what is allowed: it stands for "
                                 "something else, which the model lacks; with this run as "
                                 "--reference a diagnosis does not hang on it");
    for (const SignalFigure& f : result_.figures)
      if (f.after > kWellOff * f.floor) tell_what_stays_off(f);
  }

  void tell_what_stays_off(const SignalFigure& f) {
    const ShownUnit unit = shown_unit(f.channel);
    result_.warnings.push_back(fmt::format(
        "{} stays {:.3g} {} rms off, {:.0f} times its noise: the model lacks something, or the "
        "column is another signal or late; a diagnosis against this model tells of no change of "
        "it that is smaller",
        channel_name(f.channel), f.after * unit.factor, unit.name, f.after / f.floor));
  }

  /// What is left besides noise goes into the model: of readings, and of axes that moved, so that
  /// what is not there is known to be unknown.
  void tell_form() {
    Machine& m = result_.machine;
    m.commissioned.clear();
    for (const SignalFigure& f : figures_of(of_.record, of_.replica, m, m, ""))
      if (is_reading(f.channel.kind) || moves(of_.record, f.channel.axis))
        m.commissioned.push_back({channel_name(f.channel),
                                  std::sqrt(std::max(0.0, f.after * f.after - f.floor * f.floor))});
  }

  const DiagnosisCase& of_;
  const KeepGoing& keep_going_;
  DiagnosisProgress now_{"fitting the declared machine", 0};
  MachineInFit machine_;
  Commissioning result_;
};

/// Anew with other noise where it took something else for it.
Commissioning commissioned(const DiagnosisCase& of, const DiagnosisOptions& options,
                           const KeepGoing& keep_going) {
  Commissioner first(of, options, keep_going, nullptr);
  Commissioning result = first.run();
  bool again = first.mistook_noise();
  for (int round = 0; again && round < kNoiseRounds; ++round) {
    of.replica.anchor(of.declared);
    Commissioner next(of, options, keep_going, &result.machine);
    Commissioning better = next.run();
    again = next.mistook_noise();
    result = std::move(better);
  }
  return result;
}

}  // namespace

Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options,
                         const KeepGoing& keep_going) {
  bool any_moves = false;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) any_moves |= moves(of.record, axis);
  if (!any_moves)
    throw MeasurementError(of.record.source +
                           ": no axis moves; a model can only be fitted to "
                           "motion");
  std::mutex guard;
  bool stopped = false;
  const KeepGoing watched = [&](const DiagnosisProgress& progress) {
    const std::lock_guard lock(guard);
    stopped = stopped || (keep_going && !keep_going(progress));
    return !stopped;
  };
  try {
    return commissioned(of, options, watched);
  } catch (const Stopped&) {
    return {};
  }
}

}  // namespace vcnc
