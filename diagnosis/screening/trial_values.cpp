#include "diagnosis/screening/trial_values.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "diagnosis/evidence/line_spectrum.hpp"
#include "diagnosis/parallel.hpp"
#include "model/axes.hpp"
#include "model/fields.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

constexpr WaveGrid kAboutLine{.first = -0.4, .apart = 0.1, .count = 9};  ///< waves per travel
constexpr double kMostWaves = 2000;                                      ///< per travel
constexpr double kSamplesPerWave = 4;     ///< at the least: shorter ones might be longer ones
constexpr double kSameWaves = 0.75;       ///< per travel: no other line
constexpr double kSameWavesFound = 0.05;  ///< where they were fitted
constexpr double kSameFrequency = 1.5;    ///< [Hz]
constexpr double kSameInstant = 0.1;      ///< [s]
constexpr std::size_t kStrongest = 3;     ///< lines of an axis

/// The values of `found` in turn, one that `same` takes for one of `known` as it is there.
template <class Same>
void follow_values(std::vector<double>& found, const std::vector<double>& known, Same&& same) {
  for (double& value : found)
    for (const double k : known)
      if (same(value, k)) value = k;
}

/// Samples of the fitted laps.
std::vector<std::size_t> fitted_samples(const Evidence& evidence) {
  std::vector<std::size_t> samples;
  for (const RecordBlock& block : evidence.partition().blocks)
    for (std::size_t k = block.begin; k < block.end && !block.held_out; ++k) samples.push_back(k);
  return samples;
}

/// How many waves per travel the axis is slow enough for, mostly.
Eigen::Index most_waves(const std::vector<double>& command, const std::vector<std::size_t>& samples,
                        double travel) {
  std::vector<double> steps;
  for (const std::size_t k : samples)
    if (k > 0)
      if (const double step = std::abs(command[k] - command[k - 1]); step > 0)
        steps.push_back(step);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return static_cast<Eigen::Index>(std::min(kMostWaves, travel / (kSamplesPerWave * *middle)));
}

struct Line {
  double waves, power;
  Eigen::Index channel;
};

/// Peaks of the powers of each channel, the strongest first; the longest wave is one if it does
/// more than the next.
std::vector<Line> lines_of(const Eigen::ArrayXXd& power, const WaveGrid& grid, double least) {
  std::vector<Line> lines;
  for (Eigen::Index c = 0; c < power.cols(); ++c)
    for (Eigen::Index i = 0; i + 1 < power.rows(); ++i)
      if ((i == 0 || power(i, c) >= power(i - 1, c)) && power(i, c) > power(i + 1, c) &&
          power(i, c) >= least)
        lines.push_back({grid.waves(i), power(i, c), c});
  std::sort(lines.begin(), lines.end(),
            [](const Line& x, const Line& y) { return x.power > y.power; });
  return lines;
}

}  // namespace

TrialValuesOf::TrialValuesOf(const Evidence& evidence, const Machine& machine,
                             const Column& residual, double least_gain)
    : evidence_(&evidence),
      duration_(static_cast<double>(evidence.record().samples()) * evidence.record().period),
      travel_(kAxisCount, 0.0),
      wavelengths_(kAxisCount),
      jump_(find_jump(residual)),
      ringing_(find_ringing(residual)) {
  for (const AxisParams& axis : machine.axes)
    travel_per_turn_.push_back(axis.mechanics.travel_per_turn);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (const MeasuredSignal* command = evidence.record().find(SignalKind::command, axis)) {
      const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
      travel_[axis] = *high - *low;
    }
  parallel_for(kAxisCount, [&](std::size_t axis) {
    wavelengths_[axis] = find_wavelengths(axis, residual, least_gain);
  });
}

void TrialValuesOf::follow(const TrialValuesOf& known) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    follow_values(wavelengths_[axis], known.wavelengths_[axis], [&](double w, double k) {
      return std::abs(travel_[axis] / w - travel_[axis] / k) < kSameWaves;
    });
  follow_values(ringing_, known.ringing_,
                [](double f, double k) { return std::abs(f - k) < kSameFrequency; });
  if (std::abs(jump_ - known.jump_) < kSameInstant) jump_ = known.jump_;
}

