#include "diagnosis/search/chatter_search.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/search/freed_number.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kLoud = 300;  ///< power over the noise around
constexpr double kFrequency = 2;
constexpr double kAmplitude = 30;  ///< differs as much as the frequency does by kFrequency
constexpr double kAsStrong = 3;
constexpr double kSizes[] = {0.25, 1, 4};
constexpr double kBetween = 2;  ///< from one size to where the next begins

bool is_of_drive(const ComparedChannel& channel, std::size_t axis) {
  return channel.axis == axis &&
         (channel.kind == SignalKind::position || channel.kind == SignalKind::force);
}

bool is_of_drive(const Candidate& c, std::size_t axis) {
  return c.place == kAxisNames[axis] &&
         (c.family == Family::servo || c.family == Family::friction ||
          c.family == Family::mechanics);
}

/// Strongest line of an axis' own signals, its position if there is one; strength 0: none.
NoiseLine strongest(const std::vector<NoiseLine>& lines, std::size_t axis) {
  NoiseLine best;
  for (const NoiseLine& line : lines) {
    if (!is_of_drive(line.channel, axis) || line.strength < kLoud) continue;
    const bool nearer =
        line.channel.kind == SignalKind::position && best.channel.kind != SignalKind::position;
    const bool same = line.channel.kind == best.channel.kind;
    if (best.strength == 0 || nearer || (same && line.strength > best.strength)) best = line;
  }
  return best;
}

double factors(double a, double b, double base) {
  return std::abs(std::log(a / b)) / std::log(base);
}

bool is_like(const NoiseLine& model, const NoiseLine& measured) {
  return model.strength > 0 && factors(model.frequency, measured.frequency, kFrequency) <= 1;
}

/// How unlike two vibrations are.
double unlike(const NoiseLine& model, const NoiseLine& measured) {
  return std::max(factors(model.frequency, measured.frequency, kFrequency),
                  factors(model.amplitude, measured.amplitude, kAmplitude));
}

class ChatterSearch {
 public:
  ChatterSearch(const Evidence& evidence, const Machine& declared,
                const std::vector<Candidate>& candidates)
      : evidence_(evidence), declared_(declared), candidates_(candidates) {}

  std::vector<ChatterCause> causes_of(std::size_t axis, const NoiseLine& measured) const {
    std::vector<std::size_t> owner;
    std::vector<double> sizes;
    std::vector<Machine> machines;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!is_of_drive(candidates_[c], axis)) continue;
      for (const double size : kSizes) {
        owner.push_back(c);
        sizes.push_back(size);
        machines.push_back(with_candidate(declared_, candidates_[c], size));
      }
    }
    const std::vector<Vibration> lines = vibrations_of(machines, measured.channel);
    std::vector<ChatterCause> causes;
    for (std::size_t i = 0; i < machines.size(); ++i) {
      const auto& [line, as_strong] = lines[i];
      if (!is_like(line, measured)) continue;
      if (causes.empty() || causes.back().candidate != owner[i])
        causes.push_back({owner[i], sizes[i], 0, 0, line, as_strong});
      ChatterCause& cause = causes.back();
      const FreeNumber& number = candidates_[owner[i]].numbers.front();
      const double first = number_of(declared_, number.key), unit = number.typical;
      if (cause.high == 0) cause.low = first + unit * sizes[i] / kBetween;
      cause.high = first + unit * sizes[i] * kBetween;
      // Sizes go up by a constant factor: the middle one of those so far.
      cause.size = std::sqrt((cause.low - first) * (cause.high - first)) / unit;
      if (unlike(line, measured) >= unlike(cause.line, measured)) continue;
      cause.line = line;
      cause.as_strong = as_strong;
    }
    std::stable_sort(causes.begin(), causes.end(), [&](const auto& x, const auto& y) {
      if (x.as_strong != y.as_strong) return x.as_strong;
      return unlike(x.line, measured) < unlike(y.line, measured);
    });
    return causes;
  }

 private:
  struct Vibration {
    NoiseLine line;
    bool as_strong = false;
  };

  /// Strongest line of a channel by each machine, as laps of it differ.
  std::vector<Vibration> vibrations_of(const std::vector<Machine>& machines,
                                       const ComparedChannel& channel) const {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    std::size_t at = 0;
    while (channels[at].kind != channel.kind || channels[at].axis != channel.axis) ++at;
    std::vector<Vibration> all;
    for (std::size_t first = 0; first < machines.size(); first += Evidence::kTogether) {
      const std::size_t last = std::min(first + Evidence::kTogether, machines.size());
      const std::vector<Prediction> predictions =
          evidence_.predict_all({machines.begin() + static_cast<std::ptrdiff_t>(first),
                                 machines.begin() + static_cast<std::ptrdiff_t>(last)});
      for (const Prediction& p : predictions)
        all.push_back(
            {strongest(vibrations(evidence_.record(), evidence_.partition(), channel, p[at]),
                       channel.axis),
             as_strong(p, channel.axis)});
    }
    return all;
  }

  /// Whether laps of a prediction differ as much as those of the record in every signal of a drive.
  bool as_strong(const Prediction& p, std::size_t axis) const {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (!is_of_drive(channels[c], axis)) continue;
      const double model = lap_scatter(evidence_.partition(), p[c]);
      if (factors(model, evidence_.noise().channels[c].rms, kAsStrong) > 1) return false;
    }
    return true;
  }

  const Evidence& evidence_;
  const Machine& declared_;
  const std::vector<Candidate>& candidates_;
};

}  // namespace

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
                                  const std::vector<NoiseLine>& before) {
  std::vector<Chatter> all;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const NoiseLine line = strongest(evidence.noise().lines, axis);
    const NoiseLine was = strongest(before, axis);
    if (line.strength == 0 || (was.strength > 0 && line.amplitude < 2 * was.amplitude)) continue;
    all.push_back(
        {axis, line, ChatterSearch(evidence, declared, candidates).causes_of(axis, line)});
  }
  return all;
}

}  // namespace vcnc
