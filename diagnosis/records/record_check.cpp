#include "diagnosis/records/record_check.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/frozen_check.hpp"
#include "diagnosis/records/late_velocity.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/position_jumps.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/records/signal_name.hpp"

namespace vcnc {

namespace {

/// A ramp has a step from sample to sample, too, and begins anywhere.
bool are_multiples(const std::vector<double>& value, double step) {
  constexpr double kOff = 0.05;
  return std::all_of(value.begin(), value.end(), [&](double v) {
    return !std::isfinite(v) || std::abs(v / step - std::round(v / step)) < kOff;
  });
}

using Series = std::vector<double>;

constexpr double kSmoothing = 10e-3;        ///< [s] of all derivatives here
constexpr double kBelongs = 0.7;            ///< correlation of what belongs together
constexpr double kFits = 0.95;              ///< ... of what certainly does
constexpr double kSlope = 0.1;              ///< how far a slope may be off 1
constexpr double kLead = 2e-3;              ///< [s] that no feed-forward makes by itself
constexpr double kLate = 0.2e-3;            ///< [s] that no viscous drag twists a transmission by
constexpr double kLateVelocity = 0.5e-3;    ///< [s] that a filter makes
constexpr double kViscous = 0.1;            ///< share of a sine that nothing but the velocity makes
constexpr std::size_t kEnoughToTell = 200;  // values, whether one of them stands alone
constexpr std::size_t kOneIn = 1000;        // such bends are usual
constexpr double kLone = 10;                // times what is usual
constexpr double kMoves = 1e-4;             ///< [m or rad] of a command that every position shows
constexpr std::size_t kFewestSteps = 500;
constexpr double kCarries = 0.5;        ///< share of a twist that comes from what the load needs
constexpr double kCarriesPart = 0.005;  ///< ... from its inertia, and from its friction
constexpr double kImpossible = 1e4;     ///< times a declared inertia, which no machine is off by
constexpr double kSameCopy = 1e-9;      ///< share of a span, by which two copies may differ
constexpr double kMostForceLag = 0.2;   ///< [s] either way
constexpr double kForceLag = 6e-3;      ///< [s] that lags of a current loop and filters make
constexpr double kLateLeaves = 4;       // times less, at another time
constexpr long kSamplesOfForce = 20'000;
constexpr long kFinerLag = 30;  // steps of time in one of 3 ms
constexpr double kFarAway = 3;  // times all that lies together

struct Spread {
  double low = HUGE_VAL, high = -HUGE_VAL;
  std::size_t count = 0;
  double span() const { return count > 0 ? high - low : 0; }
};

Spread spread_of(const Series& value) {
  Spread s;
  for (const double v : value)
    if (std::isfinite(v)) s.low = std::min(s.low, v), s.high = std::max(s.high, v), ++s.count;
  return s;
}

bool constant(const Series& value) { return !(spread_of(value).span() > 0); }

/// Mean over 2 half + 1 samples; NaN where one of them is missing.
Series smoothed(const Series& value, std::size_t half) {
  const std::size_t n = value.size();
  Series result(n, kMissing);
  double sum = 0;
  std::size_t there = 0;
  const std::size_t width = 2 * half + 1;
  for (std::size_t k = 0; k < n; ++k) {
    if (std::isfinite(value[k])) sum += value[k], ++there;
    if (k >= width && std::isfinite(value[k - width])) sum -= value[k - width], --there;
    if (k + 1 >= width && there == width) result[k - half] = sum / static_cast<double>(width);
  }
  return result;
}

/// Slope and correlation of y over x, both about their means.
struct Relation {
  double slope = 0, correlation = 0;
  bool known = false;
};

Relation relate(const Series& x, const Series& y) {
  double mx = 0, my = 0, n = 0;
  for (std::size_t k = 0; k < x.size(); ++k)
    if (std::isfinite(x[k]) && std::isfinite(y[k])) mx += x[k], my += y[k], ++n;
  if (n < 10) return {};
  mx /= n, my /= n;
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) continue;
    xx += (x[k] - mx) * (x[k] - mx);
    yy += (y[k] - my) * (y[k] - my);
    xy += (x[k] - mx) * (y[k] - my);
  }
  if (!(xx > 0 && yy > 0)) return {};
  return {xy / xx, xy / std::sqrt(xx * yy), true};
}

bool fits(const Relation& r) {
  return r.known && r.correlation > kFits && std::abs(r.slope - 1) <= kSlope;
}

class Checker {
 public:
  Checker(Record& record, const Machine* declared)
      : record_(record), declared_(declared), half_(half_width(record)) {}