void TrialValuesOf::add_found(const Candidate& candidate, const std::vector<FreedNumber>& numbers) {
  const std::size_t axis = axis_named(candidate.place);
  if (axis == kAxisCount) return;
  for (const FreedNumber& n : numbers) {
    if (!n.shape || !is_wavelength(n.number)) continue;
    const double found = n.value * si_of_unit(n.number.key);
    std::vector<double>& known = wavelengths_[axis];
    if (std::none_of(known.begin(), known.end(), [&](double w) {
          return std::abs(travel_[axis] / w - travel_[axis] / found) < kSameWavesFound;
        }))
      known.push_back(found);
  }
}

std::vector<double> TrialValuesOf::find_wavelengths(std::size_t axis, const Column& residual,
                                                    double least_gain) const {
  const Record& record = evidence_->record();
  const MeasuredSignal* command = record.find(SignalKind::command, axis);
  const double travel = travel_[axis];
  if (!command || !(travel > 0)) return {};
  std::vector<std::size_t> channels;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    const ComparedChannel& channel = evidence_->replica().channels()[c];
    if ((is_reading(channel.kind) || channel.axis == axis) && !residual[c].empty())
      channels.push_back(c);
  }
  const std::vector<std::size_t> samples = fitted_samples(*evidence_);
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::ArrayXd position(count);
  Eigen::ArrayXXd z(count, static_cast<Eigen::Index>(channels.size()));
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t k = samples[static_cast<std::size_t>(i)];
    position[i] = command->value[k];
    for (Eigen::Index c = 0; c < z.cols(); ++c)
      z(i, c) = static_cast<double>(residual[channels[static_cast<std::size_t>(c)]][k]);
  }
  const Eigen::Index most = most_waves(command->value, samples, travel);
  const Eigen::ArrayXXd power = line_spectrum(position, z, travel, most);

  std::vector<double> best;
  for (const Line& line : lines_of(power, even_waves(most), least_gain)) {
    const bool known = std::any_of(best.begin(), best.end(), [&](double w) {
      return std::abs(travel / w - line.waves) < kSameWaves;
    });
    if (known) continue;
    WaveGrid about = kAboutLine;
    about.first += line.waves;
    Eigen::Index highest = 0;
    line_powers(position, z.col(line.channel), travel, about).col(0).maxCoeff(&highest);
    best.push_back(travel / about.waves(highest));
    if (best.size() == kStrongest) break;
  }
  return best;
}

