#include "diagnosis/quadrature.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "diagnosis/quadrature_lag.hpp"
#include "model/parameters.hpp"

namespace vcnc {

namespace {

constexpr int kNumbers = 7;  ///< of a curve, the amplitude first
constexpr std::size_t kBlocks = 40, kMostSamples = 100'000, kFewest = 400;
constexpr int kPhaseBins = 36;
constexpr double kLeastGain = 25;
/// Of the radius about the middle, in shares of its mean; noise alone has 0.52 (Rayleigh).
constexpr double kLargestScatter = 0.3;
/// Samples whose radius is off the median by more than this share are outliers if they are few.
constexpr double kFarRadius = 0.5, kMostOutliers = 0.01;
/// Of a middle off zero, over the amplitude: no offset of an encoder is that large.
constexpr double kOffCentre = 0.7;
/// Share of the amplitude, either way, from which on its change is told.
constexpr double kToldAmplitude = 0.003;
/// Parts of a record over which an amplitude may change, and periods that each has at least.
constexpr std::size_t kMostParts = 80;
constexpr double kPartPeriods = 8;
/// 97.5 % of Student's t with as many degrees of freedom as blocks less numbers.
constexpr double kStudent = 2.03;

using Numbers = Eigen::Matrix<double, kNumbers, 1>;
using Square = Eigen::Matrix<double, kNumbers, kNumbers>;
using Mask = std::array<bool, kNumbers>;

struct SignalEffect {
  const char* name;
  std::vector<int> numbers;
  std::vector<const char*> keys;
};

const std::vector<SignalEffect>& signal_effects() {
  static const std::vector<SignalEffect> all{
      {"signal_offset", {1, 2}, {"cosine_percent", "sine_percent"}},
      {"signal_gain", {3}, {"gain_percent"}},
      {"signal_phase", {4}, {"angle_deg"}},
      {"signal_harmonics", {5, 6}, {"second_percent", "third_percent"}}};
  return all;
}

/// Number in the unit of its key.
double in_key_unit(int number, double value) { return number == 4 ? value / kDegree : value * 100; }

SignalCurve curve_of(const Numbers& x) { return {x[0], x[1], x[2], x[3], x[4], x[5], x[6]}; }

Mask mask_of(const std::vector<std::size_t>& effects) {
  Mask free{true};
  for (const std::size_t e : effects)
    for (const int i : signal_effects()[e].numbers) free[static_cast<std::size_t>(i)] = true;
  return free;
}

struct Sample {
  SinCos signals;
  std::size_t block = 0;
};

/// Nearest point of a curve to a sample.
struct Foot {
  double phi = 0, distance = 0;  ///< along the normal, outwards
  Eigen::Vector2d normal;
};

Foot foot_of(const SignalCurve& curve, const SinCos& s) {
  Foot foot;
  const double w = (s.w / curve.amplitude - curve.sine_offset) / (1 + curve.gain);
  const double u = s.u / curve.amplitude - curve.cosine_offset;
  foot.phi = std::atan2((w + std::sin(curve.angle) * u) / std::cos(curve.angle), u);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 4; ++i) {
    const SinCos at = curve.at(foot.phi), next = curve.at(foot.phi + kStep);
    const Eigen::Vector2d tangent((next.u - at.u) / kStep, (next.w - at.w) / kStep);
    const Eigen::Vector2d off(s.u - at.u, s.w - at.w);
    foot.normal = Eigen::Vector2d(tangent.y(), -tangent.x()).normalized();
    foot.distance = foot.normal.dot(off);
    if (i < 3) foot.phi += tangent.dot(off) / tangent.squaredNorm();
  }
  return foot;
}

class ChannelFit {
 public:
  ChannelFit(const MeasuredSignal& cosine, const MeasuredSignal& sine) {
    const std::size_t n = cosine.value.size();
    std::vector<std::size_t> there;
    for (std::size_t k = 0; k < n; ++k)
      if (std::isfinite(cosine.value[k]) && std::isfinite(sine.value[k])) there.push_back(k);
    const std::size_t stride = there.size() / kMostSamples + 1;
    for (std::size_t i = 0; i < there.size(); i += stride)
      samples_.push_back({{cosine.value[there[i]], sine.value[there[i]]},
                          std::min(kBlocks - 1, i * kBlocks / there.size())});
    leave_out_outliers();
  }

  std::size_t size() const { return samples_.size(); }
  std::size_t outliers() const { return outliers_; }