  void run() {
    take_out_frozen(record_);
    check_values();
    check_poses();
    for (const MeasuredSignal& s : record_.signals)
      if (s.kind == SignalKind::velocity) check_velocity(s);
    for (const MeasuredSignal& s : record_.signals) {
      if (s.kind == SignalKind::position)
        check_command(s), check_twist(s), check_sides(s), check_late(s);
      if (s.kind == SignalKind::position || s.kind == SignalKind::command) check_range(s);
    }
    for (const MeasuredSignal& s : record_.signals)
      if (s.kind == SignalKind::force) check_force(s);
  }

  void run_declared() {
    for (const MeasuredSignal& s : record_.signals) {
      if (s.kind == SignalKind::position || s.kind == SignalKind::command) check_range(s);
      if (s.kind == SignalKind::force) check_force(s);
    }
  }

 private:
  /// Of the smoothing, but never more than a fiftieth of the run.
  static std::size_t half_width(const Record& record) {
    const double wanted = std::round(kSmoothing / 2 / record.period);
    return static_cast<std::size_t>(
        std::clamp(wanted, 1.0, std::max(1.0, static_cast<double>(record.samples()) / 100)));
  }

  void warn(const std::string& sentence) {
    std::vector<std::string>& told = record_.warnings;
    if (std::find(told.begin(), told.end(), sentence) == told.end()) told.push_back(sentence);
  }
  [[noreturn]] void refuse(const std::string& sentence) const {
    throw MeasurementError(record_.source + ": " + sentence);
  }
  static std::string name(const MeasuredSignal& s) {
    return fmt::format("\"{}\" ({})", s.source, signal_name(s.kind, s.axis));
  }

  /// Smoothed velocity of a position.
  Series speed_of(const MeasuredSignal& s) const {
    return smoothed(first_derivative(s.value, record_.period), half_);
  }
  const MeasuredSignal* motion(std::size_t axis) const {
    const MeasuredSignal* s = record_.find(SignalKind::position, axis);
    return s ? s : record_.find(SignalKind::command, axis);
  }

  /// Whether an axis was told to stay where it is, and did: what it trembles by tells nothing.
  bool stands(std::size_t axis) const {
    constexpr double kTrembles = 20e-6;  // [m or rad]
    const MeasuredSignal *command = record_.find(SignalKind::command, axis),
                         *position = record_.find(SignalKind::position, axis);
    return command && position && constant(command->value) &&
           spread_of(position->value).span() < kTrembles;
  }

  /// Warns of values that stand alone far off both neighbours: no machine moves so.
  void check_lone(const MeasuredSignal& s) {
    const std::vector<double>& x = s.value;
    std::vector<double> bends;  // of three values in a row
    for (std::size_t k = 1; k + 1 < x.size(); ++k)
      if (const double bend = std::abs(x[k - 1] - 2 * x[k] + x[k + 1]); std::isfinite(bend))
        bends.push_back(bend);
    if (bends.size() < kEnoughToTell) return;
    const auto high = bends.end() - static_cast<std::ptrdiff_t>(bends.size() / kOneIn) - 1;
    std::nth_element(bends.begin(), high, bends.end());
    const double usual = std::max(*high, 2 * s.resolution);
    std::size_t count = 0, first = 0;
    for (std::size_t k = 1; k + 1 < x.size(); ++k) {
      const double up = x[k] - x[k - 1], down = x[k] - x[k + 1];
      if (!(up * down > 0 && std::min(std::abs(up), std::abs(down)) > kLone * usual)) continue;
      if (count++ == 0) first = k;
    }
    if (count == 0) return;
    const double off = x[first] - 0.5 * (x[first - 1] + x[first + 1]);
    warn(
        fmt::format("{}: {} alone far off the values before and after, the first by {:.4g} (SI) "
                    "at {:.4f} s; if {} not measured, say so by missing = [...] in the map",
                    name(s), count == 1 ? "1 value stands" : fmt::format("{} values stand", count),
                    off, record_.time_of(first), count == 1 ? "it was" : "they were"));
  }

