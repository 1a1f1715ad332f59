#include "diagnosis/healthy/differential.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/evidence/noise_audit.hpp"
#include "diagnosis/evidence/partition.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/healthy/controller_check.hpp"
#include "diagnosis/healthy/controller_lags.hpp"
#include "diagnosis/records/any_record.hpp"
#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/records/signal_name.hpp"
#include "diagnosis/records/stretches.hpp"
#include "diagnosis/replica/model_comparison.hpp"

namespace vcnc {
namespace {

/// Lengths of laps of one condition differ by their start within a sample.
constexpr std::size_t kSlack = 3;
/// A reading is not told where it is off by more than this, of its roughness, and by more than
/// this, of what it usually is: a model that is wrong by a little everywhere cancels.
constexpr double kUntold = 20, kFarOff = 5;
/// Each lap is held against one of the healthy run where that leaves less than this of the scatter.
constexpr double kClearlyLess = 0.5;
/// Part of the time of its motions that a run must have in common with the healthy one.
constexpr double kLeastInCommon = 0.25;
constexpr double kApart_s = 0.1;  ///< between two parts of a record
/// Part of the readings that may be left out without a word.
constexpr double kLeftOut = 0.2;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Standard deviation of what is not smooth in a signal: of second differences, by their median.
double roughness(const std::vector<double>& value) {
  std::vector<double> second;
  for (std::size_t k = 2; k < value.size(); ++k)
    if (const double d = std::abs(value[k] - 2 * value[k - 1] + value[k - 2]); std::isfinite(d))
      second.push_back(d);
  return second.empty() ? 0 : 1.4826 * median(std::move(second)) / std::sqrt(6.0);
}

/// Median of the sizes of what is known of a series.
double median_size(const std::vector<double>& series) {
  std::vector<double> sizes;
  for (const double x : series)
    if (std::isfinite(x)) sizes.push_back(std::abs(x));
  return sizes.empty() ? 0 : median(std::move(sizes));
}

/// The longest three parts of a record that these samples, in order, are: "12.3 .. 14.1 s, 20 s".
std::string longest_of(const std::vector<std::size_t>& samples, const Record& record) {
  const auto apart = static_cast<std::size_t>(kApart_s / record.period) + 1;
  std::vector<std::pair<std::size_t, std::size_t>> parts;
  for (const std::size_t k : samples)
    if (parts.empty() || k > parts.back().second + apart)
      parts.emplace_back(k, k);
    else
      parts.back().second = k;
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return a.second - a.first > b.second - b.first;
  });
  if (parts.size() > 3) parts.resize(3);
  std::sort(parts.begin(), parts.end());
  std::vector<std::string> times;
  for (const auto& [from, to] : parts)
    times.push_back(to - from <= apart ? fmt::format("{:.2f}", record.time_of(from))
                                       : fmt::format("{:.2f} .. {:.2f}", record.time_of(from),
                                                     record.time_of(to)));
  return fmt::format("{} s", fmt::join(times, ", "));
}

/// The signals that can be compared: "position X, force X".
std::string measured_by(const Record& record) {
  std::string names;
  for (const MeasuredSignal& s : record.signals)
    if (is_compared(s.kind)) names += (names.empty() ? "" : ", ") + signal_name(s.kind, s.axis);
  return names.empty() ? "nothing" : names;
}

