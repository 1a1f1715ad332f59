#include "diagnosis/replica/readings_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/record_check.hpp"
#include "diagnosis/records/signal_name.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kIs = 0.95, kMayBe = 0.7;  // correlations
constexpr double kSame = 1.03;              // of two factors
constexpr double kDeflected = 10e-6;        // rms from which on a ball is deflected [m]
constexpr double kTouched = 0.5e-6;         // ... from which on another unit would show [m]
constexpr double kNoGain = 20;              // a factor that no fault makes
constexpr double kNoFault = 1e-3;           // farther off than any fault brings a tool [m]

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sx = 0, sy = 0, xx = 0, yy = 0, xy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) continue;
    ++n, sx += x[k], sy += y[k], xx += x[k] * x[k], yy += y[k] * y[k], xy += x[k] * y[k];
  }
  const double square = (n * xx - sx * sx) * (n * yy - sy * sy);
  return square > 0 ? (n * xy - sx * sy) / std::sqrt(square) : 0;
}

struct Reading {
  const MeasuredSignal* measured;
  const std::vector<double>& predicted;
};

/// Of what is measured over what is predicted, by least squares through zero, where the one follows
/// the other.
std::optional<double> factor_of(const Reading& r, double deflected) {
  double n = 0, xx = 0, yy = 0, xy = 0;
  for (std::size_t k = 0; k < r.predicted.size(); ++k) {
    const double x = r.predicted[k], y = r.measured->value[k];
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    ++n, xx += x * x, yy += y * y, xy += x * y;
  }
  if (!(xx > n * deflected * deflected) || xy < kIs * std::sqrt(xx * yy)) return std::nullopt;
  return xy / xx;
}

std::string name(const MeasuredSignal& s) {
  return fmt::format("\"{}\" ({})", s.source, signal_name(s.kind, s.axis));
}

/// Readings in another unit are all too large by the same.
void check_unit(const Record& record, const std::vector<Reading>& readings) {
  std::vector<double> factors;
  for (const Reading& r : readings)
    if (const std::optional<double> factor = factor_of(r, kDeflected)) factors.push_back(*factor);
  if (factors.size() < 2) return;
  const auto [least, most] = std::minmax_element(factors.begin(), factors.end());
  const std::string mistake = usual_mistake(*most);
  if (mistake.empty() || *most > kSame * *least) return;
  throw MeasurementError(
      fmt::format("{}: all readings are {:.3g} times what the machine of the model would "
                  "read{}; check their unit, and the sizes of ball and piece",
                  record.source, *most, mistake));
}

/// One reading in another unit than the others.
void check_unit_of_one(const Record& record, const Reading& reading) {
  const std::optional<double> factor = factor_of(reading, kTouched);
  if (!factor || (*factor<kNoGain&& * factor> 1 / kNoGain)) return;
  const std::string mistake = usual_mistake(*factor);
  if (mistake.empty()) return;
  throw MeasurementError(fmt::format(
      "{}: {} is {:.3g} times what the machine of the model would read{}; check its unit and scale",
      record.source, name(*reading.measured), *factor, mistake));
}

/// Axes that are taken to be where they were measured, or to stand where the machine begins.
std::string without_commands(const Record& record) {
  std::string axes;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (!record.find(SignalKind::command, i))
      axes += fmt::format("{}{}", axes.empty() ? "" : ", ", kAxisNames[i]);
  return axes.empty() ? axes : fmt::format(" (no column is the command of {})", axes);
}

/// How far a reading is off, lowest, middle and highest.
struct FarOff {
  double low = 0, middle = 0, high = 0;
};

FarOff far_off(const Reading& r) {
  std::vector<double> all;
  for (std::size_t k = 0; k < r.predicted.size(); ++k)
    if (const double by = r.measured->value[k] - r.predicted[k]; std::isfinite(by))
      all.push_back(by);
  if (all.empty()) return {};
  std::sort(all.begin(), all.end());
  return {all.front(), all[all.size() / 2], all.back()};
}

/// Where the tool is, no fault changes by a millimetre.
void check_zero(const Record& record, const Reading& r) {
  const FarOff by = far_off(r);
  if (std::abs(by.middle) < kNoFault || by.high - by.low > kNoFault) return;
  throw MeasurementError(
      fmt::format("{}: {} is {:.6g} mm off what the machine of the model would read, always the "
                  "same; check zero_mm",
                  record.source, name(*r.measured), 1e3 * by.middle));
}

void check_place(const Record& record, const Reading& r) {
  const FarOff by = far_off(r);
  if (std::abs(by.middle) < kNoFault) return;
  throw MeasurementError(fmt::format(
      "{}: {} is {:.3g} mm off what the machine of the model would read; check its unit and scale, "
      "zero_mm, and the commands of the axes: sign, unit, one for another{}",
      record.source, name(*r.measured), 1e3 * by.middle, without_commands(record)));
}

/// Whether a reading goes as far as no fault does, so that it must go as it is predicted. The ball
/// of an R-test is held: what is predicted of that are the errors of a healthy machine.
bool goes_far(const Reading& r) {
  if (r.measured->kind != SignalKind::tool_position) return true;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double x : r.predicted)
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  return high - low > kNoFault;
}

}  // namespace

void check_readings(const Record& record, const std::vector<ComparedChannel>& channels,
                    const Prediction& predicted) {
  std::vector<Reading> readings;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& [kind, axis] = channels[c];
    const MeasuredSignal* s = record.find(kind, axis);
    if (!s || (!is_reading(kind) && kind != SignalKind::twist)) continue;
    const Reading reading{s, predicted[c]};
    if (kind == SignalKind::tool_position) check_zero(record, reading);
    if (!goes_far(reading)) continue;
    if (correlation(s->value, predicted[c]) < -kIs)
      throw MeasurementError(fmt::format(
          "{}: {} goes against what the machine does; check its sign", record.source, name(*s)));
    if (is_reading(kind)) readings.push_back(reading);
  }
  const auto alike = [](const Reading& read, const Reading& as) {
    return correlation(read.measured->value, as.predicted);
  };
  for (const Reading& a : readings)
    for (const Reading& b : readings)
      if (alike(a, b) > kIs && alike(a, a) < kMayBe && alike(b, b) < kMayBe)
        throw MeasurementError(fmt::format("{}: {} is what {} would be: the columns are swapped",
                                           record.source, name(*a.measured), name(*b.measured)));
  check_unit(record, readings);
  for (const Reading& r : readings) check_unit_of_one(record, r);
  for (std::size_t c = 0; c < channels.size(); ++c)
    if (const MeasuredSignal* s = record.find(channels[c].kind, channels[c].axis);
        s && s->kind == SignalKind::tool_position)
      check_place(record, {s, predicted[c]});
}

}  // namespace vcnc