  /// Warns of one value that comes more than once, far off all others: it means there is none.
  void check_filler(const MeasuredSignal& s) {
    for (const double sign : {1.0, -1.0}) {
      double least = HUGE_VAL, next = HUGE_VAL, most = -HUGE_VAL;
      std::size_t count = 0;
      for (const double value : s.value) {
        const double v = sign * value;
        if (!std::isfinite(v)) continue;
        if (v < least) next = least, least = v, count = 0;
        if (v > least) next = std::min(next, v);
        count += v == least;
        most = std::max(most, v);
      }
      if (count < 2 || !(most > next) || next - least < kFarAway * (most - next)) continue;
      warn(
          fmt::format("{}: {} values are {:.6g} (SI), far off all others; if they mean that there "
                      "is none, say so by missing = [...] in the map",
                      name(s), count, sign * least));
    }
  }

  /// What a drive that moves cannot have: its column holds something else, or is dead.
  bool is_left_out(const MeasuredSignal& s) const {
    return (s.kind == SignalKind::force || s.kind == SignalKind::velocity) && constant(s.value) &&
           !stands(s.axis);
  }

  void check_values() {
    std::size_t compared = 0, still = 0;
    for (MeasuredSignal& s : record_.signals) {
      const bool is_constant = constant(s.value);
      const bool raw = s.kind == SignalKind::cosine || s.kind == SignalKind::sine;
      if (is_compared(s.kind) || raw) ++compared, still += is_constant;
      const bool told = s.kind == SignalKind::applied_force || s.kind == SignalKind::added_force;
      const bool at_rest = s.kind != SignalKind::temperature && s.kind != SignalKind::clock &&
                           !is_reading(s.kind) && !raw && stands(s.axis);
      if (is_constant && s.kind != SignalKind::temperature && !told && !at_rest)
        warn(fmt::format("{} is constant; nothing can be learnt from it{}", name(s),
                         is_left_out(s) ? ", and it is left out" : ""));
      if (told && !record_.find(SignalKind::command, s.axis) && !is_followed(record_, s.axis))
        warn(fmt::format("{} is not used: no command of {} is known", name(s), kAxisNames[s.axis]));
      if (is_constant) continue;
      s.resolution = resolution_of(s.value);
      // What double precision leaves of a difference of two positions is no step.
      if (const MeasuredSignal* p = record_.find(SignalKind::position, s.axis);
          s.kind == SignalKind::twist && p && s.resolution < 1e-12 * spread_of(p->value).span())
        s.resolution = 0;
      if (s.kind == SignalKind::command && !are_multiples(s.value, s.resolution)) s.resolution = 0;
      const double steps = s.resolution > 0 ? spread_of(s.value).span() / s.resolution : HUGE_VAL;
      if (steps < kFewestSteps && s.kind != SignalKind::temperature && !told && !at_rest)
        warn(fmt::format("{} comes in {:.0f} coarse steps of {:.3g} (SI)", name(s), steps,
                         s.resolution));
      if (s.kind == SignalKind::force || is_reading(s.kind) || raw) check_ends(s);
      if (!raw && s.kind != SignalKind::temperature && s.kind != SignalKind::clock)
        check_lone(s), check_filler(s);
    }
    if (compared == 0)
      refuse(
          "no signal can be compared with a model: at least one position, twist, velocity, force, "
          "deflection, or sine and cosine is needed");
    if (compared == still)
      refuse("all measured signals are constant; nothing can be learnt from the run");
    for (std::size_t i = record_.signals.size(); i-- > 0;)
      if (is_left_out(record_.signals[i]))
        record_.signals.erase(record_.signals.begin() + static_cast<std::ptrdiff_t>(i));
    const double seconds = static_cast<double>(record_.samples()) * record_.period;
    if (seconds < 1)
      warn(
          fmt::format("a run of {:.3g} s is short; effects of the drives need some seconds of "
                      "motion",
                      seconds));
  }

  /// Where the ball is, all axes say.
  void check_poses() {
    const auto known = [&](std::size_t axis) { return motion(axis) != nullptr; };
    if (record_.on_table ||
        std::none_of(record_.signals.begin(), record_.signals.end(),
                     [](const MeasuredSignal& s) { return is_reading(s.kind); }) ||
        (known(kX) && known(kY) && known(kZ)))
      return;
    std::string missing;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      if (!known(axis)) missing += (missing.empty() ? "" : ", ") + std::string(kAxisNames[axis]);
    warn("readings are there, but neither command nor position of " + missing +
         ": they are taken to stand where the machine of the model starts");
  }

