#include "diagnosis/evidence/noise_audit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "model/axes.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

using Series = std::vector<double>;

constexpr double kDeviationPerMedian = 1.4826;  ///< of the sizes of normal numbers

/// Less its straight line; NaN stays.
void remove_line(Series& d) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    if (std::isnan(d[k])) continue;
    const double x = static_cast<double>(k);
    n += 1, sx += x, sy += d[k], sxx += x * x, sxy += x * d[k];
  }
  const double det = n * sxx - sx * sx;
  if (n < 2 || det <= 0) return;
  const double slope = (n * sxy - sx * sy) / det, offset = (sy - slope * sx) / n;
  for (std::size_t k = 0; k < d.size(); ++k) d[k] -= offset + slope * static_cast<double>(k);
}

struct LapNoise {
  Series value;
  bool held_out = false;
};

/// Laps that a sample must have to be compared: all of them, as what one lap does alone was left
/// out there and may be in the others, too; two, where samples are missing so often that a filter
/// finds few without one.
double laps_needed(const Series& there, std::size_t laps) {
  constexpr std::size_t kRun = kWhiteningOrder + 1;
  constexpr double kMostly = 0.5;
  double in_runs = 0, some = 0;
  std::size_t run = 0;
  for (const double n : there) {
    run = n == static_cast<double>(laps) ? run + 1 : 0;
    in_runs += run >= kRun, some += n >= 2;
  }
  return in_runs < kMostly * some ? 2 : static_cast<double>(laps);
}

/// d_i of every lap of every condition that was repeated.
std::vector<LapNoise> lap_noise(const Partition& partition, const Series& residual) {
  std::vector<LapNoise> all;
  for (const std::vector<Stretch>& of : partition.repetitions()) {
    const std::size_t length = of.front().end - of.front().begin;
    Series there(length, 0.0), mean(length, 0.0);  // laps that have a sample, and their mean
    const auto run_in = partition.run_in.find(of.front().condition);
    const std::size_t first = run_in == partition.run_in.end() ? 0 : run_in->second;
    for (const Stretch& s : of)
      for (std::size_t k = first; k < length; ++k) there[k] += std::isfinite(residual[s.begin + k]);
    for (const Stretch& s : of)
      for (std::size_t k = first; k < length; ++k)
        if (const double r = residual[s.begin + k]; std::isfinite(r)) mean[k] += r / there[k];
    const double needed = laps_needed(there, of.size());
    for (std::size_t i = 0; i < of.size(); ++i) {
      LapNoise lap{Series(length), i % 2 == 1};
      for (std::size_t k = 0; k < length; ++k)
        lap.value[k] = there[k] < needed ? kMissing
                                         : (residual[of[i].begin + k] - mean[k]) *
                                               std::sqrt(there[k] / (there[k] - 1));
      remove_line(lap.value);
      all.push_back(std::move(lap));
    }
  }
  return all;
}

enum class Which { all, run_once };

/// The stretches as they are less their straight lines; every other one is held out.
std::vector<LapNoise> whole_laps(const Partition& partition, const Series& value,
                                 Which which = Which::all) {
  std::vector<LapNoise> all;
  for (const Stretch& s : partition.stretches) {
    if (which == Which::run_once && !partition.once(s)) continue;
    LapNoise lap{Series(value.begin() + static_cast<std::ptrdiff_t>(s.begin),
                        value.begin() + static_cast<std::ptrdiff_t>(s.end)),
                 all.size() % 2 == 0};
    remove_line(lap.value);
    all.push_back(std::move(lap));
  }
  return all;
}

/// Autocovariances over all stretches without gaps.
Series covariances(const std::vector<LapNoise>& laps) {
  Series sum(kWhiteningOrder + 1, 0.0), count(kWhiteningOrder + 1, 0.0);
  for (const LapNoise& lap : laps) {
    for (std::size_t k = 0; k < lap.value.size(); ++k) {
      for (std::size_t j = 0; j <= std::min(k, kWhiteningOrder); ++j) {
        const double product = lap.value[k] * lap.value[k - j];
        if (std::isnan(product)) continue;
        sum[j] += product;
        count[j] += 1;
      }
    }
  }
  // Divided by the count at lag 0 throughout, so that the Toeplitz matrix stays positive definite.
  for (double& c : sum) c /= std::max(1.0, count[0]);
  return sum;
}

