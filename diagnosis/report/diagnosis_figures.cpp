#include "diagnosis/report/diagnosis_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/figure_style.hpp"
#include "diagnosis/report/shown_law.hpp"
#include "model/axes.hpp"

namespace vcnc {

namespace {

using namespace figure_style;

constexpr int kBins = 30;
/// Lower edge of a plot 300 high: with less room gnuplot leaves out what its axis is.
constexpr double kUnder = 0.21;
constexpr double kBesideJump_s = 2;  // shown on both sides of a law that jumps
/// In the unit shown: less is nothing, and its numbers would have no room.
constexpr double kNothingToSee = 1e-3;

/// By the time since the record began: a clock may tell that of 1970.
Envelope envelope_of(const std::vector<double>& value, double period) {
  Envelope e(0, static_cast<double>(value.size()) * period, 1200);
  for (std::size_t k = 0; k < value.size(); ++k)
    if (std::isfinite(value[k])) e.add(static_cast<double>(k) * period, value[k]);
  return e;
}

double reach(const Envelope& e) {
  double most = 0;
  for (const Envelope::Point& p : e.points())
    if (std::isfinite(p.y)) most = std::max(most, std::abs(p.y));
  return most;
}

std::vector<double> derivative(const std::vector<double>& value, double period, std::size_t half) {
  std::vector<double> result(value.size(), kMissing);
  for (std::size_t k = half; k + half < value.size(); ++k)
    result[k] = (value[k + half] - value[k - half]) / (2 * static_cast<double>(half) * period);
  return result;
}

struct BinnedMeans {
  std::array<double, 2 * kBins> sum{}, square{}, count{}, at{};
  double low = 0, high = 0;
};

/// Bins of equal width between the extremes; the second half for motion in the other direction.
BinnedMeans binned(const RelatedQuantity& x, const std::vector<double>& y) {
  BinnedMeans b{.low = HUGE_VAL, .high = -HUGE_VAL};
  for (std::size_t k = 0; k < y.size(); ++k)
    if (std::isfinite(x.value[k]) && std::isfinite(y[k]))
      b.low = std::min(b.low, x.value[k]), b.high = std::max(b.high, x.value[k]);
  if (!(b.high > b.low)) return b;
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (!(std::isfinite(x.value[k]) && std::isfinite(y[k]))) continue;
    const double share = (x.value[k] - b.low) / (b.high - b.low);
    auto bin = static_cast<std::size_t>(std::clamp(share * kBins, 0.0, kBins - 1.0));
    if (!x.speed.empty() && x.speed[k] < 0) bin += kBins;
    b.sum[bin] += y[k];
    b.square[bin] += y[k] * y[k];
    b.at[bin] += x.value[k];
    ++b.count[bin];
  }
  return b;
}

std::string means_block(const char* name, const BinnedMeans& b, std::size_t first, double scale) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (std::size_t i = first; i < first + kBins; ++i)
    if (b.count[i] >= 5)
      text += fmt::format("{:.6g} {:.6g}\n", b.at[i] / b.count[i], b.sum[i] / b.count[i] * scale);
  return text + "EOD\n";
}

bool has_means(const BinnedMeans& b, std::size_t first) {
  return std::any_of(b.count.begin() + static_cast<std::ptrdiff_t>(first),
                     b.count.begin() + static_cast<std::ptrdiff_t>(first) + kBins,
                     [](double n) { return n >= 5; });
}

std::string quoted_label(std::string text) {
  std::replace(text.begin(), text.end(), '\'', ' ');
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string time_label(const Record& record) {
  return record.begin == 0 ? "time  [s]" : fmt::format("time since {:.3f} s  [s]", record.begin);
}

}  // namespace