  /// Equal extremes in a row, many more than a quantised signal has there by itself.
  void check_ends(const MeasuredSignal& s) {
    const Spread spread = spread_of(s.value);
    for (const auto& [extreme, inside] : {std::pair(spread.high, -1.0), {spread.low, 1.0}}) {
      std::size_t at = 0, run = 0, longest = 0, beside = 0;
      for (const double v : s.value) {
        const bool hit = v == extreme;
        run = hit ? run + 1 : 0;
        at += hit;
        longest = std::max(longest, run);
        const double depth = (v - extreme) * inside;
        beside += s.resolution > 0 && depth > 0 && depth < 3.5 * s.resolution;
      }
      const bool often = 1000 * at >= spread.count;
      if (longest >= 5 && often && 3 * at > 5 * beside)
        warn(fmt::format("{} stays at its {} value {:.4g} in {} samples: it may be saturated",
                         name(s), inside < 0 ? "largest" : "least", extreme, at));
    }
  }

  void check_velocity(const MeasuredSignal& s) {
    const MeasuredSignal* own = motion(s.axis);
    if (stands(s.axis)) return;
    if (!own || constant(own->value) || constant(s.value)) return;
    const Series measured = smoothed(s.value, half_);
    const Relation r = relate(speed_of(*own), measured);
    if (!r.known) return;
    const bool belongs = std::abs(r.correlation) >= kBelongs;
    if (belongs && std::abs(r.slope - 1) <= kSlope) return check_late_velocity(s);
    if (fits(relate(speed_of(s), smoothed(own->value, half_))))
      refuse(
          fmt::format("{} is the derivative of {}: the columns are swapped", name(*own), name(s)));
    if (belongs) {
      const std::string found = fmt::format("{} is {:.4g} times the derivative of {}{}", name(s),
                                            r.slope, name(*own), usual_mistake(r.slope));
      if (!(r.slope > 0.75 && r.slope < 1.33))
        refuse(found + "; check unit, scale and sign of the two columns");
      warn(found);
      return;
    }
    for (std::size_t other = 0; other < kAxisCount; ++other) {
      const MeasuredSignal* o = motion(other);
      if (o && other != s.axis && !constant(o->value) && fits(relate(speed_of(*o), measured)))
        refuse(fmt::format("{} is the derivative of {}, not of {}: the columns are swapped",
                           name(s), name(*o), name(*own)));
    }
    refuse(
        fmt::format("{} is not the derivative of {} (correlation {:.2f}); one of the columns is "
                    "another signal",
                    name(s), name(*own), r.correlation));
  }

  void check_late_velocity(const MeasuredSignal& s) {
    const auto late = lateness_of_velocity(record_, s.axis);
    if (!late || std::abs(*late) < kLateVelocity) return;
    warn(fmt::format("{} comes {:.3g} ms {} the position of {}; it is compared as if it did not",
                     name(s), 1e3 * std::abs(*late), *late > 0 ? "after" : "before",
                     kAxisNames[s.axis]));
  }

  /// Motor and load move alike, but for what twists and plays between them.
  void check_twist(const MeasuredSignal& s) const {
    const MeasuredSignal* twist = record_.find(SignalKind::twist, s.axis);
    if (!twist) return;
    const double span = spread_of(twist->value).span(), moved = spread_of(s.value).span();
    if (!(span > 10 * kMoves && span > 0.5 * moved)) return;
    std::vector<double> steps;
    for (std::size_t k = 1; k < twist->value.size(); ++k)
      if (const double d = std::abs(twist->value[k] - twist->value[k - 1]); std::isfinite(d))
        steps.push_back(d);
    if (steps.empty()) return;
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    const double usual = *middle, jump = *std::max_element(middle, steps.end());
    const char* unit = is_rotary(s.axis) ? "rad" : "m";
    refuse(
        fmt::format("load and motor differ by {:.4g} {} while {} moves by {:.4g}; {}", span, unit,
                    name(s), moved,
                    jump > kMoves && jump > 50 * usual
                        ? fmt::format("one of them jumps by {:.4g} {}: an encoder that wraps must "
                                      "be unrolled before",
                                      jump, unit)
                        : "check scale (gear, lead), sign and unit of the two positions"));
  }

  /// A transmission gives way to what it carries, by which the load stays behind the motor.
  void check_sides(const MeasuredSignal& s) {
    const MeasuredSignal* twist = record_.find(SignalKind::twist, s.axis);
    if (!twist || constant(twist->value) || constant(s.value)) return;
    const MeasuredSignal* force = record_.find(SignalKind::force, s.axis);
    if (force ? !is_pushed_ahead(*twist, *force) : !leads(*twist, s)) return;
    warn(
        fmt::format("{}: the load is ahead of the motor where the motor should pull it: are the "
                    "columns of motor and load swapped, or is one of them late?",
                    name(*twist)));
  }