/// RMS of what the healthy machine is off the healthy run where it is told, per channel.
std::vector<std::pair<ComparedChannel, double>> leave_out_untold(Record& difference,
                                                                 const Record& now) {
  std::vector<std::pair<ComparedChannel, double>> off;
  for (MeasuredSignal& signal : difference.signals) {
    if (!is_reading(signal.kind)) continue;
    const std::vector<double>& measured = now.find(signal.kind, signal.axis)->value;
    std::vector<double> wrong(measured.size());
    for (std::size_t k = 0; k < wrong.size(); ++k) wrong[k] = measured[k] - signal.value[k];
    const double most = std::max(kUntold * std::max(roughness(measured), signal.resolution),
                                 kFarOff * median_size(wrong));
    if (most <= 0) continue;
    double sum = 0, n = 0, left_out = 0;
    std::vector<std::size_t> where;
    for (std::size_t k = 0; k < wrong.size(); ++k) {
      const double d = wrong[k];
      if (std::abs(d) > most) signal.value[k] = kMissing, ++left_out, where.push_back(k);
      if (std::abs(d) <= most) sum += d * d, n += 1;
    }
    off.emplace_back(ComparedChannel{signal.kind, signal.axis}, n > 0 ? std::sqrt(sum / n) : 0);
    const ShownUnit shown = shown_unit({signal.kind, signal.axis});
    if (left_out > kLeftOut * (n + left_out))
      difference.warnings.push_back(fmt::format(
          "{}: {:.0f} % of the readings are left out, where the model is off the healthy run by "
          "more than {:.3g} {}, for the longest at {}.",
          signal_name(signal.kind, signal.axis), 100 * left_out / (n + left_out),
          shown.factor * most, shown.name, longest_of(where, difference)));
  }
  return off;
}

/// What a force that only the healthy run tells, and that was taken from it, leaves of the signals
/// of its drive: of the position, what no gain does (controller_check.hpp).
void add_left_of_forces(const Record& now, DifferentialRecord& difference,
                        const HealthyRun& healthy) {
  SeriesOfChannels off(healthy.channels.size());
  for (std::size_t c = 0; c < off.size(); ++c) {
    const MeasuredSignal *was = now.find(healthy.channels[c].kind, healthy.channels[c].axis),
                         *is = difference.record.find(healthy.channels[c].kind,
                                                      healthy.channels[c].axis);
    if (!was || is_reading(healthy.channels[c].kind)) continue;
    for (std::size_t k = 0; k < was->value.size(); ++k)
      off[c].push_back(was->value[k] - is->value[k]);
  }
  const ControllerCheck check(now, healthy.channels, healthy.machine);
  for (std::size_t c = 0; c < off.size(); ++c) {
    const ComparedChannel& channel = healthy.channels[c];
    if (off[c].empty() || difference.unknown[channel.axis].empty()) continue;
    if (channel.kind == SignalKind::position) {
      const std::vector<double> of_gains = check.equation(channel.axis, off);
      for (std::size_t k = 0; k < of_gains.size(); ++k) off[c][k] -= of_gains[k];
    }
    difference.off.emplace_back(channel, std::sqrt(mean_square(off[c])));
  }
}

/// Without readings that are off by far more than most: moments of touching tell nothing of where
/// the piece is.
Record without_outliers(Record record, const Replica& replica, const Machine& declared) {
  const Prediction predicted = replica.predict(declared);
  for (std::size_t c = 0; c < predicted.size(); ++c) {
    const ComparedChannel& channel = replica.channels()[c];
    if (!is_reading(channel.kind)) continue;
    for (MeasuredSignal& signal : record.signals) {
      if (signal.kind != channel.kind || signal.axis != channel.axis) continue;
      std::vector<double> off(signal.value.size());
      for (std::size_t k = 0; k < off.size(); ++k)
        off[k] = std::abs(signal.value[k] - predicted[c][k]);
      const double most = std::max(kFarOff * median_size(off), kUntold * roughness(signal.value));
      for (std::size_t k = 0; k < off.size(); ++k)
        if (off[k] > most) signal.value[k] = kMissing;
    }
  }
  return record;
}

bool knows_forces(const Record& record) {
  return std::any_of(record.signals.begin(), record.signals.end(), [](const MeasuredSignal& s) {
    return s.kind == SignalKind::applied_force || s.kind == SignalKind::added_force;
  });
}