std::string residual_figure(const Record& record, const ModelResiduals& residuals,
                            const std::vector<std::size_t>& channels) {
  const auto rows = static_cast<double>(channels.size());
  std::string text = heading(900, 110 + 150 * static_cast<int>(channels.size())) +
                     "set multiplot\n" +
                     fmt::format(
                         "set xrange [{:.9g}:{:.9g}]\nset key at graph 1,graph 1.25 "
                         "noopaque\n",
                         0.0, static_cast<double>(record.samples()) * record.period);
  const double top = 1 - 0.3 / (rows + 0.7), bottom = 0.4 / (rows + 0.7);
  const double height = (top - bottom) / rows;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::size_t c = channels[i];
    const ShownUnit unit = shown_unit(residuals.channels[c]);
    const Envelope before = envelope_of(residuals.before[c], record.period);
    const Envelope after = envelope_of(residuals.after[c], record.period);
    const std::string b = fmt::format("b{}", i), a = fmt::format("a{}", i);
    const double most = std::max(reach(before), reach(after)) * unit.factor;
    const double shown = most > kNothingToSee ? 1.1 * most : 1;
    const double upper = top - static_cast<double>(i) * height;
    text += block(b, before, 1, unit.factor) + block(a, after, 1, unit.factor) +
            margins(upper - 0.8 * height, upper) +
            fmt::format("set yrange [{:.6g}:{:.6g}]\n", -shown, shown) +
            // gnuplot leaves a ylabel out beside long numbers.
            fmt::format("set label 1 '{} [{}]' at screen 0.018,graph 0.5 rotate center\n",
                        channel_name(residuals.channels[c]), unit.name);
    text += i + 1 < channels.size()
                ? "set format x ''\nset xlabel ''\n"
                : "set format x '%g'\nset xlabel '" + time_label(record) + "'\n";
    text += "plot " + line(b.c_str(), i == 0 ? "before" : "", kOrange) + ", " +
            line(a.c_str(), i == 0 ? "after" : "", kInk) + "\n";
  }
  return text + "unset multiplot\n";
}

std::vector<RelatedQuantity> related_quantities(const Record& record) {
  std::vector<RelatedQuantity> all;
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(2e-3 / record.period)));
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const MeasuredSignal* s = record.find(SignalKind::command, axis);
    if (!s) s = record.find(SignalKind::position, axis);
    if (!s) continue;
    const bool rotary = is_rotary(axis);
    const double scale = rotary ? 1 / kDegree : 1e3;
    std::vector<double> q = s->value;
    for (double& v : q) v *= scale;
    const std::vector<double> v = derivative(q, record.period, half);
    double fastest = 0;
    for (const double x : v)
      if (std::isfinite(x)) fastest = std::max(fastest, std::abs(x));
    if (!(fastest > 0)) continue;
    const std::string name(kAxisNames[axis]);
    all.push_back({"position " + name, rotary ? "deg" : "mm", q, v});
    all.push_back({"speed " + name, rotary ? "deg/s" : "mm/s", v, {}});
    all.push_back({"acceleration " + name,
                   rotary ? "deg/s^2" : "mm/s^2",
                   derivative(v, record.period, half),
                   {}});
  }
  RelatedQuantity time{.name = "time", .unit = "s", .value = {}, .speed = {}};
  for (std::size_t k = 0; k < record.samples(); ++k)
    time.value.push_back(static_cast<double>(k) * record.period);
  all.push_back(std::move(time));
  return all;
}

double explained_by(const RelatedQuantity& covariate, const std::vector<double>& residual) {
  const BinnedMeans b = binned(covariate, residual);
  double sum = 0, square = 0, count = 0, between = 0, bins = 0;
  for (std::size_t i = 0; i < b.count.size(); ++i) {
    sum += b.sum[i], square += b.square[i], count += b.count[i];
    if (b.count[i] > 0) between += b.sum[i] * b.sum[i] / b.count[i], ++bins;
  }
  if (count < 10 * bins || !(count > 0)) return 0;
  const double variance = square - sum * sum / count;
  if (!(variance > 0)) return 0;
  return std::max(0.0, (between - sum * sum / count) / variance - bins / count);
}