  /// Takes out an amplitude that changes along the record, slower than within kPartPeriods; tells
  /// by which share of its mean it does so, either way.
  double level_amplitude() {
    std::vector<double> whole(samples_.size(), 1);
    for (int i = 0; i < 3; ++i) {
      const std::vector<double> level = amplitude_levels();
      if (level.empty()) return 0;
      for (std::size_t k = 0; k < level.size(); ++k) {
        whole[k] *= level[k];
        samples_[k].signals.u /= level[k];
        samples_[k].signals.w /= level[k];
      }
    }
    const auto [least, most] = std::minmax_element(whole.begin(), whole.end());
    return (*most - *least) / (*most + *least);
  }

  /// The ideal circle of the signals' own size.
  Numbers circle() const {
    double square = 0;
    for (const Sample& s : samples_)
      square += s.signals.u * s.signals.u + s.signals.w * s.signals.w;
    Numbers x = Numbers::Zero();
    x[0] = std::sqrt(square / static_cast<double>(samples_.size()));
    return x;
  }

  /// Sectors of 30 deg, about the middle of the signals, that hold samples; -1: the signals do not
  /// keep to a circle.
  int sectors() const {
    const Extent all = extent();
    std::array<bool, 12> seen{};
    double sum = 0, square = 0;
    for (const auto& [s, block] : samples_) {
      const double u = s.u - all.middle.u, w = s.w - all.middle.w;
      const double phi = std::atan2(w, u);
      seen[static_cast<std::size_t>(std::clamp((phi + kPi) / kPi * 6, 0.0, 11.0))] = true;
      sum += std::hypot(u, w);
      square += u * u + w * w;
    }
    const double mean = sum / static_cast<double>(size());
    const double variance = square / static_cast<double>(size()) - mean * mean;
    if (variance > kLargestScatter * kLargestScatter * mean * mean) return -1;
    return static_cast<int>(std::count(seen.begin(), seen.end(), true));
  }

  /// How far the middle of the signals is off zero, over their amplitude.
  double off_centre() const {
    const Extent all = extent();
    return std::max(std::abs(all.middle.u), std::abs(all.middle.w)) / all.amplitude;
  }

  /// Which blocks count: those that are fitted (even), held out (odd), or all.
  enum class Part { fitted, held_out, all };
  static bool in(Part part, std::size_t block) {
    return part == Part::all || (block % 2 == 0) == (part == Part::fitted);
  }

  std::optional<Numbers> fit(Numbers x, const Mask& free, Part part) const {
    for (int iteration = 0; iteration < 30; ++iteration) {
      Square normal = Square::Zero();
      Numbers right = Numbers::Zero();
      for (const Sample& s : samples_) {
        if (!in(part, s.block)) continue;
        const auto [row, distance] = linearised(x, free, s.signals);
        normal += row * row.transpose();
        right += row * distance;
      }
      for (int i = 0; i < kNumbers; ++i)
        if (!free[static_cast<std::size_t>(i)]) normal(i, i) = 1;
      const Numbers step = normal.ldlt().solve(right);
      if (!step.allFinite()) return std::nullopt;
      x += step;
      if (!(x[0] > 0) || x.tail<kNumbers - 1>().cwiseAbs().maxCoeff() > 0.7) return std::nullopt;
      if (step.cwiseAbs().maxCoeff() < 1e-10 * std::max(1.0, x[0])) break;
    }
    return x;
  }

  struct Remainder {
    double square = 0, count = 0;
    double rms() const { return count > 0 ? std::sqrt(square / count) : 0; }
  };
  Remainder remainder(const Numbers& x, Part part) const {
    Remainder r;
    const SignalCurve curve = curve_of(x);
    for (const Sample& s : samples_) {
      if (!in(part, s.block)) continue;
      const double d = foot_of(curve, s.signals).distance;
      r.square += d * d;
      ++r.count;
    }
    return r;
  }

  /// Samples per independent one: 1 + 2 sum of the residual's autocorrelation, less what repeats
  /// with the phase.
  double correlation_time(const Numbers& x) const {
    const std::vector<double> r = without_phase(x);
    double zero = 0;
    for (const double v : r) zero += v * v;
    double tau = 1;
    const std::size_t most = std::min<std::size_t>(1000, r.size() / kBlocks);
    for (std::size_t lag = 1; lag < most; ++lag) {
      double sum = 0;
      for (std::size_t k = lag; k < r.size(); ++k) sum += r[k] * r[k - lag];
      if (!(sum > 0.02 * zero)) break;
      tau += 2 * sum / zero;
    }
    return tau;
  }