/// Laps of a healthy run that do the same as a lap of another: of the condition of the same number
/// if they are at the same place, else any at that place (a run may begin with a motion that was
/// broken off), else of that number wherever its encoders count from.
std::vector<const Stretch*> partners(const Record& now, const Stretch& lap, const Record& healthy) {
  const auto all = [&](bool same_number, At place) {
    std::vector<const Stretch*> laps;
    for (const Stretch& h : healthy.stretches) {
      const std::size_t a = h.end - h.begin, b = lap.end - lap.begin;
      if ((h.condition == lap.condition || !same_number) && (a > b ? a - b : b - a) <= kSlack &&
          same_way(now, lap, healthy, h, place))
        laps.push_back(&h);
    }
    return laps;
  };
  std::vector<const Stretch*> laps = all(true, At::the_same_place);
  if (laps.empty() && !knows_forces(healthy)) laps = all(false, At::the_same_place);
  return laps.empty() ? all(true, At::any_place) : laps;
}

/// Part of the time of a run's motions that the healthy run does, too.
double share_with_partners(const Record& now, const Record& healthy) {
  std::size_t all = 0, with = 0;
  for (const Stretch& lap : now.stretches) {
    all += lap.end - lap.begin;
    if (!partners(now, lap, healthy).empty()) with += lap.end - lap.begin;
  }
  return all > 0 ? static_cast<double>(with) / static_cast<double>(all) : 0;
}

/// The sample of a healthy lap that is the sample k of another.
std::size_t sample_of(const Stretch& healthy, const Stretch& lap, std::size_t k) {
  return std::min(healthy.begin + (k - lap.begin), healthy.end - 1);
}

/// The one of them that came as late as a lap of another run, else the first.
const Stretch& as_late_as(const Stretch& lap, const std::vector<const Stretch*>& laps) {
  const auto found = std::find_if(
      laps.begin(), laps.end(), [&](const Stretch* h) { return h->repetition == lap.repetition; });
  return found == laps.end() ? *laps.front() : **found;
}

/// What was in the laps of a healthy run, in those of another run that do the same.
std::vector<double> in_laps_of(const Record& now, const HealthyRun& healthy,
                               const std::vector<double>& series) {
  if (series.empty()) return {};
  std::vector<double> result(now.samples(), kMissing);
  for (const Stretch& lap : now.stretches) {
    const std::vector<const Stretch*> laps = partners(now, lap, healthy.record);
    if (laps.empty()) continue;
    const Stretch& same = as_late_as(lap, laps);
    for (std::size_t k = lap.begin; k < lap.end; ++k) result[k] = series[sample_of(same, lap, k)];
  }
  hold_over_gaps(result);
  return result;
}

/// Whether a sample of a signal is left out for what laps did not share.
bool unlike(const std::vector<LapEvent>& events, const MeasuredSignal& signal, std::size_t sample) {
  return std::any_of(events.begin(), events.end(), [&](const LapEvent& e) {
    return e.begin <= sample && sample < e.end &&
           (is_reading(signal.kind) || signal.axis == e.axis);
  });
}

/// A lap and those of the healthy run that do the same.
struct Pairing {
  const Stretch* lap;
  std::vector<const Stretch*> healthy;
};
using Pairings = std::vector<Pairing>;

/// Of those, the ones that came as late as the lap.
Pairings only_as_late(Pairings all) {
  for (auto& [lap, healthy] : all) {
    const int late = lap->repetition;
    std::erase_if(healthy, [late](const Stretch* h) { return h->repetition != late; });
  }
  return all;
}

/// A signal less what the healthy run has besides its machine.
struct Difference {
  std::vector<double> value;
  double noise_scale = 1;
};

/// `off`: what the healthy run is off its machine; the mean over the healthy laps counts.
Difference less_laps(const std::vector<double>& signal, const std::vector<double>& off,
                     const Pairings& pairings) {
  Difference d{std::vector<double>(signal.size(), kMissing)};
  std::size_t fewest = 0;
  for (const auto& [lap, laps] : pairings) {
    if (laps.empty()) continue;
    fewest = fewest == 0 ? laps.size() : std::min(fewest, laps.size());
    for (std::size_t k = lap->begin; k < lap->end; ++k) {
      double sum = 0;
      for (const Stretch* h : laps) sum += off[sample_of(*h, *lap, k)];
      d.value[k] = signal[k] - sum / static_cast<double>(laps.size());
    }
  }
  if (fewest > 0) d.noise_scale = std::sqrt(1 + 1 / static_cast<double>(fewest));
  return d;
}