  /// One side of a transmission stays behind the other by the same time at every speed.
  void check_late(const MeasuredSignal& s) {
    const MeasuredSignal* twist = record_.find(SignalKind::twist, s.axis);
    if (!twist || constant(twist->value) || constant(s.value)) return;
    const auto fit = fit_force(*twist, s);
    if (!fit || fit->explained < kFits || fit->viscous_explains < kViscous) return;
    const double late = std::abs(fit->viscous);
    if (late < std::max(kLate, 0.3 * record_.period)) return;
    warn(fmt::format("{} goes along with the velocity as if the {} were recorded {:.3g} ms late",
                     name(*twist), fit->viscous < 0 ? "load" : "motor", 1e3 * late));
  }

  bool is_pushed_ahead(const MeasuredSignal& twist, const MeasuredSignal& force) const {
    const Relation r = relate(smoothed(force.value, half_), smoothed(twist.value, half_));
    return r.known && r.correlation > kBelongs;
  }

  /// Where the force is not known: with what inertia and friction of the load would need.
  bool leads(const MeasuredSignal& twist, const MeasuredSignal& position) const {
    const auto fit = fit_force(twist, position);
    return fit && fit->explained > kCarries && fit->mass > 0 && fit->dry > 0 &&
           std::min(fit->mass_explains, fit->dry_explains) > kCarriesPart;
  }

  /// From where on, and how far, a command goes while its position stays as it is.
  void check_stuck(const MeasuredSignal& s, const MeasuredSignal& command) const {
    const double enough = std::max(10 * kMoves, 0.1 * spread_of(command.value).span());
    if (const auto begin = stays_while(s.value, command.value, enough))
      refuse(
          fmt::format("{} stays at {:.6g} from {:.3f} s on while {} goes on: a measuring system "
                      "that failed, or a column that was not written",
                      name(s), s.value[*begin], record_.time_of(*begin), name(command)));
  }

  void check_command(const MeasuredSignal& s) {
    const MeasuredSignal* own = record_.find(SignalKind::command, s.axis);
    if (!own) return tell_no_command(s.axis);
    if (constant(own->value)) return;
    if (constant(s.value)) {
      const double span = spread_of(own->value).span();
      if (span > kMoves)
        refuse(
            fmt::format("{} stays where it is while {} moves by {:.4g} {}: another column, or "
                        "an encoder that is not connected",
                        name(s), name(*own), span, is_rotary(s.axis) ? "rad" : "m"));
      return;
    }
    check_stuck(s, *own);
    check_measured(s, *own);
    const Series moved = speed_of(s);
    const Relation r = relate(speed_of(*own), moved);
    if (!r.known) return;
    if (r.correlation < -kBelongs)
      refuse(fmt::format("{} moves against {}; check the signs", name(s), name(*own)));
    if (r.correlation >= kBelongs) {
      if (std::abs(r.slope - 1) <= 2 * kSlope) return check_order(s, *own);
      const std::string found = fmt::format("{} moves {:.4g} times as far as {}{}", name(s),
                                            r.slope, name(*own), usual_mistake(r.slope));
      if (r.slope > 0.5 && r.slope < 1.9)
        warn(found);
      else
        refuse(found + "; check unit and scale of the two columns");
      return;
    }
    for (std::size_t other = 0; other < kAxisCount; ++other) {
      const MeasuredSignal* c = record_.find(SignalKind::command, other);
      if (c && other != s.axis && !constant(c->value) && fits(relate(speed_of(*c), moved)))
        refuse(fmt::format("{} follows {}, not {}: the columns are swapped", name(s), name(*c),
                           name(*own)));
    }
    warn(
        fmt::format("{} hardly follows {} (correlation of their speeds {:.2f}); what an axis is "
                    "behind its command is of kind following_error",
                    name(s), name(*own), r.correlation));
  }

  /// No drive follows without error.
  void check_measured(const MeasuredSignal& s, const MeasuredSignal& command) const {
    if (spread_of(command.value).span() > kMoves && is_copy(s.value, command.value))
      refuse(
          fmt::format("{} is {} itself, value by value (but for a factor and an offset): no drive "
                      "follows without error; give the column of the measuring system",
                      name(s), name(command)));
  }

  void tell_no_command(std::size_t axis) {
    if (is_followed(record_, axis))
      warn(
          fmt::format("no command of {} is known: it is taken to be sent where it was measured; "
                      "nothing can be learnt about its control loops, and laps are "
                      "only known where the map gives them ([[laps]], lap_column)",
                      kAxisNames[axis]));
  }

