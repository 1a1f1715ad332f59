#include "diagnosis/search/trial_values.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "diagnosis/search/parallel.hpp"
#include "model/axes.hpp"
#include "model/fields.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

bool ends(const std::string& text, const char* end) { return text.ends_with(end); }
bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

/// Axis whose letter is the place of a candidate; kAxisCount: none.
std::size_t axis_of(const Candidate& c) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (c.place == kAxisNames[i]) return i;
  return kAxisCount;
}

double si_of_unit(const std::string& key) {
  if (ends(key, "_mm")) return unit::mm.to_si;
  if (ends(key, "_um")) return unit::um.to_si;
  if (ends(key, "_deg")) return unit::deg.to_si;
  if (ends(key, "_arcsec")) return unit::arcsec.to_si;
  return 1;
}

}  // namespace

double line_power(const std::vector<double>& position, const std::vector<double>& z, double w) {
  double ss = 0, cc = 0, sc = 0, zs = 0, zc = 0;
  for (std::size_t k = 0; k < z.size(); ++k) {
    const double angle = 2 * kPi / w * position[k];
    const double s = std::sin(angle), c = std::cos(angle);
    ss += s * s, cc += c * c, sc += s * c, zs += z[k] * s, zc += z[k] * c;
  }
  const double det = ss * cc - sc * sc;
  if (det <= 1e-9 * ss * cc) return 0;
  return (zs * zs * cc - 2 * zs * zc * sc + zc * zc * ss) / det;
}

TrialValuesOf::TrialValuesOf(const Evidence& evidence, const Machine& machine,
                             const Column& residual)
    : evidence_(evidence),
      duration_(static_cast<double>(evidence.record().samples()) * evidence.record().period),
      wavelengths_(kAxisCount),
      jump_(find_jump(residual)),
      ringing_(find_ringing(residual)) {
  for (const AxisParams& axis : machine.axes)
    travel_per_turn_.push_back(axis.mechanics.travel_per_turn);
  parallel_for(kAxisCount,
               [&](std::size_t axis) { wavelengths_[axis] = find_wavelengths(axis, residual); });
}

std::vector<double> TrialValuesOf::find_wavelengths(std::size_t axis,
                                                    const Column& residual) const {
  const Record& record = evidence_.record();
  const MeasuredSignal* command = record.find(SignalKind::command, axis);
  if (!command) return {};
  const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
  const double travel = *high - *low;
  if (!(travel > 0)) return {};

  struct Line {
    double wavelength, power;
  };
  std::vector<Line> lines;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    const ComparedChannel& channel = evidence_.replica().channels()[c];
    if (channel.kind != SignalKind::deflection && channel.axis != axis) continue;
    if (residual[c].empty()) continue;
    std::vector<double> position, z;
    // About 3000 samples at irregular intervals, so that short waves are not taken for long ones.
    const double share = 3000 / static_cast<double>(residual[c].size() + 1);
    constexpr double kGolden = 0.6180339887498949;
    for (const Block& block : evidence_.partition().blocks) {
      if (block.held_out) continue;
      for (std::size_t k = block.begin; k < block.end; ++k) {
        const double turn = kGolden * static_cast<double>(k);
        if (turn - std::floor(turn) > share) continue;
        position.push_back(command->value[k]);
        z.push_back(static_cast<double>(residual[c][k]));
      }
    }
    // Spatial frequencies half a bin apart, up to where a wave is 1/200 of the travel.
    std::vector<Line> spectrum;
    for (double waves = 1.5; waves < 200; waves += 0.5)
      spectrum.push_back({travel / waves, line_power(position, z, travel / waves)});
    for (std::size_t i = 1; i + 1 < spectrum.size(); ++i)
      if (spectrum[i].power >= spectrum[i - 1].power && spectrum[i].power > spectrum[i + 1].power)
        lines.push_back(spectrum[i]);
  }
  std::sort(lines.begin(), lines.end(),
            [](const Line& x, const Line& y) { return x.power > y.power; });
  std::vector<double> best;
  for (const Line& line : lines) {
    const bool known = std::any_of(best.begin(), best.end(), [&](double w) {
      return std::abs(travel / w - travel / line.wavelength) < 0.75;
    });
    if (!known) best.push_back(line.wavelength);
    if (best.size() == 3) break;
  }
  return best;
}

double TrialValuesOf::largest_reading() const {
  double largest = 0;
  for (const ComparedChannel& c : evidence_.replica().channels()) {
    if (c.kind != SignalKind::deflection) continue;
    for (const double value : evidence_.record().find(c.kind, c.axis)->value)
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

double TrialValuesOf::find_jump(const Column& residual) const {
  const std::size_t window = 50;
  double largest = 0, at = 0;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    if (evidence_.replica().channels()[c].kind != SignalKind::deflection) continue;
    const std::vector<float>& z = residual[c];
    double before = 0, after = 0;
    for (std::size_t k = 0; k + window < z.size(); ++k) {
      after += static_cast<double>(z[k + window]) - static_cast<double>(z[k]);
      if (k >= window) before += static_cast<double>(z[k]) - static_cast<double>(z[k - window]);
      if (std::abs(after - before) <= largest) continue;
      largest = std::abs(after - before);
      at = static_cast<double>(k) * evidence_.record().period;
    }
  }
  return at + evidence_.record().begin;
}

/// Peaks of the periodogram over the median around them; blocks of the fitted laps, Hann's window.
std::vector<double> TrialValuesOf::find_ringing(const Column& residual) const {
  constexpr double kLowest = 8, kHighest = 200, kStep = 1;  // [Hz]
  constexpr std::size_t kBeside = 12, kMost = 3;
  constexpr double kStandsOut = 3;
  std::vector<double> power(static_cast<std::size_t>((kHighest - kLowest) / kStep) + 1, 0.0);
  parallel_for(power.size(), [&](std::size_t i) {
    const double w =
        2 * kPi * (kLowest + kStep * static_cast<double>(i)) * evidence_.record().period;
    for (std::size_t c = 0; c < residual.size(); ++c) {
      const std::vector<float>& z = residual[c];
      if (evidence_.replica().channels()[c].kind != SignalKind::deflection || z.empty()) continue;
      for (const Block& block : evidence_.partition().blocks) {
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
  const std::size_t axis = axis_of(candidate);
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
    for (const NoiseLine& line : evidence_.noise().lines) more({line.frequency});
    more(ringing_);
  } else if (contains(n.key, ".time_constant_s")) {
    values.clear();
    for (const double share : {0.1, 0.3, 1.0, 3.0}) more({share * duration_});
  } else if (contains(n.key, ".period_s")) {
    values.clear();
    // A quarter of a wave in the run's length apart: further off the phase is lost at its end.
    for (double waves = 0.5; waves <= 5; waves += 0.25) more({duration_ / waves});
  } else if (axis < kAxisCount && (contains(n.key, ".period_") || contains(n.key, "pitch_") ||
                                   contains(n.key, ".wavelength_"))) {
    for (const double w : wavelengths_[axis]) more({w / si_of_unit(n.key)});
  } else if (axis < kAxisCount && contains(n.key, ".centre_")) {
    const MeasuredSignal* command = evidence_.record().find(SignalKind::command, axis);
    if (!command) return values;
    const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
    values.clear();
    for (int i = 0; i < 8; ++i) more({(*low + (*high - *low) * (i + 0.5) / 8) / si_of_unit(n.key)});
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
