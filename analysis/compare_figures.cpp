#include "analysis/compare_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/figure_style.hpp"

namespace vcnc {
namespace {

using namespace figure_style;

Envelope envelope_of(const Curve& curve, double length) {
  Envelope e(0, length, 1200);
  for (std::size_t i = 0; i < curve.size(); ++i) e.add(curve.x[i], curve.y[i]);
  return e;
}

double most_of(const Envelope& e) {
  double most = 0;
  for (const Envelope::Point& p : e.points()) most = std::max(most, std::abs(p.y));
  return most;
}

std::string range_to(double most) {
  const double r = std::max(most, 0.05);
  return fmt::format("set yrange [{:.6g}:{:.6g}]\n", -1.15 * r, 1.35 * r);
}

}  // namespace

std::string compared_error_figure(const Comparison& c) {
  double length = 1e-3;
  for (const Curve* curve : {&c.a.profile, &c.b.profile})
    if (curve->size() > 0) length = std::max(length, curve->x.back());
  const Envelope a = envelope_of(c.a.profile, length), b = envelope_of(c.b.profile, length);
  const bool both = c.same_line && c.e_n_difference.size() > 0;
  std::string text =
      heading(900, both ? 520 : 300) + block("a", a, 1e3, 1e6) + block("b", b, 1e3, 1e6);
  text += fmt::format("set multiplot\nset xrange [0:{:.6g}]\n", length * 1e3);
  text += margins(both ? 0.53 : 0.17, 0.95) + range_to(std::max(most_of(a), most_of(b)) * 1e6) +
          "set ylabel 'e_n  [µm]' offset 0.5\n";
  text += both ? "set format x ''\n" : "set xlabel 'station on the path  s  [mm]'\n";
  text += "plot " + line("a", "A", kInk, 1.3) + ", " + line("b", "B", kOrange, 1.3) + "\n";
  if (both) {
    const Envelope d = envelope_of(c.e_n_difference, length);
    text += block("d", d, 1e3, 1e6) + margins(0.14, 0.48) + range_to(most_of(d) * 1e6) +
            "set format x '%g'\nset xlabel 'station on the path  s  [mm]'\n"
            "set ylabel 'difference  [µm]' offset 0.5\nplot " +
            line("d", "e_n of B - e_n of A", kGreen, 1.3) + "\n";
  }
  return text + "unset multiplot\n";
}

std::string compared_following_figure(const Comparison& c) {
  std::string text = heading(900, 760) + "set multiplot\n";
  const double length = std::max({c.a.seconds, c.b.seconds, 1e-3});
  text += fmt::format("set xrange [0:{:.6g}]\nset key at graph 1,graph 1.3 noopaque\n", length);
  constexpr double kTop = 0.96, kBottom = 0.085;
  constexpr double kHeight = (kTop - kBottom) / static_cast<double>(kAxisCount);
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    const double scale = is_rotary(j) ? 3600 / kDegree : 1e6;
    const double top = kTop - static_cast<double>(j) * kHeight;
    const std::string a = fmt::format("a{}", j), b = fmt::format("b{}", j);
    text += block(a, c.a.following[j], 1, scale) + block(b, c.b.following[j], 1, scale) +
            margins(top - 0.88 * kHeight, top) +
            range_to(std::max(most_of(c.a.following[j]), most_of(c.b.following[j])) * scale) +
            fmt::format("set ylabel '{} [{}]' offset 0.5\nset ytics autofreq nomirror\n",
                        kAxisNames[j], is_rotary(j) ? "arcsec" : "µm");
    text +=
        j + 1 < kAxisCount ? "set format x ''\n" : "set format x '%g'\nset xlabel 'time  [s]'\n";
    text += "plot " + line(a.c_str(), j == 0 ? "A" : "", kInk) + ", " +
            line(b.c_str(), j == 0 ? "B" : "", kOrange) + "\n";
  }
  return text + "unset multiplot\n";
}

}  // namespace vcnc