  /// A position comes after its command.
  void check_order(const MeasuredSignal& s, const MeasuredSignal& command) {
    Series ahead = s.value;
    for (std::size_t k = 0; k < ahead.size(); ++k) ahead[k] -= command.value[k];
    const Relation r = relate(speed_of(command), smoothed(ahead, half_));
    if (!r.known || r.correlation < kBelongs || r.slope < std::max(kLead, 2 * record_.period))
      return;
    warn(
        fmt::format("{} is ahead of {} by {:.3g} ms: swapped columns, other time stamps, or far "
                    "too much feed-forward",
                    name(s), name(command), 1e3 * r.slope));
  }

  void check_range(const MeasuredSignal& s) {
    if (!declared_) return;
    const AxisLimits& l = declared_->axes[s.axis].limits;
    const Spread spread = spread_of(s.value);
    const double travel = l.max - l.min, share = spread.span() / travel;
    const char* unit = is_rotary(s.axis) ? "rad" : "m";
    if (share > 1.5)
      refuse(
          fmt::format("{} spans {:.4g} {}, the declared travel is {:.4g} {}{}; check unit and "
                      "scale",
                      name(s), spread.span(), unit, travel, unit, likely(share, s.axis)));
    if (share > 1.02 || spread.low < l.min - 0.02 * travel || spread.high > l.max + 0.02 * travel)
      warn(fmt::format("{} runs {:.4g} .. {:.4g} {}, outside the declared travel {:.4g} .. {:.4g}",
                       name(s), spread.low, spread.high, unit, l.min, l.max));
    double fastest = 0;
    for (const double v : speed_of(s))
      if (std::isfinite(v)) fastest = std::max(fastest, std::abs(v));
    const double speed = fastest / l.velocity;
    if (speed > 5)
      refuse(
          fmt::format("{} moves at {:.4g} {}/s, the declared limit is {:.4g}{}; check the units "
                      "of position and time",
                      name(s), fastest, unit, l.velocity, likely(speed, s.axis)));
    if (speed > 1.1)
      warn(fmt::format("{} moves at {:.4g} {}/s, above the declared limit of {:.4g}", name(s),
                       fastest, unit, l.velocity));
    if (share > 0 && share < 1e-3 && speed < 1e-3 && !stands(s.axis))
      warn(
          fmt::format("{} spans {:.4g} {} only, {:.2g} of the declared travel; check the unit "
                      "(1000: m and mm{})",
                      name(s), spread.span(), unit, share,
                      is_rotary(s.axis) ? "; 57.3: radians and degrees" : ""));
  }

  /// The mistake that would make a plausible share of one this much too large.
  static std::string likely(double share, std::size_t axis) {
    if (is_rotary(axis) && share / (1 / kDegree) <= 1.02)
      return "; a factor of 57.3 would fit: radians and degrees";
    if (share / 1e3 <= 1.02) return "; a factor of 1000 would fit: m and mm";
    if (share / 1e6 <= 1.02) return "; a factor of 1e6 would fit: m and um";
    return "";
  }

  struct ForceFit {
    double mass = 0, viscous = 0, dry = 0;
    double explained = 0;         ///< share of the variance
    double mass_explains = 0;     ///< ... that is lost without the mass
    double viscous_explains = 0;  ///< ... that is lost without viscous friction
    double dry_explains = 0;      ///< ... that is lost without dry friction
  };

  /// What a force is compared with, all in one band.
  struct ForceSeries {
    Series velocity, acceleration, force;
    double fastest = 0;
  };

  ForceSeries force_series(const MeasuredSignal& force, const MeasuredSignal& position) const {
    ForceSeries s;
    s.velocity = speed_of(position);
    s.acceleration = smoothed(first_derivative(s.velocity, record_.period), half_);
    s.force = smoothed(smoothed(force.value, half_), half_);
    for (const double x : s.velocity)
      if (std::isfinite(x)) s.fastest = std::max(s.fastest, std::abs(x));
    return s;
  }

  std::optional<ForceFit> fit_force(const MeasuredSignal& force,
                                    const MeasuredSignal& position) const {
    return fit_force(force_series(force, position));
  }