/// Mean square of the filtered laps, those that are held out if there are any.
double left_by(const WhiteningFilter& filter, const std::vector<LapNoise>& laps) {
  const bool all = std::none_of(laps.begin(), laps.end(), [](const auto& l) { return l.held_out; });
  double sum = 0, count = 0;
  for (const LapNoise& lap : laps) {
    if (!all && !lap.held_out) continue;
    for (std::size_t k = filter.a.size(); k < lap.value.size(); ++k) {
      double z = lap.value[k];
      for (std::size_t j = 0; j < filter.a.size(); ++j) z -= filter.a[j] * lap.value[k - 1 - j];
      if (std::isnan(z)) continue;
      sum += z * z;
      count += 1;
    }
  }
  return count > 0 ? sum / count : 0;
}

/// The usual size of what a filter leaves of the laps, squared, whatever the largest are.
double usually_left_by(const WhiteningFilter& filter, const std::vector<LapNoise>& laps) {
  Series sizes;
  for (const LapNoise& lap : laps)
    for (std::size_t k = filter.a.size(); k < lap.value.size(); ++k) {
      double z = lap.value[k];
      for (std::size_t j = 0; j < filter.a.size(); ++j) z -= filter.a[j] * lap.value[k - 1 - j];
      if (!std::isnan(z)) sizes.push_back(std::abs(z));
    }
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return kDeviationPerMedian * kDeviationPerMedian * *middle * *middle;
}

/// Mean periodogram of the laps, all padded to one length.
Series periodogram(const std::vector<LapNoise>& laps) {
  std::size_t longest = 0;
  for (const LapNoise& lap : laps) longest = std::max(longest, lap.value.size());
  std::size_t n = 1;
  while (n < longest) n *= 2;
  Series power(n / 2, 0.0);
  Eigen::FFT<double> fft;
  for (const LapNoise& lap : laps) {
    Series padded(n, 0.0);
    const double size = static_cast<double>(lap.value.size());
    for (std::size_t k = 0; k < lap.value.size(); ++k) {
      const double window = 0.5 - 0.5 * std::cos(2 * kPi * (static_cast<double>(k) + 0.5) / size);
      padded[k] = std::isnan(lap.value[k]) ? 0 : lap.value[k] * window;
    }
    std::vector<std::complex<double>> spectrum;
    fft.fwd(spectrum, padded);
    for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(spectrum[k]) / size;
  }
  return power;
}

/// Of bins [begin, end); of none nought.
double median_of(const Series& power, std::size_t begin, std::size_t end) {
  if (begin >= end) return 0;
  Series part(power.begin() + static_cast<std::ptrdiff_t>(begin),
              power.begin() + static_cast<std::ptrdiff_t>(end));
  const auto middle = part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2);
  std::nth_element(part.begin(), middle, part.end());
  return *middle;
}

/// What a line stands out of: the usual power about it, or that of a little below in frequency,
/// where noise that falls steeply is louder and what seems to stand out is a chance of it.
double power_about(const Series& power, std::size_t at) {
  constexpr std::size_t kReach = 60, kNear = 20, kOfLine = 5;
  const auto before = [&](std::size_t bins) { return at > bins ? at - bins : 1; };
  return std::max(median_of(power, before(kReach), std::min(power.size(), at + kReach + 1)),
                  median_of(power, before(kNear), before(kOfLine)));
}