  /// What a table over the phase, learnt on the fitted blocks, takes off the held-out sum.
  double phase_gain(const Numbers& x) const {
    std::array<double, kPhaseBins> sum{}, count{};
    const SignalCurve curve = curve_of(x);
    std::vector<std::pair<int, double>> held_out;
    for (const Sample& s : samples_) {
      const Foot foot = foot_of(curve, s.signals);
      const int bin = bin_of(foot.phi);
      if (in(Part::held_out, s.block)) {
        held_out.emplace_back(bin, foot.distance);
      } else {
        sum[static_cast<std::size_t>(bin)] += foot.distance;
        ++count[static_cast<std::size_t>(bin)];
      }
    }
    double gain = 0;
    for (const auto& [bin, d] : held_out) {
      const auto b = static_cast<std::size_t>(bin);
      const double mean = count[b] > 0 ? sum[b] / count[b] : 0;
      gain += d * d - (d - mean) * (d - mean);
    }
    return gain;
  }

  /// Half of the interval of 95 % of each number.
  Numbers half_intervals(const Numbers& x, const Mask& free) const {
    Square normal = Square::Zero();
    std::vector<Numbers> gradient(kBlocks, Numbers::Zero());
    for (const Sample& s : samples_) {
      const auto [row, distance] = linearised(x, free, s.signals);
      normal += row * row.transpose();
      gradient[s.block] += row * distance;
    }
    Square meat = Square::Zero();
    for (const Numbers& g : gradient) meat += g * g.transpose();
    meat *= static_cast<double>(kBlocks) / static_cast<double>(kBlocks - 1);
    for (int i = 0; i < kNumbers; ++i)
      if (!free[static_cast<std::size_t>(i)]) normal(i, i) = 1;
    const Square inverse = normal.inverse();
    const Square covariance = inverse * meat * inverse;
    return kStudent * covariance.diagonal().cwiseMax(0).cwiseSqrt();
  }

  /// Error of the angle that a module without correction reads [rad], rms about its mean.
  double reading_error(const Numbers& x) const {
    const SignalCurve curve = curve_of(x);
    double sum = 0, square = 0;
    constexpr int kPoints = 720;
    for (int i = 0; i < kPoints; ++i) {
      const double phi = 2 * kPi * i / kPoints;
      const SinCos s = curve.at(phi);
      const double e = std::remainder(std::atan2(s.w, s.u) - phi, 2 * kPi);
      sum += e;
      square += e * e;
    }
    const double mean = sum / kPoints;
    return std::sqrt(std::max(0.0, square / kPoints - mean * mean));
  }

 private:
  struct Extent {
    SinCos middle;
    double amplitude = 0;  ///< half of the larger swing
  };
  Extent extent() const {
    double u_low = HUGE_VAL, u_high = -HUGE_VAL, w_low = HUGE_VAL, w_high = -HUGE_VAL;
    for (const auto& [s, block] : samples_) {
      u_low = std::min(u_low, s.u), u_high = std::max(u_high, s.u);
      w_low = std::min(w_low, s.w), w_high = std::max(w_high, s.w);
    }
    return {{(u_low + u_high) / 2, (w_low + w_high) / 2},
            std::max(u_high - u_low, w_high - w_low) / 2};
  }

  /// A few samples far off the circle of all others.
  void leave_out_outliers() {
    if (samples_.empty()) return;
    const auto median = [](std::vector<double> v) {
      const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
      std::nth_element(v.begin(), middle, v.end());
      return *middle;
    };
    const auto radii = [&](double u, double w) {
      std::vector<double> r;
      for (const Sample& s : samples_) r.push_back(std::hypot(s.signals.u - u, s.signals.w - w));
      return r;
    };
    std::vector<double> u, w;
    for (const Sample& s : samples_) u.push_back(s.signals.u), w.push_back(s.signals.w);
    const std::vector<double> r = radii(median(u), median(w));
    const double usual = median(r);
    const auto far = [&](double radius) { return std::abs(radius - usual) > kFarRadius * usual; };
    outliers_ = static_cast<std::size_t>(std::count_if(r.begin(), r.end(), far));
    if (static_cast<double>(outliers_) > kMostOutliers * static_cast<double>(r.size()))
      outliers_ = 0;
    if (outliers_ == 0) return;
    std::size_t k = 0;
    std::erase_if(samples_, [&](const Sample&) { return far(r[k++]); });
  }

