#include "apps/compensation_for.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bus/tick.hpp"
#include "model/effects/chain.hpp"
#include "model/parameters.hpp"

namespace vcnc {
namespace {

constexpr double kShortestPeriod = 0.5e-3;  ///< [m] of a table, some cycles of a usual feed
constexpr double kShortestAngle = 0.5 * kDegree;
constexpr int kPointsPerPeriod = 64;
constexpr double kTableStep = 2e-3, kTableAngle = 2 * kDegree;  ///< between points of a table
constexpr int kMostPoints = 10'000;
constexpr double kTooLittle = 0.1e-6;  ///< [m or rad] at the end of the travel
constexpr double kAsDeclared = 1e-3;

struct Verdict {
  bool compensated = false;
  std::string text;
};
Verdict by(std::string text) { return {true, std::move(text)}; }
Verdict no(std::string text) { return {false, std::move(text)}; }

/// What is worked on.
struct Work {
  const Machine& machine;
  const Machine actual;  ///< with its deviations
  CompensationParams settings;

  const AxisEffects& effects(std::size_t axis) const { return machine.effects.axis[axis]; }
  bool motor_encoder(std::size_t axis) const {
    return actual.axes[axis].servo.feedback == ServoParams::Feedback::motor;
  }
};

std::string length(double value, bool rotary) {
  return rotary ? fmt::format("{:.4g} arcsec", value / unit::arcsec.to_si)
                : fmt::format("{:.4g} um", value / unit::um.to_si);
}

CompensationTable::OfAxis name_of(std::size_t axis) {
  return static_cast<CompensationTable::OfAxis>(axis);
}

/// Friction terms of an axis at a velocity.
FrictionPort::Signal<double> friction_of(const Work& w, std::size_t axis, double velocity) {
  FrictionPort::Signal<double> terms;
  axis_chain<FrictionPort>(w.machine.effects, axis, 0).step(terms, {{}, 0, velocity, velocity});
  return terms;
}

/// Sliding dry friction, the mean of both directions [N or N m].
double dry_friction(const Work& w, std::size_t axis) {
  constexpr double kSliding = 0.05;  ///< [m/s or rad/s], beyond the Stribeck range
  return 0.5 * (friction_of(w, axis, kSliding).dry + friction_of(w, axis, -kSliding).dry);
}

Verdict add_backlash(Work& w, std::size_t axis, double gap) {
  w.settings.axes[axis].backlash += gap;
  return by(fmt::format("backlash {}", length(gap, is_rotary(axis))));
}

// ------------------------------------------------------------------------------------- tables

/// `error` over the whole travel of `over`.
CompensationTable table_over_travel(const Work& w, std::size_t axis, std::size_t over, double step,
                                    const std::function<double(double)>& error) {
  const AxisLimits& l = w.machine.axes[over].limits;
  const int parts =
      std::clamp(static_cast<int>(std::ceil((l.max - l.min) / step)), 1, kMostPoints - 1);
  CompensationTable table;
  table.axis = name_of(axis);
  table.over = name_of(over);
  for (int i = 0; i <= parts; ++i) {
    table.at.push_back(i == parts ? l.max : l.min + (l.max - l.min) * i / parts);
    table.error.push_back(error(table.at.back()));
  }
  return table;
}

/// `error` over one period from 0 on.
CompensationTable table_over_period(std::size_t axis, double period,
                                    const std::function<double(double)>& error) {
  CompensationTable table;
  table.axis = table.over = name_of(axis);
  table.modulo = true;
  for (int i = 0; i < kPointsPerPeriod; ++i) {
    table.at.push_back(period * i / kPointsPerPeriod);
    table.error.push_back(error(table.at.back()));
  }
  table.at.push_back(period);
  table.error.push_back(table.error.front());
  return table;
}

Verdict add(Work& w, CompensationTable table) {
  const std::size_t axis = table.axis_index(), over = table.over_index();
  std::string text =
      fmt::format("table of {} over {}, {} points, up to {}", kAxisNames[axis], kAxisNames[over],
                  table.at.size(), length(table.largest(), is_rotary(axis)));
  w.settings.tables.push_back(std::move(table));
  return by(std::move(text));
}

Verdict add_wave(Work& w, std::size_t axis, double amplitude, double period, double phase) {
  if (period < (is_rotary(axis) ? kShortestAngle : kShortestPeriod))
    return no("its period is too short for set-points of 1 ms");
  return add(w, table_over_period(axis, period, [&](double q) {
               return amplitude * std::sin(2 * kPi / period * q + phase);
             }));
}

Verdict both(const Verdict& a, const Verdict& b) {
  return {a.compensated || b.compensated,
          a.text + (a.text.empty() || b.text.empty() ? "" : "; ") + b.text};
}

// --------------------------------------------------------------------------------- one by one

Verdict backlash(Work& w, std::size_t axis) {
  if (!w.motor_encoder(axis))
    return no(
        "the measuring system on the load sees the gap and the loop closes it; what is left "
        "is a short spike");
  return add_backlash(w, axis, w.effects(axis).get<Backlash>().gap);
}

Verdict load_play(Work& w, std::size_t axis) {
  return add_backlash(w, axis, w.effects(axis).get<LoadPlay>().width);
}

Verdict spring(Work& w, std::size_t axis, double compliance) {
  const double dry = dry_friction(w, axis);
  if (dry == 0)
    return no("without dry friction it gives way to acceleration alone, which has no setting");
  return both(add_backlash(w, axis, 2 * compliance * dry),
              by("of what the friction makes; what the acceleration makes stays"));
}

Verdict lost_motion(Work& w, std::size_t axis) {
  return spring(w, axis, w.effects(axis).get<LostMotion>().compliance);
}

Verdict windup(Work& w, std::size_t axis) {
  if (!w.motor_encoder(axis))
    return no("the measuring system on the load sees it and the loop closes it");
  return spring(w, axis, w.effects(axis).get<Windup>().compliance);
}

/// Errors in proportion to the travel, each from a position of its own, add up to one.
Verdict add_scale(Work& w, std::size_t axis, double error, double reference) {
  const AxisLimits& l = w.machine.axes[axis].limits;
  const double largest =
      std::abs(error) * std::max(std::abs(l.max - reference), std::abs(l.min - reference));
  if (largest < kTooLittle)
    return no(fmt::format("makes {} at the end of the travel, too little to count",
                          length(largest, is_rotary(axis))));
  AxisCompensation& a = w.settings.axes[axis];
  const double scale = a.scale + error;
  if (scale != 0) a.scale_reference = (a.scale * a.scale_reference + error * reference) / scale;
  a.scale = scale;
  return by(fmt::format("scale {:.4g} um/m", error * 1e6));
}

Verdict scale(Work& w, std::size_t axis) {
  const ScaleError& e = w.effects(axis).get<ScaleError>();
  return add_scale(w, axis, e.error, e.reference);
}

Verdict lead_error(Work& w, std::size_t axis) {
  if (!w.motor_encoder(axis))
    return no("the measuring system on the load sees it and the loop closes it");
  return add_scale(w, axis, w.effects(axis).get<LeadError>().error,
                   w.machine.axes[axis].limits.start);
}

Verdict pitch_progressive(Work& w, std::size_t axis) {
  const PitchProgressive& e = w.effects(axis).get<PitchProgressive>();
  return add(w, table_over_travel(w, axis, axis, is_rotary(axis) ? kTableAngle : kTableStep,
                                  [&](double q) {
                                    const double x = q - e.reference;
                                    return x * x * (e.quadratic + e.cubic * x);
                                  }));
}

Verdict pitch_periodic(Work& w, std::size_t axis) {
  const PitchPeriodic& e = w.effects(axis).get<PitchPeriodic>();
  return add_wave(w, axis, e.amplitude, e.period, e.phase);
}

/// The encoder counts A sin too much, so the axis stands so much short of what it counts.
Verdict encoder_eccentricity(Work& w, std::size_t axis) {
  const EncoderEccentricity& e = w.effects(axis).get<EncoderEccentricity>();
  return add_wave(w, axis, -e.amplitude, 2 * kPi, e.phase);
}

/// The load stands so much further than the motor tells.
Verdict transmission_error(Work& w, std::size_t axis) {
  if (!w.motor_encoder(axis))
    return no("the measuring system on the load sees it and the loop closes it");
  const TransmissionError& e = w.effects(axis).get<TransmissionError>();
  return add_wave(w, axis, e.amplitude, e.period, e.phase);
}

/// What the load's encoder counts too much the axis stands short of.
Verdict load_encoder_error(Work& w, std::size_t axis) {
  if (w.motor_encoder(axis)) return no("the loop does not use that measuring system");
  const LoadEncoderError& e = w.effects(axis).get<LoadEncoderError>();
  return add_wave(w, axis, -e.amplitude, e.period, e.phase);
}

Verdict straightness(Work& w, std::size_t axis) {
  const Straightness& e = w.effects(axis).get<Straightness>();
  constexpr double kReach = 0.1;
  const auto across = [&](int direction, double bow, double wave) {
    if (bow == 0 && wave == 0) return Verdict{};
    const double step =
        wave == 0 ? kTableStep : std::min(kTableStep, e.wavelength / kPointsPerPeriod);
    return add(w,
               table_over_travel(w, static_cast<std::size_t>(direction), axis, step, [&](double q) {
                 return bow * q * q / (kReach * kReach) +
                        wave * std::sin(2 * kPi / e.wavelength * q + e.phase);
               }));
  };
  const Sideways sides = sideways(axis);
  return both(across(sides.first, e.first_bow, e.first_wave),
              across(sides.second, e.second_bow, e.second_wave));
}

Verdict lateral_play(Work& w, std::size_t axis) {
  const LateralPlay& e = w.effects(axis).get<LateralPlay>();
  const auto across = [&](int direction, double play) {
    if (play == 0) return Verdict{};
    const AxisLimits& l = w.machine.axes[axis].limits;
    CompensationTable table;
    table.axis = name_of(static_cast<std::size_t>(direction));
    table.over = name_of(axis);
    table.at = {l.min, l.max};
    table.error = {0.5 * play, 0.5 * play};
    table.error_reverse = {-0.5 * play, -0.5 * play};
    return add(w, std::move(table));
  };
  const Sideways sides = sideways(axis);
  return both(across(sides.first, e.first), across(sides.second, e.second));
}

Verdict squareness(Work& w, std::size_t) {
  const Squareness& e = w.machine.effects.get<Squareness>();
  w.settings.squareness = {e.xy, e.xz, e.yz};
  return by("squareness");
}

/// What the axis lags at any constant velocity [s].
double lag(const Work& w, std::size_t axis) {
  const ServoParams& is = w.actual.axes[axis].servo;
  ServoPort::Signal<double> servo{.kv = is.kv_per_s,
                                  .velocity_gain = 1,
                                  .integral_time = is.integral_time,
                                  .velocity_ff = is.velocity_ff,
                                  .acceleration_ff = is.acceleration_ff,
                                  .current_lag = is.current_lag,
                                  .force_limit = 0};
  axis_chain<ServoPort>(w.machine.effects, axis, 0).step(servo, {});
  const AxisEffects& e = w.effects(axis);
  const double seen_late = w.motor_encoder(axis) ? 0 : e.get<LoadEncoderLatency>().latency;
  return -seen_late + e.get<CommandDelay>().delay + e.get<BusLatency>().cycles * kCycle +
         (1 - servo.velocity_ff) / servo.kv;
}

/// Brings all axes to one lag: to none, or to what the longest lead leaves of the longest lag.
void set_leads(Work& w) {
  constexpr double kLongest = 5e-3;
  AxisVector lags;
  for (std::size_t i = 0; i < kAxisCount; ++i) lags[i] = lag(w, i);
  const double left = std::max(0.0, *std::max_element(lags.begin(), lags.end()) - kLongest);
  for (std::size_t i = 0; i < kAxisCount; ++i)
    w.settings.axes[i].lead = std::clamp(lags[i] - left, -kLongest, kLongest);
}

Verdict lead(Work& w, std::size_t axis) {
  constexpr double kNothing = 1e-9;
  const double given = w.settings.axes[axis].lead;
  if (std::abs(given) < kNothing)
    return no("makes no lag at these gains; the drive has to be set right");
  return by(fmt::format("lead {:.4g} us", given * 1e6));
}

/// The loop lets the axis run ahead until what it sees is where it should be.
Verdict load_encoder_latency(Work& w, std::size_t axis) {
  if (w.motor_encoder(axis)) return no("the loop does not use that measuring system");
  return lead(w, axis);
}

Verdict friction(Work& w, std::size_t axis) {
  const AxisParams &is = w.actual.axes[axis], &declared = w.machine.axes[axis];
  constexpr double kLeastFeedForward = 0.5;
  if (declared.servo.velocity_ff < kLeastFeedForward)
    return no("the pulse goes through the velocity feed-forward, which the drive does not use");
  const double dry = dry_friction(w, axis) + w.effects(axis).get<MotorFriction>().level,
               inertia = declared.mechanics.total_inertia();
  if (dry == 0) return no("makes no dry friction at a usual speed");
  if (const double stiffness = w.effects(axis).get<Presliding>().stiffness; stiffness > 0)
    return no(fmt::format("it turns over a way of {}; a pulse at the reversal would come too early",
                          length(2 * dry / stiffness, is_rotary(axis))));
  if (declared.servo.controller != ServoParams::Controller::cascade)
    return no("the pulse is for a drive whose velocity loop integrates");
  const double crossover = is.servo.velocity_gain > 0 ? is.servo.velocity_gain / inertia
                                                      : 2 * kPi * is.servo.velocity_bandwidth;
  ReversalPulse& pulse = w.settings.axes[axis].friction;
  pulse = pulse_against(2 * dry, inertia, crossover, is.servo.integral_time, is.servo.kv_per_s);
  constexpr double kRounding = 1e-9;
  const double bearable =
      (1 - kRounding) * declared.limits.acceleration * std::max(pulse.rise, kCycle);
  const bool limited = pulse.amplitude > bearable;
  pulse.amplitude = std::min(pulse.amplitude, bearable);
  std::string text =
      fmt::format("pulse at reversals, {:.3g} {}, {:.3g} ms, {:.3g} ms",
                  pulse.amplitude / (is_rotary(axis) ? kDegree : 1e-3),
                  is_rotary(axis) ? "deg/s" : "mm/s", pulse.decay * 1e3, pulse.rise * 1e3);
  if (limited) text += ", as much as the acceleration limit allows";
  return by(std::move(text));
}

// ---------------------------------------------------------------------------------- the table

struct Answer {
  std::string_view effect;
  Verdict (*compensate)(Work&, std::size_t axis);
};

constexpr Answer kAnswers[]{
    {"backlash", backlash},
    {"load_play", load_play},
    {"lost_motion", lost_motion},
    {"windup", windup},
    {"scale_error", scale},
    {"lead_error", lead_error},
    {"pitch_progressive", pitch_progressive},
    {"pitch_periodic", pitch_periodic},
    {"encoder_eccentricity", encoder_eccentricity},
    {"transmission_error", transmission_error},
    {"load_encoder_error", load_encoder_error},
    {"straightness", straightness},
    {"lateral_play", lateral_play},
    {"squareness", squareness},
    {"command_delay", lead},
    {"bus_latency", lead},
    {"velocity_ff_error", lead},
    {"kv_error", lead},
    {"load_encoder_latency", load_encoder_latency},
    {"coulomb", friction},
    {"stribeck", friction},
    {"motor_friction", friction},
};

/// Why an effect without an answer has none.
const char* reason(Family family) {
  switch (family) {
    case Family::servo:
      return "belongs to the drive: set it right there";
    case Family::friction:
      return "has no setting of its own; the pulse at reversals answers dry friction only";
    case Family::mechanics:
      return "is a force or a vibration that a set-point does not take back";
    case Family::geometry:
      return "needs the kinematics of the machine (axes of rotation, tilts, arms) corrected; "
             "measure it and enter it there";
    case Family::thermal:
      return "changes with time, and there is no thermometer: measure its state and set scale";
    case Family::probe:
    case Family::acquisition:
      return "is an error of the measurement, the axes are right: calibrate the probe";
    case Family::setup:
      return "is how the piece is set up: measure the work offset";
    case Family::bus:
      return "is of the bus: irregular, so it cannot be told beforehand";
    case Family::nc:
      return "is the NC unit's own: change its tolerance or filter";
  }
  return "";
}

Verdict judge(Work& w, const EffectText& text, std::size_t axis) {
  for (const Answer& answer : kAnswers)
    if (answer.effect == text.name) return answer.compensate(w, axis);
  return no(reason(text.family));
}

Verdict judge(Work& w, const Law& law) {
  const bool position = law.point == Law::Point::displacement || law.point == Law::Point::command;
  const bool by_direction =
      !law.grows() && law.times != Covariate::time && law.times_axis == law.over_axis;
  if (!position || law.over != Covariate::position || law.at.empty() ||
      !(by_direction || law.times == Covariate::time))
    return no(
        "only a displacement or a command over a position, as it is, one way only or with the "
        "sign of that axis' motion, is a table");
  CompensationTable table;
  table.axis = name_of(law.axis_index());
  table.over = static_cast<CompensationTable::OfAxis>(law.over_axis);
  table.at = law.at;
  table.error = law.value;
  if (table.at.size() == 1) {
    constexpr double kApart = 1;
    table.at.push_back(table.at.front() + kApart);
    table.error.push_back(table.error.front());
  }
  if (by_direction) {
    const double forwards = law.times == Covariate::backwards ? 0 : 1,
                 backwards = law.times == Covariate::forwards ? 0
                             : law.times == Covariate::sign   ? -1
                                                              : 1;
    for (double& v : table.error) {
      table.error_reverse.push_back(backwards * v);
      v *= forwards;
    }
  }
  return add(w, std::move(table));
}

/// A number that was fitted and came out as it was: nothing to be told.
bool is_as_declared(const Machine& machine, const Deviation& deviation) {
  Machine declared = machine;
  for (const Parameter& p : parameters(declared))
    if (p.key == deviation.key)
      return std::abs(deviation.value - p.in_unit()) < kAsDeclared * std::abs(p.in_unit());
  return false;
}

Verdict judge(Work& w, const Deviation& deviation) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    for (const char* key : {"kv_per_s", "velocity_ff"})
      if (deviation.key == fmt::format("axes.{}.{}", kAxisNames[i], key)) return lead(w, i);
  return no("is a declared number: enter its true value in the machine file");
}

}  // namespace