/// Those of an amplitude of more than `least` [SI].
std::vector<NoiseLine> find_lines(const ComparedChannel& channel, const std::vector<LapNoise>& laps,
                                  double period, double least) {
  constexpr double kStrength = 40;
  constexpr std::size_t kLowest = 8, kShortest = 128;  // bins, samples
  std::vector<NoiseLine> lines;
  if (std::none_of(laps.begin(), laps.end(),
                   [](const LapNoise& l) { return l.value.size() > kShortest; }))
    return lines;
  const Series power = periodogram(laps);
  const double bin = 1 / (period * 2 * static_cast<double>(power.size()));
  const double mean_lap = std::accumulate(laps.begin(), laps.end(), 0.0,
                                          [](double s, const LapNoise& l) {
                                            return s + static_cast<double>(l.value.size());
                                          }) /
                          static_cast<double>(laps.size());
  for (std::size_t k = kLowest; k + 1 < power.size(); ++k) {
    if (power[k] < power[k - 1] || power[k] <= power[k + 1]) continue;
    const double about = power_about(power, k);
    if (about <= 0 || power[k] < kStrength * about) continue;
    // Vertex of the parabola through the logarithms of three bins.
    const double l = std::log(power[k - 1]), c = std::log(power[k]), r = std::log(power[k + 1]);
    const double shift = 0.5 * (l - r) / (l - 2 * c + r);
    const double frequency = (static_cast<double>(k) + shift) * bin;
    // A sine of amplitude A has |X|^2/n = n (A/4)^2 under this window.
    const double amplitude = 4 * std::sqrt(power[k] / static_cast<double>(laps.size()) / mean_lap);
    if (amplitude > least) lines.push_back({channel, frequency, power[k] / about, amplitude});
  }
  std::sort(lines.begin(), lines.end(),
            [](const NoiseLine& x, const NoiseLine& y) { return x.strength > y.strength; });
  if (lines.size() > 3) lines.resize(3);
  return lines;
}

/// Of what was run once, with the covariances that are added to what is seen; `laps` where that is
/// no noisier than those.
WhiteningFilter filter_of_once(const Partition& partition, const Series& residual,
                               const Series& added, const WhiteningFilter& laps, double of_laps) {
  const std::vector<LapNoise> once = whole_laps(partition, residual, Which::run_once);
  Series covariance = covariances(once);
  for (std::size_t j = 0; j < added.size(); ++j) covariance[j] += added[j];
  if (!(covariance[0] > of_laps)) return laps;
  WhiteningFilter filter = fit_autoregression(covariance);
  filter.scale = std::max(filter.scale, std::sqrt(left_by(filter, once)));
  return filter;
}

/// Noise of a channel whose laps nobody can compare, from what is not explained of it.
ChannelNoise noise_of_unrepeated(const std::vector<LapNoise>& pieces, const Series& added,
                                 double least, Coloured coloured) {
  Series covariance = covariances(pieces);
  for (std::size_t j = 0; j < added.size(); ++j) covariance[j] += added[j];
  covariance[0] += least;
  ChannelNoise noise;
  noise.filter = fit_autoregression(covariance);
  double of_filter = 1;  // variance that white noise of variance 1 has after it
  for (const double a : noise.filter.a) of_filter += a * a;
  const double rounded = added.empty() ? 0 : added[0];
  noise.filter.scale =
      std::sqrt(usually_left_by(noise.filter, pieces) + of_filter * (least + rounded));
  noise.rms = noise.filter.scale / std::sqrt(of_filter);
  if (coloured == Coloured::deviation) {
    Series alone = added.empty() ? Series(kWhiteningOrder + 1, 0.0) : added;
    alone[0] = noise.rms * noise.rms;
    noise.filter = fit_autoregression(alone);
  }
  noise.once = noise.filter;
  return noise;
}

double resolution_of(const Record& record, const ComparedChannel& channel) {
  const MeasuredSignal* signal = record.find(channel.kind, channel.axis);
  return signal ? signal->resolution : 0;
}

}  // namespace

WhiteningFilter fit_autoregression(const std::vector<double>& covariance) {
  WhiteningFilter filter;
  const std::size_t order = covariance.empty() ? 0 : covariance.size() - 1;
  if (order == 0 || covariance[0] <= 0) return filter;
  std::vector<double> a;
  double error = covariance[0] * (1 + 1e-9);
  for (std::size_t m = 0; m < order; ++m) {
    double reflection = covariance[m + 1];
    for (std::size_t j = 0; j < m; ++j) reflection -= a[j] * covariance[m - j];
    reflection /= error;
    std::vector<double> next(m + 1);
    for (std::size_t j = 0; j < m; ++j) next[j] = a[j] - reflection * a[m - 1 - j];
    next[m] = reflection;
    a = std::move(next);
    error *= 1 - reflection * reflection;
  }
  filter.a = std::move(a);
  filter.scale = std::sqrt(error);
  return filter;
}