double TrialValuesOf::largest_reading() const {
  double largest = 0;
  for (const ComparedChannel& c : evidence_->replica().channels()) {
    if (!is_reading(c.kind)) continue;
    for (const double value : evidence_->record().find(c.kind, c.axis)->value)
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

double TrialValuesOf::find_jump(const Column& residual) const {
  const std::size_t window = 50;
  double largest = 0, at = 0;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    if (!is_reading(evidence_->replica().channels()[c].kind)) continue;
    const std::vector<float>& z = residual[c];
    double before = 0, after = 0;
    for (std::size_t k = 0; k + window < z.size(); ++k) {
      after += static_cast<double>(z[k + window]) - static_cast<double>(z[k]);
      if (k >= window) before += static_cast<double>(z[k]) - static_cast<double>(z[k - window]);
      if (std::abs(after - before) <= largest) continue;
      largest = std::abs(after - before);
      at = static_cast<double>(k) * evidence_->record().period;
    }
  }
  return at;
}

/// Peaks of the periodogram over the median around them; blocks of the fitted laps, Hann's window.
std::vector<double> TrialValuesOf::find_ringing(const Column& residual) const {
  constexpr double kLowest = 8, kHighest = 200, kStep = 1;  // [Hz]
  constexpr std::size_t kBeside = 12, kMost = 3;
  constexpr double kStandsOut = 3;
  std::vector<double> power(static_cast<std::size_t>((kHighest - kLowest) / kStep) + 1, 0.0);
  parallel_for(power.size(), [&](std::size_t i) {
    const double w =
        2 * kPi * (kLowest + kStep * static_cast<double>(i)) * evidence_->record().period;
    for (std::size_t c = 0; c < residual.size(); ++c) {
      const std::vector<float>& z = residual[c];
      if (!is_reading(evidence_->replica().channels()[c].kind) || z.empty()) continue;
      for (const RecordBlock& block : evidence_->partition().blocks) {
        if (block.held_out) continue;
        const double window = 2 * kPi / static_cast<double>(block.end - block.begin);
        const std::complex<double> turn = std::polar(1.0, w), slow = std::polar(1.0, window);
        std::complex<double> sum = 0, wave = 1, hann = 1;
        for (std::size_t k = block.begin; k < block.end; ++k, wave *= turn, hann *= slow)
          sum += (1 - hann.real()) * static_cast<double>(z[k]) * wave;
        power[i] += std::norm(sum);
      }
    }
  });
  std::vector<std::pair<double, double>> peaks;  // how far it stands out, frequency
  for (std::size_t i = 1; i + 1 < power.size(); ++i) {
    if (power[i] < power[i - 1] || power[i] <= power[i + 1]) continue;
    const std::size_t first = i > kBeside ? i - kBeside : 0,
                      last = std::min(power.size(), i + kBeside + 1);
    std::vector<double> around(power.begin() + static_cast<std::ptrdiff_t>(first),
                               power.begin() + static_cast<std::ptrdiff_t>(last));
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    if (power[i] > kStandsOut * *middle)
      peaks.emplace_back(power[i] / *middle, kLowest + kStep * static_cast<double>(i));
  }
  std::sort(peaks.rbegin(), peaks.rend());
  std::vector<double> frequencies;
  for (const auto& [ratio, frequency] : peaks)
    if (frequencies.size() < kMost) frequencies.push_back(frequency);
  return frequencies;
}

std::vector<double> TrialValuesOf::operator()(const Candidate& candidate,
                                              std::size_t number) const {
  const FreeNumber& n = candidate.numbers[number];
  const std::size_t axis = axis_named(candidate.place);
  std::vector<double> values{n.typical};
  const auto more = [&](const std::vector<double>& further) {
    values.insert(values.end(), further.begin(), further.end());
  };
  if (n.whole) {
    // Lobes of a ball, lobes of a bearing; waves per turn as the residual has them.
    if (contains(n.key, ".lobes")) more({2, 3, 4, 5});
    if (contains(n.key, ".harmonic")) more({2, 3});
    if (axis < kAxisCount && contains(n.key, ".order"))
      for (const double w : wavelengths_[axis])
        if (const double order = std::round(travel_per_turn_[axis] / w); order >= 1) more({order});
  } else if (is_limit(n)) {
    const double largest = largest_reading() / si_of_unit(n.key);
    for (const double share : {0.995, 0.97, 0.9, 0.8}) more({share * largest});
  } else if (contains(n.key, "frequency_Hz")) {
    for (const NoiseLine& line : evidence_->noise().lines) more({line.frequency});
    more(ringing_);
  } else if (contains(n.key, ".time_constant_s")) {
    values.clear();
    for (const double share : {0.1, 0.3, 1.0, 3.0}) more({share * duration_});
  } else if (contains(n.key, ".period_s")) {
    values.clear();
    // A quarter of a wave in the run's length apart: further off the phase is lost at its end.
    for (double waves = 0.5; waves <= 5; waves += 0.25) more({duration_ / waves});
  } else if (axis < kAxisCount && is_wavelength(n)) {
    for (const double w : wavelengths_[axis]) more({w / si_of_unit(n.key)});
  } else if (axis < kAxisCount && is_place(n)) {
    const MeasuredSignal* command = evidence_->record().find(SignalKind::command, axis);
    if (!command) return values;
    const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
    values.clear();
    const int places = contains(n.key, ".rest_") ? 3 : 8;  // a spring is nowhere without force
    for (int i = 0; i < places; ++i)
      more({(*low + (*high - *low) * (i + 0.5) / places) / si_of_unit(n.key)});
  } else if (contains(n.key, ".start_s")) {
    values = {jump_};
  } else if (contains(n.key, ".exponent")) {
    more({1.5, 2.0});
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

}  // namespace vcnc