  /// Amplitude at each sample over its mean, by straight lines between parts of the record; empty:
  /// it passes too few periods to tell.
  std::vector<double> amplitude_levels() const {
    Mask everything;
    everything.fill(true);
    const Numbers first = fit(circle(), mask_of({}), Part::all).value_or(circle());
    const SignalCurve curve = curve_of(fit(first, everything, Part::all).value_or(first));
    std::vector<Foot> feet;
    double passed = 0;
    for (const Sample& s : samples_) {
      feet.push_back(foot_of(curve, s.signals));
      if (feet.size() > 1)
        passed += std::abs(std::remainder(feet.back().phi - feet[feet.size() - 2].phi, 2 * kPi));
    }
    const std::size_t n = feet.size(),
                      parts = std::min(kMostParts,
                                       static_cast<std::size_t>(passed / (2 * kPi * kPartPeriods)));
    if (parts < 3) return {};
    std::vector<std::pair<double, double>> levels;  // middle of a part, its level
    for (std::size_t p = 0; p < parts; ++p) {
      const std::size_t begin = p * n / parts, end = (p + 1) * n / parts;
      std::array<double, kPhaseBins> sum{}, count{};
      for (std::size_t k = begin; k < end; ++k) {
        const auto bin = static_cast<std::size_t>(bin_of(feet[k].phi));
        sum[bin] += feet[k].distance, ++count[bin];
      }
      if (std::count(count.begin(), count.end(), 0.0) > 0) continue;  // not a whole period
      double mean = 0;
      for (std::size_t b = 0; b < count.size(); ++b) mean += sum[b] / count[b] / kPhaseBins;
      levels.emplace_back(static_cast<double>(begin + end - 1) / 2, 1 + mean / curve.amplitude);
    }
    if (levels.size() < 3) return {};
    std::vector<double> result;
    std::size_t i = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const auto at = static_cast<double>(k);
      while (i + 2 < levels.size() && at > levels[i + 1].first) ++i;
      const auto [x, y] = levels[i];
      const auto [x_next, y_next] = levels[i + 1];
      result.push_back(std::lerp(y, y_next, std::clamp((at - x) / (x_next - x), 0.0, 1.0)));
    }
    return result;
  }

  static int bin_of(double phi) {
    const double turn = phi / (2 * kPi) - std::floor(phi / (2 * kPi));
    return std::min(kPhaseBins - 1, static_cast<int>(turn * kPhaseBins));
  }

  std::vector<double> without_phase(const Numbers& x) const {
    const SignalCurve curve = curve_of(x);
    std::vector<double> r;
    std::vector<int> bins;
    std::array<double, kPhaseBins> sum{}, count{};
    for (const Sample& s : samples_) {
      const Foot foot = foot_of(curve, s.signals);
      r.push_back(foot.distance);
      bins.push_back(bin_of(foot.phi));
      sum[static_cast<std::size_t>(bins.back())] += foot.distance;
      ++count[static_cast<std::size_t>(bins.back())];
    }
    for (std::size_t k = 0; k < r.size(); ++k) {
      const auto b = static_cast<std::size_t>(bins[k]);
      r[k] -= sum[b] / count[b];
    }
    return r;
  }

  static std::pair<Numbers, double> linearised(const Numbers& x, const Mask& free,
                                               const SinCos& s) {
    const SignalCurve curve = curve_of(x);
    const Foot foot = foot_of(curve, s);
    const SinCos at = curve.at(foot.phi);
    Numbers row = Numbers::Zero();
    constexpr double kStep = 1e-6;
    for (int i = 0; i < kNumbers; ++i) {
      if (!free[static_cast<std::size_t>(i)]) continue;
      Numbers y = x;
      y[i] += kStep;
      const SinCos moved = curve_of(y).at(foot.phi);
      row[i] = foot.normal.dot(Eigen::Vector2d(moved.u - at.u, moved.w - at.w)) / kStep;
    }
    return {row, foot.distance};
  }

  std::vector<Sample> samples_;
  std::size_t outliers_ = 0;
};

using Part = ChannelFit::Part;

/// Effects of one channel in the order in which they were found, and what they leave.
struct ChannelResult {
  std::vector<std::size_t> effects;
  std::vector<double> gains;
  Numbers circle, found;
  double noise = 0;      ///< variance of the distance, per independent sample
  double remaining = 0;  ///< held-out chi-square that repeats with the phase
  std::vector<Rung> ladder;
};

