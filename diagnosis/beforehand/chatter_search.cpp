#include "diagnosis/beforehand/chatter_search.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "diagnosis/candidates/freed_number.hpp"
#include "model/axes.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

/// Power over the noise around of a line, and of one that makes such a part of all noise.
constexpr double kLoudLine = 300, kClear = 60, kPartOfNoise = 0.01;
constexpr double kFrequency = 2;
/// Part of its frequency that chatter may change by from run to run.
constexpr double kSameTone = 0.25;
/// Part of a frequency within which a line is the same, and times the power that is clearly more.
constexpr double kSameLine = 0.03, kClearlyMore = 4;
constexpr double kAmplitude = 30;  ///< differs as much as the frequency does by kFrequency
constexpr double kAsStrong = 3;
/// The same of a position that follows from the force, F / (m w^2).
constexpr double kFollows = kAsStrong * kFrequency * kFrequency;
constexpr double kSizes[] = {1.0 / 16, 0.25, 1, 4};
constexpr double kBetween = 2;           ///< from one size to where the next begins
constexpr std::size_t kMostCauses = 12;  ///< of what has no line

bool is_of_drive(const Candidate& c, std::size_t axis) {
  return c.place == kAxisNames[axis] && is_of_drive(c);
}

/// Strongest line of an axis' own signals, its position if there is one: of the loud ones, or of
/// those that are clear and no small part of the noise; strength 0: none.
NoiseLine strongest(const std::vector<NoiseLine>& lines, std::size_t axis,
                    const Evidence& evidence) {
  const auto strongest_that = [&](auto&& counts) {
    NoiseLine best;
    for (const NoiseLine& line : lines) {
      if (!is_of_drive(line.channel, axis) || !counts(line)) continue;
      const bool nearer =
          line.channel.kind == SignalKind::position && best.channel.kind != SignalKind::position;
      const bool same = line.channel.kind == best.channel.kind;
      if (best.strength == 0 || nearer || (same && line.strength > best.strength)) best = line;
    }
    return best;
  };
  const NoiseLine loud = strongest_that([](const NoiseLine& l) { return l.strength >= kLoudLine; });
  if (loud.strength > 0) return loud;
  return strongest_that([&](const NoiseLine& line) {
    const std::vector<ComparedChannel>& channels = evidence.replica().channels();
    const auto at = std::find(channels.begin(), channels.end(), line.channel) - channels.begin();
    const double noise = evidence.noise().channels[static_cast<std::size_t>(at)].rms;
    return line.strength >= kClear &&
           line.amplitude * line.amplitude / 2 > kPartOfNoise * noise * noise;
  });
}

double factors(double a, double b, double base) {
  return std::abs(std::log(a / b)) / std::log(base);
}

/// In the healthy run; 0: not known.
double before(const HealthyNoise& healthy, const Unrest& of) {
  for (const Unrest& u : healthy.unrest)
    if (u.channel == of.channel && u.at_rest == of.at_rest) return u.rms.value_or(0);
  return 0;
}

class ChatterSearch {
 public:
  ChatterSearch(const Evidence& evidence, const Machine& declared,
                const std::vector<Candidate>& candidates, const HealthyNoise& healthy)
      : evidence_(evidence),
        declared_(declared),
        candidates_(candidates),
        healthy_(healthy),
        measured_(unrest_of(evidence)) {}

  /// Nothing but the axis where its drive is as it was.
  Chatter chatter_of(std::size_t axis) const {
    Chatter c{
        .axis = axis, .line = {}, .of_model = false, .unrest = {}, .causes = {}, .too_many = 0};
    for (const Unrest& u : measured_) {
      const double was = before(healthy_, u);
      if (!is_of_drive(u.channel, axis) || was <= 0 || !u.rms || *u.rms < c.times * was) continue;
      if (vcnc::is_part_of_what_is_off(*u.rms, u.off)) continue;
      c.unrest = u;
      c.times = *u.rms / was;
    }
    const NoiseLine line = strongest(evidence_.noise().lines, axis, evidence_);
    if (line.strength > 0 && !is_as_before(line) && !is_part_of_what_is_off(line)) {
      c.line = line;
      c.of_model = power_at(line, evidence_.declared()[index_of(line.channel)]) >
                   kClearlyMore * power_at(line, measured(line.channel));
    }
    if (c.of_model) return c;
    if (c.has_line() || c.is_restless()) c.causes = causes_of(c);
    // A line that is not loud is news only where the model has it as strongly.
    if (c.has_line() && c.line.strength < kLoudLine &&
        (c.causes.empty() || !c.causes.front().as_strong)) {
      c.line = {};
      c.causes = c.is_restless() ? causes_of(c) : std::vector<ChatterCause>{};
    }
    if (!c.has_line() && c.causes.size() > kMostCauses) {
      c.too_many = c.causes.size();
      c.causes.clear();
    }
    return c;
  }