ReversalPulse pulse_against(double step, double inertia, double crossover, double integral_time,
                            double kv) {
  // The pole near -Kv by Newton's rule.
  const double w = crossover, c1 = w * (kv + 1 / integral_time), c0 = w * kv / integral_time;
  double s = -kv;
  for (int i = 0; i < 20; ++i) s -= (((s + w) * s + c1) * s + c0) / ((3 * s + 2 * w) * s + c1);
  const double sum = w + s, product = -c0 / s;
  // Two poles that are (nearly) the same or a pair: apart by a little, to the same product.
  constexpr double kLeastRatio = 1.2;
  const double root = std::sqrt(std::max(0.25 * sum * sum - product, 0.0));
  double slow = 0.5 * sum - root, fast = 0.5 * sum + root;
  if (!(fast > kLeastRatio * slow)) {
    slow = std::sqrt(product / kLeastRatio);
    fast = kLeastRatio * slow;
  }
  return {.amplitude = step / (inertia * (fast - slow)), .decay = 1 / slow, .rise = 1 / fast};
}

CompensationProposal compensation_for(const Machine& machine) {
  Work w{machine, actual(machine), {}};
  set_leads(w);
  CompensationProposal proposal;
  const auto note = [&](std::string key, Verdict verdict) {
    proposal.remarks.push_back({std::move(key), verdict.compensated, std::move(verdict.text)});
  };
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (of_axis(Effect::place)) {
      for (std::size_t i = 0; i < kAxisCount; ++i)
        if (fits(Effect::place, is_rotary(i)) && !w.effects(i).get<Effect>().null())
          note(fmt::format("{}.{}", kAxisNames[i], Effect::text.name), judge(w, Effect::text, i));
    } else if (!machine.effects.get<Effect>().null()) {
      note(fmt::format("{}.{}", key_of(Effect::place), Effect::text.name),
           judge(w, Effect::text, kX));
    }
  });
  for (std::size_t i = 0; i < machine.effects.laws.size(); ++i) {
    const Law& law = machine.effects.laws[i];
    note(law.label.empty() ? fmt::format("law {}", i + 1) : fmt::format("law \"{}\"", law.label),
         judge(w, law));
  }
  for (const Deviation& deviation : machine.effects.deviations)
    if (!is_as_declared(machine, deviation)) note(deviation.key, judge(w, deviation));
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (const Verdict declared = lead(w, i);
        declared.compensated && machine.axes[i].servo.velocity_ff != 1)
      note(fmt::format("axes.{}.velocity_ff", kAxisNames[i]),
           by(declared.text + ": what the declared gains let the axis lag is in it"));
  proposal.settings = std::move(w.settings);
  return proposal;
}

}  // namespace vcnc