std::string correlation_figure(const RelatedQuantity& covariate, const ComparedChannel& channel,
                               const std::vector<double>& before,
                               const std::vector<double>& after) {
  const ShownUnit unit = shown_unit(channel);
  const BinnedMeans b = binned(covariate, before), a = binned(covariate, after);
  std::string text =
      heading(900, 300) + margins(kUnder, 0.88) + "set key at graph 1,graph 1.17 noopaque\n" +
      means_block("up", b, 0, unit.factor) + means_block("down", b, kBins, unit.factor) +
      means_block("after_up", a, 0, unit.factor) +
      means_block("after_down", a, kBins, unit.factor) +
      fmt::format("set xlabel '{} [{}]'\nset ylabel '{} [{}]' offset 0.5\n",
                  quoted_label(covariate.name), covariate.unit, channel_name(channel), unit.name);
  const bool directions = !covariate.speed.empty();
  std::string plot;
  const auto add = [&](const BinnedMeans& of, std::size_t first, const char* name,
                       const char* title, const char* colour, const char* mark) {
    if (!has_means(of, first)) return;
    plot += fmt::format("{}${} using 1:2 with linespoints lc rgb '{}' pt {} ps 0.6 lw 1.3 {}",
                        plot.empty() ? "" : ", ", name, colour, mark,
                        *title ? fmt::format("title '{}'", title) : "notitle");
  };
  add(b, 0, "up", directions ? "before, forwards" : "before", kOrange, "7");
  add(b, kBins, "down", "before, backwards", kRed, "6");
  add(a, 0, "after_up", directions ? "after, forwards" : "after", kInk, "7");
  add(a, kBins, "after_down", "after, backwards", kGreen, "6");
  return plot.empty() ? text + "plot 0 notitle\n" : text + "plot " + plot + "\n";
}

std::string law_figure(const LearnedLaw& learned) {
  const Law& law = learned.law;
  const Shown x = shown_covariate(law.over, is_rotary(static_cast<std::size_t>(law.over_axis)));
  const Shown y = shown_value(law);
  std::string text = heading(900, 300) + margins(kUnder, 0.88) +
                     "set key at graph 1,graph 1.17 noopaque\n$law << EOD\n";
  const auto point = [&](double at, std::size_t i) {
    text += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", at * x.factor, law.value[i] * y.factor,
                        learned.low[i] * y.factor, learned.high[i] * y.factor);
  };
  if (law.jumps()) point(law.at.front() - kBesideJump_s, 0);
  for (std::size_t i = 0; i < law.at.size(); ++i) point(law.at[i], i);
  if (law.jumps()) point(law.at.back() + kBesideJump_s, law.at.size() - 1);
  const std::string of =
      law.over == Covariate::time
          ? std::string()
          : fmt::format(" of {}", kAxisNames[static_cast<std::size_t>(law.over_axis)]);
  return text +
         fmt::format("EOD\nset xlabel '{}{}  [{}]'\nset ylabel 'f  [{}]' offset 0.5\n", x.name, of,
                     x.unit, y.unit) +
         fmt::format(
             "plot $law using 1:3:4 with filledcurves lc rgb '{}' fs transparent solid 0.3 "
             "title '95 %', $law using 1:2 with linespoints lc rgb '{}' pt 7 ps 0.6 lw 1.3 "
             "notitle\n",
             kOrange, kInk);
}

std::string ladder_figure(const std::vector<Rung>& ladder) {
  std::string text = heading(900, 90 + 30 * static_cast<int>(ladder.size())) +
                     margins(0.5 / (static_cast<double>(ladder.size()) + 2), 0.95, 0.32) +
                     "$ladder << EOD\n";
  double most = 0, least = HUGE_VAL;
  for (std::size_t i = 0; i < ladder.size(); ++i) {
    text += fmt::format("\"{}\" {:.6g} {}\n", i == 0 ? "declared machine" : "+ " + ladder[i].added,
                        std::max(ladder[i].chi2, 1e-3), i);
    most = std::max(most, ladder[i].chi2);
    least = std::min(least, std::max(ladder[i].chi2, 1e-3));
  }
  text += "EOD\nset style fill solid 0.85 noborder\nset boxwidth 0.6\n";
  const double from = least / 3;
  text += fmt::format("set logscale x\nset yrange [{:.1f}:-0.6]\nset xrange [{:.6g}:{:.6g}]\n",
                      static_cast<double>(ladder.size()) - 0.4, from, std::max(most, least) * 1.5);
  text += "set xlabel 'chi-square of what was held out'\n";
  text += fmt::format(
      "plot $ladder using 2:3:({:.6g}):2:($3-0.3):($3+0.3):ytic(1) with boxxyerror lc rgb '{}' "
      "notitle\n",
      from, kInk);
  return text;
}

}  // namespace vcnc