ChannelResult select(const ChannelFit& data) {
  ChannelResult result;
  const std::vector<std::size_t> everything{0, 1, 2, 3};
  result.circle = data.fit(data.circle(), mask_of({}), Part::fitted).value_or(data.circle());
  const Numbers all =
      data.fit(result.circle, mask_of(everything), Part::fitted).value_or(result.circle);
  const ChannelFit::Remainder floor = data.remainder(all, Part::held_out);
  result.noise = std::max(1e-300, floor.square / floor.count) * data.correlation_time(all);
  Numbers now = result.circle;
  double square = data.remainder(now, Part::held_out).square;
  result.ladder.push_back({"", square / result.noise, {data.remainder(now, Part::held_out).rms()}});
  while (result.effects.size() < everything.size()) {
    std::optional<std::size_t> best;
    Numbers best_numbers = now;
    double best_square = square;
    for (const std::size_t e : everything) {
      if (std::count(result.effects.begin(), result.effects.end(), e) > 0) continue;
      std::vector<std::size_t> with = result.effects;
      with.push_back(e);
      const auto x = data.fit(now, mask_of(with), Part::fitted);
      if (!x) continue;
      const double left = data.remainder(*x, Part::held_out).square;
      if (left < best_square) best = e, best_square = left, best_numbers = *x;
    }
    if (!best || (square - best_square) / result.noise < kLeastGain) break;
    result.effects.push_back(*best);
    result.gains.push_back((square - best_square) / result.noise);
    now = best_numbers;
    square = best_square;
    result.ladder.push_back({signal_effects()[*best].name,
                             square / result.noise,
                             {data.remainder(now, Part::held_out).rms()}});
  }
  result.remaining = std::max(0.0, data.phase_gain(now) / result.noise);
  result.found = data.fit(now, mask_of(result.effects), Part::all).value_or(now);
  return result;
}

constexpr char kComponent[] = "xyz";

void tell(const ChannelFit& data, const ChannelResult& r, std::size_t channel, Diagnosis& d) {
  const Mask free = mask_of(r.effects);
  const Numbers half = data.half_intervals(r.found, free);
  const double metres = d.declared.probe.signal_period / (2 * kPi);
  for (std::size_t i = 0; i < r.effects.size(); ++i) {
    const SignalEffect& effect = signal_effects()[r.effects[i]];
    FoundEffect found;
    found.name = effect.name;
    found.place = "probe";
    found.gain = r.gains[i];
    found.acquisition = true;
    Numbers without = r.found;
    for (std::size_t k = 0; k < effect.numbers.size(); ++k) {
      const int number = effect.numbers[k];
      const double value = r.found[number];
      without[number] = 0;
      const std::string key =
          fmt::format("effects.probe.{}.{}.{}", effect.name, effect.keys[k], kComponent[channel]);
      found.numbers.push_back({key, in_key_unit(number, value),
                               in_key_unit(number, value - half[number]),
                               in_key_unit(number, value + half[number])});
      set_parameter(d.found, key, in_key_unit(number, value));
    }
    found.contour_error_um =
        (data.reading_error(r.found) - data.reading_error(without)) * metres * 1e6;
    d.effects.push_back(std::move(found));
  }
  for (const auto& [part, run] :
       {std::pair(Part::fitted, "fitted blocks"), {Part::held_out, "held-out blocks"}}) {
    const double after = data.remainder(r.found, part).rms();
    d.figures.push_back(
        {.channel = {SignalKind::cosine, channel},
         .run = run,
         .before = data.remainder(r.circle, part).rms(),
         .after = after,
         .floor = std::sqrt(std::max(
             0.0, after * after - r.remaining * r.noise /
                                      std::max(1.0, data.remainder(r.found, part).count)))});
  }
  d.ladder.insert(d.ladder.end(), r.ladder.begin(), r.ladder.end());
}

}  // namespace

SinCos SignalCurve::at(double phi) const {
  const double c = std::cos(phi), s = std::sin(phi);
  const double c2 = c * c - s * s, c3 = c * (c * c - 3 * s * s), s3 = s * (3 * c * c - s * s);
  const double u = c + second * c2 + third * c3;
  const double w = s - second * c2 - third * s3;
  return {amplitude * (u + cosine_offset),
          amplitude * ((1 + gain) * (std::cos(angle) * w - std::sin(angle) * u) + sine_offset)};
}