/// Less what the healthy laps are off on average, or, where that leaves clearly less that changes
/// from lap to lap, less what the lap is off that came as late: what both runs have in their first
/// lap and not in their second is no noise.
Difference difference_of(const Record& now, const MeasuredSignal& signal, const HealthyRun& healthy,
                         const Pairings& pairings) {
  const auto channel = std::find(healthy.channels.begin(), healthy.channels.end(),
                                 ComparedChannel{signal.kind, signal.axis});
  const MeasuredSignal* partner = healthy.record.find(signal.kind, signal.axis);
  if (channel == healthy.channels.end() || !partner)
    return {std::vector<double>(signal.value.size(), kMissing)};
  const std::vector<double>& yhat =
      healthy.predicted[static_cast<std::size_t>(channel - healthy.channels.begin())];
  std::vector<double> off(yhat.size());
  for (std::size_t k = 0; k < off.size(); ++k)
    off[k] = unlike(healthy.events, signal, k) ? kMissing : partner->value[k] - yhat[k];
  const Pairings as_late = only_as_late(pairings);
  Difference mean = less_laps(signal.value, off, pairings);
  if (std::any_of(as_late.begin(), as_late.end(),
                  [](const Pairing& p) { return p.healthy.empty(); }))
    return mean;
  Difference each = less_laps(signal.value, off, as_late);
  each.noise_scale = 1;  // the noise of both runs is in what its laps differ by
  Partition whole = partition(now);
  whole.run_in.clear();  // where first laps differ most
  const auto scatter = [&](const Difference& d) {
    std::vector<double> left(d.value.size(), kMissing);
    for (const auto& [lap, laps] : as_late)
      for (std::size_t k = lap->begin; k < lap->end; ++k)
        left[k] = d.value[k] - yhat[sample_of(*laps.front(), *lap, k)];
    return lap_scatter(whole, left).value_or(0) * d.noise_scale;
  };
  return scatter(each) < kClearlyLess * scatter(mean) ? each : mean;
}

/// Laps under other forces are no repetitions of the same.
void check_known_forces(const Record& now, const Record& healthy) {
  for (const SignalKind kind : {SignalKind::applied_force, SignalKind::added_force})
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      if (!now.find(kind, axis) != !healthy.find(kind, axis))
        throw MeasurementError(
            fmt::format("{}: {} is known here and not in {}; a healthy run needs the same forces",
                        (now.find(kind, axis) ? now : healthy).source, signal_name(kind, axis),
                        (now.find(kind, axis) ? healthy : now).source));
}

}  // namespace

HealthyRun healthy_run(const Record& record, Replica& replica, const Machine& declared) {
  const Record told = without_outliers(record, replica, declared);
  Evidence evidence(told, replica, declared);
  std::vector<FreedNumber> clamping = nuisances(declared);
  std::erase_if(clamping, [](const FreedNumber& n) { return !is_clamping(n.number.key); });
  const Machine machine = fit_numbers(evidence, declared, std::move(clamping)).machine;
  return {record,
          machine,
          healthy_noise(evidence),
          evidence.events(),
          replica.channels(),
          replica.predict(machine)};
}

HealthyRun healthy_run_with_forces(const Record& record, MachineReplica& replica,
                                   const Machine& declared) {
  const Machine machine = with_lags_of(record, declared);
  ForceOfAxes unknown = unknown_force(record, machine);
  replica.apply(unknown);
  HealthyRun run = healthy_run(record, replica, machine);
  run.unknown = std::move(unknown);
  return run;
}

bool same_program(const Record& now, const Record& healthy) {
  if (now.stretches.empty()) return false;
  return std::none_of(now.stretches.begin(), now.stretches.end(),
                      [&](const Stretch& s) { return partners(now, s, healthy).empty(); });
}

double DifferentialRecord::off_in(const ComparedChannel& channel) const {
  for (const auto& [of, rms] : off)
    if (of == channel) return rms;
  return 0;
}