 private:
  /// Whether the healthy machine had it in the same signal at half the size at least, or where that
  /// tells nothing, in another signal of the drive.
  bool is_as_before(const NoiseLine& line) const {
    const auto alike = [&](const NoiseLine& was) {
      return std::abs(was.frequency - line.frequency) < kSameTone * line.frequency;
    };
    const auto same_signal = [&](const NoiseLine& was) { return was.channel == line.channel; };
    const auto& lines = healthy_.lines;
    if (std::any_of(lines.begin(), lines.end(), same_signal))
      return std::any_of(lines.begin(), lines.end(), [&](const NoiseLine& was) {
        return same_signal(was) && alike(was) && line.amplitude < 2 * was.amplitude;
      });
    return std::any_of(lines.begin(), lines.end(), [&](const NoiseLine& was) {
      return is_of_drive(was.channel, line.channel.axis) && alike(was);
    });
  }
  bool is_part_of_what_is_off(const NoiseLine& line) const {
    return std::any_of(measured_.begin(), measured_.end(), [&](const Unrest& u) {
      return u.channel == line.channel &&
             vcnc::is_part_of_what_is_off(line.amplitude / std::numbers::sqrt2, u.off);
    });
  }

  std::vector<ChatterCause> causes_of(const Chatter& chatter) const {
    std::vector<ChatterCause> causes;  // one for every run of sizes
    bool goes_on = false;
    for (const ChatterCause& t : tried(chatter)) {
      const bool joins = goes_on && causes.back().candidate == t.candidate;
      goes_on = is_like(t, chatter);
      if (!goes_on) continue;
      if (!joins) causes.push_back(t);
      ChatterCause& cause = causes.back();
      const FreeNumber& number = candidates_[t.candidate].numbers.front();
      const double first = number_of(declared_, number.key), unit = number.typical;
      if (cause.high == 0) cause.low = first + unit * t.size / kBetween;
      cause.high = first + unit * t.size * kBetween;
      cause.low = std::clamp(cause.low, number.min, number.max);
      cause.high = std::clamp(cause.high, number.min, number.max);
      // Sizes go up by a constant factor: the middle one of those so far.
      cause.size = std::sqrt((cause.low - first) * (cause.high - first)) / unit;
      if (unlike(t, chatter) >= unlike(cause, chatter)) continue;
      cause.line = t.line;
      cause.unrest = t.unrest;
      cause.as_strong = t.as_strong;
    }
    std::stable_sort(causes.begin(), causes.end(), [&](const auto& x, const auto& y) {
      if (x.as_strong != y.as_strong) return x.as_strong;
      return unlike(x, chatter) < unlike(y, chatter);
    });
    std::vector<ChatterCause> likest;  // of each candidate
    for (const ChatterCause& c : causes)
      if (std::none_of(likest.begin(), likest.end(),
                       [&](const ChatterCause& l) { return l.candidate == c.candidate; }))
        likest.push_back(c);
    return likest;
  }

  static bool is_like(const ChatterCause& model, const Chatter& measured) {
    if (!measured.has_line()) return model.as_strong;
    return model.line.strength > 0 &&
           factors(model.line.frequency, measured.line.frequency, kFrequency) <= 1;
  }

  /// How unlike two vibrations are.
  static double unlike(const ChatterCause& model, const Chatter& measured) {
    if (!measured.has_line()) return factors(*model.unrest.rms, *measured.unrest.rms, kAsStrong);
    return std::max(factors(model.line.frequency, measured.line.frequency, kFrequency),
                    factors(model.line.amplitude, measured.line.amplitude, kAmplitude));
  }