  /// With a force that is `late` samples behind, at every so many samples; the same ones whatever
  /// it is, up to `most`.
  static std::optional<ForceFit> fit_force(const ForceSeries& s, long late = 0, long most = 0,
                                           long stride = 1) {
    const Series &v = s.velocity, &a = s.acceleration;
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    double square = 0, sum = 0, n = 0;
    for (long i = most; i < static_cast<long>(v.size()) - most; i += stride) {
      const auto k = static_cast<std::size_t>(i);
      const double f = s.force[static_cast<std::size_t>(i + late)];
      if (!std::isfinite(a[k]) || !std::isfinite(f) || !std::isfinite(v[k]) ||
          std::abs(v[k]) < 0.02 * s.fastest)
        continue;
      const Eigen::Vector4d row(a[k], v[k], v[k] > 0 ? 1 : -1, 1);
      normal += row * row.transpose();
      right += row * f;
      square += f * f;
      sum += f;
      ++n;
    }
    const double variance = square - sum * sum / std::max(n, 1.0);
    if (n < 50 || !(variance > 1e-12 * square)) return std::nullopt;
    const Eigen::Vector4d x = normal.ldlt().solve(right);
    if (!x.allFinite()) return std::nullopt;
    const double left = square - x.dot(right);
    const auto explains = [&](Eigen::Index column) {
      Eigen::Matrix4d others = normal;
      others.row(column).setZero(), others.col(column).setZero();
      others(column, column) = 1;
      Eigen::Vector4d b = right;
      b[column] = 0;
      return (square - others.ldlt().solve(b).dot(b) - left) / variance;
    };
    return ForceFit{x[0], x[1], x[2], 1 - left / variance, explains(0), explains(1), explains(2)};
  }

  /// No drive gives five times what it can.
  void check_force_limit(const MeasuredSignal& s) const {
    if (!declared_) return;
    const double limit = declared_->axes[s.axis].mechanics.force_limit;
    const Spread spread = spread_of(s.value);
    const double largest = std::max(std::abs(spread.low), std::abs(spread.high));
    if (spread.count == 0 || largest <= 5 * limit) return;
    const bool rotary = is_rotary(s.axis);
    refuse(
        fmt::format("{} reaches {:.4g} {}, the declared limit is {:.4g} (axes.{}.{}); check unit "
                    "and scale of the force, and whether it is another column",
                    name(s), largest, rotary ? "N m" : "N", limit, kAxisNames[s.axis],
                    rotary ? "torque_limit_Nm" : "force_limit_N"));
  }

  /// The force that a motion needs comes when it is needed.
  void check_force_time(const MeasuredSignal& force, const MeasuredSignal& position) {
    const ForceSeries series = force_series(force, position);
    const long most = samples_of(kMostForceLag), known = samples_of(kForceLag),
               coarse = std::max(1L, samples_of(kForceLag / 2));
    const auto n = static_cast<long>(force.value.size());
    if (n < 10 * most) return;
    const long stride = std::max(1L, n / kSamplesOfForce);
    double least = 1, least_known = 1;
    long best = 0;
    const auto look = [&](long late) {
      const auto fit = fit_force(series, late, most, stride);
      const double left = fit ? 1 - fit->explained : 1;
      if (left < least) least = left, best = late;
      if (std::abs(late) <= known) least_known = std::min(least_known, left);
    };
    for (long late = -most; late <= most; late += coarse) look(late);
    const long about = best;
    const long fine = std::max(1L, coarse / kFinerLag);
    for (long late = about - coarse; late <= about + coarse; late += fine)
      if (std::abs(late) <= most) look(late);
    for (const long late : {-known, 0L, known}) look(late);
    if (std::abs(best) <= known || std::abs(best) == most || least > 1 - kFits ||
        kLateLeaves * least > least_known)
      return;
    warn(fmt::format(
        "{} is {:.0f} ms {} for what {} does: mass and friction explain {:.0f} % of it then, "
        "{:.0f} % as it is; put its time right",
        name(force), 1e3 * static_cast<double>(std::abs(best)) * record_.period,
        best > 0 ? "late" : "early", name(position), std::floor(100 * (1 - least)),
        std::floor(100 * (1 - least_known))));
  }

  long samples_of(double time) const { return std::lround(time / record_.period); }