bool is_bare_encoder(const Record& record) {
  bool raw = false;
  for (const MeasuredSignal& s : record.signals) {
    if (is_compared(s.kind) || s.kind == SignalKind::command) return false;
    raw = raw || s.kind == SignalKind::cosine;
  }
  return raw;
}

Diagnosis diagnose_quadrature(const Record& record, const Machine& declared) {
  Diagnosis d;
  d.declared = d.found = declared;
  d.warnings = record.warnings;
  double explained = 0, remaining = 0;
  std::size_t channels = 0;
  for (const MeasuredSignal& cosine : record.signals) {
    if (cosine.kind != SignalKind::cosine || cosine.axis > 2) continue;
    const MeasuredSignal* sine = record.find(SignalKind::sine, cosine.axis);
    if (!sine) continue;
    const char name = kComponent[cosine.axis];
    if (const auto lag = sine_lag(cosine.value, sine->value)) {
      d.warnings.push_back(fmt::format(
          "channel {}: the {} comes {} samples ({:.3g} ms) after the {}, as a phase in proportion "
          "to the speed says; shifted by that, {:.0f} % of what is off an ellipse is left. Put the "
          "two columns on one time",
          name, lag->samples > 0 ? "sine" : "cosine", std::abs(lag->samples),
          1e3 * static_cast<double>(std::abs(lag->samples)) * record.period,
          lag->samples > 0 ? "cosine" : "sine", 100 * lag->left));
      continue;
    }
    ChannelFit data(cosine, *sine);
    if (data.size() < kFewest) {
      d.warnings.push_back(fmt::format("channel {}: {} samples are too few, {} are needed", name,
                                       data.size(), kFewest));
      continue;
    }
    const int sectors = data.sectors();
    if (sectors < 0) {
      d.warnings.push_back(
          fmt::format("channel {}: sine and cosine do not draw a circle (noise at rest, less than "
                      "a period, the same signal twice, or signals that are none of an encoder)",
                      name));
      continue;
    }
    if (sectors < 12) {
      d.warnings.push_back(fmt::format(
          "channel {}: the samples lie in {} of 12 sectors of the signals' period only; the "
          "encoder must move by a period and more, at changing speed where few samples fall in a "
          "period",
          name, sectors));
      continue;
    }
    if (const double off = data.off_centre(); off > kOffCentre) {
      d.warnings.push_back(
          fmt::format("channel {}: the signals swing about {:.3g} of their amplitude, not about "
                      "zero; give their offset in the map (si = (sign scale value + offset) unit)",
                      name, off));
      continue;
    }
    ++channels;
    if (data.outliers() > 0)
      d.warnings.push_back(fmt::format(
          "channel {}: {} samples lie far off all others and are left out", name, data.outliers()));
    if (const double share = data.level_amplitude(); share > kToldAmplitude)
      d.notes.push_back(fmt::format(
          "channel {}: the amplitude changes by +-{:.2g} % along the record; that is taken out.",
          name, 100 * share));
    const ChannelResult result = select(data);
    tell(data, result, cosine.axis, d);
    for (const double gain : result.gains) explained += gain;
    if (result.remaining > kLeastGain) {
      remaining += result.remaining;
      d.warnings.push_back(fmt::format(
          "channel {}: a residual that repeats with the phase is left (chi-square {:.0f}); the "
          "signals have harmonics above the third or another shape",
          name, result.remaining));
    }
  }
  d.notes.push_back(
      "Signals alone: a common delay, the length of the period and errors of more than a period "
      "cannot be seen in them.");
  for (const FoundEffect& e : d.effects)
    if (e.name == "signal_harmonics")
      d.notes.push_back(
          "A fifth harmonic draws nearly the curve of a third one of the same size; signals alone "
          "cannot tell them apart.");
  const double all = explained + remaining;
  d.explained_share = all > 0 ? explained / all : 1;
  if (channels == 0)
    d.verdict = DiagnosisVerdict::not_identifiable;
  else if (d.effects.empty())
    d.verdict = remaining > 0 ? DiagnosisVerdict::unexplained : DiagnosisVerdict::no_deviation;
  else
    d.verdict = remaining > 0 ? DiagnosisVerdict::partly : DiagnosisVerdict::explained;
  std::stable_sort(d.effects.begin(), d.effects.end(), [](const auto& a, const auto& b) {
    return a.contour_error_um > b.contour_error_um;
  });
  return d;
}

}  // namespace vcnc