SeriesOfChannels DifferentialRecord::taken_off_of(
    const std::vector<ComparedChannel>& channels) const {
  SeriesOfChannels all(channels.size());
  for (const auto& [of, series] : taken_off)
    if (const auto c = std::find(channels.begin(), channels.end(), of); c != channels.end())
      all[static_cast<std::size_t>(c - channels.begin())] = series;
  return all;
}

std::vector<double> DifferentialRecord::noise_scales(
    const std::vector<ComparedChannel>& channels) const {
  if (noise_scale.empty()) return {};
  std::vector<double> all(channels.size(), 1);
  for (std::size_t c = 0; c < all.size(); ++c)
    for (const auto& [of, scale] : noise_scale)
      if (of == channels[c]) all[c] = scale;
  return all;
}

void check_comparable(const Record& now, const Record& healthy) {
  check_known_forces(now, healthy);
  for (const Record* of : {&now, &healthy})
    if (of->stretches.empty())
      throw MeasurementError(of->source +
                             ": its laps are not known, and only laps of the same motion can be "
                             "compared with a healthy run; give them in the map ([[laps]] or "
                             "lap_column)");
  check_same_kinematics(now, healthy);
  if (const double share = share_with_partners(now, healthy); share < kLeastInCommon)
    throw MeasurementError(fmt::format(
        "{}: does {} of the motions of {}; a healthy run needs the same program", healthy.source,
        share == 0 ? "none" : fmt::format("only {:.2g} % (by time)", 100 * share), now.source));
  if (std::none_of(now.signals.begin(), now.signals.end(), [&](const MeasuredSignal& s) {
        return is_compared(s.kind) && healthy.find(s.kind, s.axis);
      }))
    throw MeasurementError(fmt::format(
        "{}: measures {}, {} measures {}: no signal in common; a healthy run needs the same "
        "columns",
        healthy.source, measured_by(healthy), now.source, measured_by(now)));
}

DifferentialRecord less_healthy(const Record& now, const HealthyRun& healthy) {
  check_comparable(now, healthy.record);
  Pairings pairings;
  for (const Stretch& lap : now.stretches)
    pairings.push_back({&lap, partners(now, lap, healthy.record)});
  std::erase_if(pairings, [](const Pairing& p) { return p.healthy.empty(); });
  DifferentialRecord result{.record = now, .noise = healthy.noise, .healthy = healthy.machine};
  // What repeats a motion without a partner repeats nothing that is compared.
  result.record.stretches.clear();
  for (const Pairing& p : pairings) result.record.stretches.push_back(*p.lap);
  std::vector<std::string> alone;
  for (MeasuredSignal& signal : result.record.signals) {
    if (!is_compared(signal.kind)) continue;
    if (signal.kind == SignalKind::position && is_followed(now, signal.axis)) continue;
    if (!healthy.record.find(signal.kind, signal.axis))
      alone.push_back(signal_name(signal.kind, signal.axis));
    Difference difference = difference_of(now, signal, healthy, pairings);
    if (is_reading(signal.kind)) {
      std::vector<double> off(signal.value.size());
      for (std::size_t k = 0; k < off.size(); ++k) off[k] = signal.value[k] - difference.value[k];
      result.taken_off.emplace_back(ComparedChannel{signal.kind, signal.axis}, std::move(off));
    }
    signal.value = std::move(difference.value);
    result.noise_scale.emplace_back(ComparedChannel{signal.kind, signal.axis},
                                    difference.noise_scale);
  }
  if (!alone.empty())
    result.record.warnings.push_back(
        fmt::format("The reference run has no {}: not compared.", fmt::join(alone, ", ")));
  if (pairings.size() < now.stretches.size())
    result.record.warnings.push_back(fmt::format(
        "{:.0f} % of the motions (by time) have no partner in the reference run and are left out: "
        "was it the same program?",
        std::max(1.0, 100 * (1 - share_with_partners(now, healthy.record)))));
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    result.unknown[axis] = in_laps_of(now, healthy, healthy.unknown[axis]);
  result.off = leave_out_untold(result.record, now);
  add_left_of_forces(now, result, healthy);
  return result;
}

}  // namespace vcnc