  void check_force(const MeasuredSignal& s) {
    check_force_limit(s);
    const MeasuredSignal* own = motion(s.axis);
    if (!own || constant(own->value) || constant(s.value) || stands(s.axis)) return;
    const auto fit = fit_force(s, *own);
    if (!fit) return;
    if (fit->explained < 0.3) {
      for (std::size_t other = 0; other < kAxisCount; ++other) {
        const MeasuredSignal* o = motion(other);
        if (!o || other == s.axis || constant(o->value)) continue;
        if (const auto fits = fit_force(s, *o); fits && fits->explained > 0.8)
          refuse(
              fmt::format("{} belongs to the motion of {} ({:.0f} % of it), not to that of {} "
                          "({:.0f} %): the columns are swapped",
                          name(s), name(*o), fits->explained * 100, name(*own),
                          std::max(0.0, fit->explained) * 100));
      }
      warn(
          fmt::format("{} has little to do with the motion of {}: mass and friction explain "
                      "{:.0f} % of it",
                      name(s), name(*own), std::max(0.0, fit->explained) * 100));
      return;
    }
    if (fit->mass < 0 && fit->mass_explains > 0.1)
      refuse(fmt::format("{} acts against the acceleration of {}; its sign must be -1", name(s),
                         name(*own)));
    if (fit->dry < 0 && fit->viscous < 0 && fit->mass_explains < 0.1)
      warn(fmt::format("{} helps the motion of {} instead of braking it; check its sign", name(s),
                       name(*own)));
    check_force_time(s, *own);
    if (!declared_ || fit->mass_explains < 0.1) return;
    const double ratio = fit->mass / declared_->axes[s.axis].mechanics.total_inertia();
    if (ratio < 5 && ratio > 0.2) return;
    const std::string sentence =
        fmt::format("{} over acceleration is {:.4g} {}, {:.3g} times the declared inertia", name(s),
                    fit->mass, is_rotary(s.axis) ? "kg m2" : "kg", ratio);
    if (ratio > kImpossible || ratio < 1 / kImpossible)
      refuse(sentence +
             "; check the unit of the time stamps or the rate (ms taken for s makes it "
             "1e6 times), and unit and scale of position and force");
    warn(sentence + usual_mistake(ratio) + "; check unit and scale of the force");
  }

  Record& record_;
  const Machine* declared_;
  std::size_t half_;
};

}  // namespace

bool is_copy(const std::vector<double>& value, const std::vector<double>& of) {
  const Relation r = relate(of, value);
  if (!r.known) return false;
  Series off = value;
  for (std::size_t k = 0; k < off.size(); ++k) off[k] -= r.slope * of[k];
  return spread_of(off).span() < kSameCopy * spread_of(value).span();
}

std::string usual_mistake(double factor) {
  struct Known {
    double factor;
    const char* text;
  };
  constexpr double kTurn = 2 * kPi;
  static const std::array known{
      Known{1e3, "1000: m and mm, or s and ms"},
      Known{1e6, "1e6: m and um, or s and us"},
      Known{1 / kDegree, "57.3: radians and degrees"},
      Known{kTurn, "2 pi: turns and radians"},
      Known{360, "360: turns and degrees"},
      Known{60, "60: per second and per minute"},
      Known{6e4, "60000: m/s and mm/min"},
      Known{25.4, "25.4: inches and mm"},
      Known{2, "2: diameter and radius, or periods and half periods"},
      Known{10, "10: a decimal place"},
      Known{100, "100: m and cm, or shares and percent"},
  };
  for (const Known& k : known)
    for (const double f : {k.factor, 1 / k.factor})
      if (std::abs(std::abs(factor) / f - 1) < 0.03)
        return fmt::format(" (a factor of {})", k.text);
  return "";
}

double resolution_of(const std::vector<double>& value) {
  constexpr std::size_t kMost = 20'000;
  constexpr double kOff = 0.05, kSure = 0.99;
  double largest = 0;
  for (const double v : value)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  const double noise = 16 * 2.2e-16 * largest;
  std::vector<double> steps;
  for (std::size_t k = 1; k < value.size() && steps.size() < kMost; ++k) {
    const double d = std::abs(value[k] - value[k - 1]);
    if (std::isfinite(d) && d > noise) steps.push_back(d);
  }
  if (steps.size() < 10) return 0;
  std::sort(steps.begin(), steps.end());
  for (const int part : {1, 2, 3}) {
    double q = steps.front() / part;
    if (q <= noise) break;
    // The small multiples sharpen the step before the large ones are looked at.
    double sum = 0, count = 0;
    std::size_t good = 0;
    for (const double d : steps) {
      const double multiple = std::round(d / q);
      if (std::abs(d / q - multiple) > kOff + multiple * noise / q) continue;
      ++good;
      sum += d, count += multiple;
      q = sum / count;
    }
    if (static_cast<double>(good) >= kSure * static_cast<double>(steps.size())) return q;
  }
  return 0;
}

void check_record(Record& record, const Machine* declared) { Checker(record, declared).run(); }

void check_against(Record& record, const Machine& declared) {
  Checker(record, &declared).run_declared();
}

}  // namespace vcnc