double exactness(const ComparedChannel& channel, const Series& residual) {
  switch (channel.kind) {
    case SignalKind::position:
    case SignalKind::twist:
      return is_rotary(channel.axis) ? 5e-9 : 1e-9;
    case SignalKind::deflection:
    case SignalKind::bar:
    case SignalKind::tool_position:
      return 5e-9;
    default:
      break;
  }
  double largest = 0;
  for (const double r : residual) largest = std::max(largest, std::isfinite(r) ? std::abs(r) : 0);
  return std::max(1e-6, 1e-7 * largest);
}

std::vector<NoiseLine> vibrations(const Record& record, const Partition& partition,
                                  const ComparedChannel& channel,
                                  const std::vector<double>& series) {
  const std::vector<LapNoise> laps = lap_noise(partition, series);
  return laps.empty() ? std::vector<NoiseLine>{} : find_lines(channel, laps, record.period, 0);
}

std::optional<double> lap_scatter(const Partition& partition, const std::vector<double>& series) {
  const std::vector<LapNoise> laps = lap_noise(partition, series);
  const auto known = [](double x) { return std::isfinite(x); };
  if (std::none_of(laps.begin(), laps.end(), [&](const LapNoise& lap) {
        return std::any_of(lap.value.begin(), lap.value.end(), known);
      }))
    return {};
  return std::sqrt(covariances(laps)[0]);
}

NoiseAudit audit_noise(const Record& record, const Partition& partition,
                       const std::vector<ComparedChannel>& channels,
                       const std::vector<std::vector<double>>& residual,
                       const std::vector<std::vector<double>>& rounding, Coloured coloured) {
  NoiseAudit audit;
  audit.from_repetitions = partition.repeated;
  if (!partition.repeated)
    audit.warnings.push_back(
        "No motion was repeated: what its own past does not foretell of the residual counts as "
        "noise, so that noise which is not white may be taken for a deviation.");
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Series of_rounding =
        rounding.empty() ? Series() : covariances(whole_laps(partition, rounding[c]));
    const double resolution = resolution_of(record, channels[c]);
    const double least = resolution * resolution / 12 +
                         exactness(channels[c], residual[c]) * exactness(channels[c], residual[c]);
    if (!partition.repeated) {
      audit.channels.push_back(
          noise_of_unrepeated(whole_laps(partition, residual[c]), of_rounding, least, coloured));
      continue;
    }
    const std::vector<LapNoise> laps = lap_noise(partition, residual[c]);
    Series covariance = covariances(laps);
    const double of_laps = covariance[0];
    for (std::size_t j = 0; j < of_rounding.size(); ++j) covariance[j] += of_rounding[j];
    ChannelNoise noise;
    noise.rms = std::sqrt(std::max(covariance[0], least));
    const bool quiet = covariance[0] < least;
    if (quiet) covariance[0] = least;
    noise.filter = fit_autoregression(covariance);
    const double expected = noise.filter.scale * noise.filter.scale;
    const double left = left_by(noise.filter, laps);
    // Where the laps are quieter than the channel can be, what it can be counts.
    noise.filter.scale =
        std::sqrt(quiet || covariance[0] > of_laps || !(left > 0) ? expected : left);
    noise.of_laps = std::min(1.0, left / (noise.filter.scale * noise.filter.scale));
    noise.once = filter_of_once(partition, residual[c], of_rounding, noise.filter, covariance[0]);
    const std::vector<NoiseLine> lines =
        find_lines(channels[c], laps, record.period, 0.1 * std::sqrt(least));
    audit.lines.insert(audit.lines.end(), lines.begin(), lines.end());
    audit.channels.push_back(std::move(noise));
  }
  return audit;
}

}  // namespace vcnc