  /// Every candidate of the drive at every size, and what the model does with it.
  std::vector<ChatterCause> tried(const Chatter& chatter) const {
    std::vector<ChatterCause> all;
    std::vector<Machine> machines;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!is_of_drive(candidates_[c], chatter.axis)) continue;
      for (const double size : kSizes) {
        all.push_back({.candidate = c, .size = size, .line = {}, .unrest = {}});
        machines.push_back(with_candidate(declared_, candidates_[c], size));
      }
    }
    for (std::size_t first = 0; first < machines.size(); first += Evidence::kTogether) {
      const std::size_t last = std::min(first + Evidence::kTogether, machines.size());
      const std::vector<Prediction> predictions =
          evidence_.predict_all({machines.begin() + static_cast<std::ptrdiff_t>(first),
                                 machines.begin() + static_cast<std::ptrdiff_t>(last)});
      for (std::size_t i = first; i < last; ++i) look(predictions[i - first], chatter, all[i]);
    }
    return all;
  }

  /// What a prediction does in the signals of the drive.
  void look(const Prediction& prediction, const Chatter& chatter, ChatterCause& does) const {
    if (chatter.has_line()) does.line = line_of(prediction, chatter.line.channel);
    const bool at_rest = chatter.unrest.at_rest && !chatter.has_line();
    const std::vector<Unrest> model = unrest_of(evidence_, prediction);
    double most = std::numeric_limits<double>::infinity();  // how unlike the signals are
    const bool force_known = std::any_of(measured_.begin(), measured_.end(), [&](const Unrest& u) {
      return u.channel == ComparedChannel{SignalKind::force, chatter.axis} &&
             u.at_rest == at_rest && u.rms;
    });
    for (std::size_t i = 0; i < model.size(); ++i) {
      const Unrest& is = measured_[i];
      if (!is_of_drive(is.channel, chatter.axis) || is.at_rest != at_rest) continue;
      if (!is.rms || !model[i].rms) continue;
      const double was = before(healthy_, is), rms = std::hypot(*model[i].rms, was),
                   measured = std::max(*is.rms, was);
      if (measured <= 0) continue;
      const bool follows = force_known && is.channel.kind == SignalKind::position;
      const double differs = factors(rms, measured, follows ? kFollows : kAsStrong);
      most = std::isinf(most) ? differs : std::max(most, differs);
      if (is.channel.kind == chatter.unrest.channel.kind)
        does.unrest = {is.channel, is.at_rest, rms, 0};
    }
    does.as_strong = most <= 1;
  }

  /// The strongest line in a channel, as laps of a prediction differ.
  NoiseLine line_of(const Prediction& prediction, const ComparedChannel& channel) const {
    const std::size_t at = index_of(channel);
    const std::vector<double>& declared = evidence_.declared()[at];
    std::vector<double> change = prediction[at];
    for (std::size_t k = 0; k < change.size(); ++k) change[k] -= declared[k];
    const NoiseLine line =
        strongest(vibrations(evidence_.record(), evidence_.partition(), channel, change),
                  channel.axis, evidence_);
    const bool of_declared =
        line.strength > 0 && power_at(line, declared) > power_at(line, prediction[at]);
    return of_declared ? NoiseLine{} : line;
  }

  std::size_t index_of(const ComparedChannel& channel) const {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    return static_cast<std::size_t>(std::find(channels.begin(), channels.end(), channel) -
                                    channels.begin());
  }

  const std::vector<double>& measured(const ComparedChannel& channel) const {
    return evidence_.record().find(channel.kind, channel.axis)->value;
  }

  /// Power about the frequency of a line of what laps of a series differ by: what they differ by
  /// from a prediction may be the prediction's.
  double power_at(const NoiseLine& line, const std::vector<double>& series) const {
    constexpr int kReach = 10;  // frequencies on either side
    double power = 0;
    for (const std::vector<Stretch>& laps : evidence_.partition().repetitions()) {
      const std::size_t length = laps.front().end - laps.front().begin;
      std::vector<double> mean(length, 0.0);
      for (const Stretch& lap : laps)
        for (std::size_t k = 0; k < length; ++k)
          mean[k] += series[lap.begin + k] / static_cast<double>(laps.size());
      for (const Stretch& lap : laps)
        for (int i = -kReach; i <= kReach; ++i) {
          const double frequency = line.frequency * (1 + kSameLine * i / kReach);
          const std::complex<double> turn =
              std::polar(1.0, 2 * kPi * frequency * evidence_.record().period);
          std::complex<double> sum = 0, wave = 1;
          for (std::size_t k = 0; k < length; ++k, wave *= turn) {
            const double d = series[lap.begin + k] - mean[k];
            const double window = 1 - std::cos(2 * kPi * (static_cast<double>(k) + 0.5) /
                                               static_cast<double>(length));
            if (std::isfinite(d)) sum += d * window * wave;
          }
          power += std::norm(sum);
        }
    }
    return power;
  }

  const Evidence& evidence_;
  const Machine& declared_;
  const std::vector<Candidate>& candidates_;
  const HealthyNoise& healthy_;
  std::vector<Unrest> measured_;
};

}  // namespace

bool Chatter::is_restless() const {
  constexpr double kRestless = 3;  // times what the healthy run was
  return times > kRestless;
}

Machine with_candidate(Machine machine, const Candidate& c, double size) {
  for (std::size_t i = 0; i < c.numbers.size(); ++i) {
    const FreeNumber& n = c.numbers[i];
    if (i == 0)
      move_number(machine, n.key, number_of(machine, n.key) + size * n.typical);
    else if (number_of(machine, n.key) == 0)
      move_number(machine, n.key, n.typical);
  }
  return machine;
}

std::vector<Chatter> find_chatter(const Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const HealthyNoise& healthy) {
  const ChatterSearch search(evidence, declared, candidates, healthy);
  std::vector<Chatter> all;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (Chatter c = search.chatter_of(axis); c.has_line() || c.is_restless())
      all.push_back(std::move(c));
  return all;
}

}  // namespace vcnc
