#include "analysis/gallery_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "analysis/figure_style.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

using namespace figure_style;

constexpr std::array<const char*, 4> kColours{kInk, kOrange, kGreen, kViolet};
constexpr const char* kPale = "#b4bac3";
constexpr std::size_t kThin = 360;  ///< buckets along the abscissa

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool empty() const { return low > high; }
};

Extent extent_of(const std::vector<Curve>& curves, bool abscissa) {
  Extent e;
  for (const Curve& curve : curves)
    for (const double value : abscissa ? curve.x : curve.y) e.add(value);
  return e;
}

std::vector<Envelope::Point> thinned(const Curve& curve, const Extent& x) {
  Envelope envelope(x.low, x.high, kThin);
  for (std::size_t i = 0; i < curve.size(); ++i) envelope.add(curve.x[i], curve.y[i]);
  return envelope.points();
}

std::string data(const std::string& name, const std::vector<Envelope::Point>& points,
                 const GalleryFigure& f) {
  std::string text = fmt::format("${} << EOD\n", name);
  bool any = false;
  for (const Envelope::Point& p : points) {
    if (p.starts && any) text += "\n";
    text += fmt::format("{:.6g} {:.6g}\n", p.x * f.x_scale, p.y * f.y_scale);
    any = true;
  }
  return text + (any ? "EOD\n" : "NaN NaN\nEOD\n");
}

/// 1, 2 or 5 times a power of ten, at least x.
double round_up(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x)));
  for (const double f : {1.0, 2.0, 5.0})
    if (f * power >= x * (1 - 1e-9)) return f * power;
  return 10 * power;
}

const char* colour_of(std::size_t i) { return kColours[i % kColours.size()]; }

/// Deviations from a circle, magnified, as they are shown of a circular test.
std::string polar(const GalleryFigure& f) {
  double most = 0;
  for (const auto* curves : {&f.without, &f.with})
    for (const Curve& curve : *curves) most = std::max(most, max_abs(curve));
  const double ring = round_up(std::max(most * f.y_scale, 1e-3) / 2);  // one ring of the scale
  const double per_unit = 0.2 / ring;
  std::string text;
  const auto around = [&](const std::string& name, const Curve& curve) {
    text += fmt::format("${} << EOD\n", name);
    for (const Envelope::Point& p : thinned(curve, {0, 2 * kPi})) {
      const double r = 1 + per_unit * p.y * f.y_scale;
      text += fmt::format("{:.4f} {:.4f}\n", r * std::cos(p.x), r * std::sin(p.x));
    }
    text += "NaN NaN\nEOD\n";
  };
  std::string plot = fmt::format(
      "plot [t=0:2*pi] cos(t),sin(t) with lines lw 0.9 lc rgb '{0}' notitle, "
      "0.8*cos(t),0.8*sin(t) with lines dt (2,3) lw 0.7 lc rgb '{1}' notitle, "
      "1.2*cos(t),1.2*sin(t) with lines dt (2,3) lw 0.7 lc rgb '{1}' notitle, "
      "0.6*cos(t),0.6*sin(t) with lines dt (2,3) lw 0.7 lc rgb '{1}' notitle, "
      "1.4*cos(t),1.4*sin(t) with lines dt (2,3) lw 0.7 lc rgb '{1}' notitle",
      kPale, "#cfd4da");
  for (std::size_t i = 0; i < f.with.size(); ++i) {
    const std::string name = fmt::format("round{}", i);
    around(name, f.with[i]);
    plot += ", " + line(name.c_str(), "", colour_of(i), 1.3);
  }
  text += fmt::format(
      "set lmargin at screen 0.01\nset rmargin at screen 0.33\nset bmargin at screen 0.04\n"
      "set tmargin at screen 0.98\nset size ratio -1\nunset border\nunset tics\nunset grid\n"
      "unset key\nset parametric\nset samples 181\nset xrange [-1.5:1.5]\nset yrange [-1.5:1.5]\n"
      "set label 1 '{:g} {} per ring' at 0,0 center textcolor rgb '#555b63' font ',12'\n",
      ring, f.y_unit);
  return text + plot +
         "\nunset label\nunset parametric\nset size noratio\nset border 3 lw 1 lc rgb '#5a6068'\n"
         "set tics nomirror out scale 0.6 textcolor rgb '#333333'\n"
         "set grid back lw 0.6 lc rgb '#e4e7eb'\n";
}

}  // namespace

std::string gallery_figure(const GalleryFigure& f) {
  constexpr int kHeight = 310;
  std::string text = heading(900, kHeight) + "set format xy '%g'\nset multiplot\n";
  if (f.polar) text += polar(f);
  const double left = f.polar ? 0.43 : 0.085;
  text += margins(0.2, 0.885, left, 0.985);
  Extent x = extent_of(f.with, true), y = extent_of(f.with, false);
  const Extent x0 = extent_of(f.without, true), y0 = extent_of(f.without, false);
  if (!x0.empty()) x.add(x0.low), x.add(x0.high);
  if (!y0.empty()) y.add(y0.low), y.add(y0.high);
  if (x.empty()) x = {0, 1};
  if (y.empty()) y = {-1e-9, 1e-9};
  const double span = std::max((y.high - y.low) * f.y_scale, 0.02);
  const double middle = 0.5 * (y.high + y.low) * f.y_scale;
  text += fmt::format("set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n", x.low * f.x_scale,
                      x.high * f.x_scale, middle - 0.58 * span, middle + 0.58 * span);
  if (f.polar)
    text += "set xtics nomirror 0,90,360\nset xrange [0:360]\n";
  else
    text += "set xtics nomirror autofreq\n";
  text +=
      fmt::format("set ytics nomirror autofreq\nset xlabel '{}' offset 0,0.2\nset ylabel '{}'\n",
                  f.x_label, f.y_label);
  text +=
      "set key at graph 1,graph 1.13 right top horizontal Left reverse samplen 1.6 width -1 "
      "maxrows 1 noopaque\n";

  std::string plot = "plot ";
  for (std::size_t i = 0; i < f.without.size(); ++i) {
    const std::string name = fmt::format("without{}", i);
    text += data(name, thinned(f.without[i], x), f);
    plot += (i ? ", " : "") + line(name.c_str(), i ? "" : "without", kPale, 2.2);
  }
  for (std::size_t i = 0; i < f.with.size(); ++i) {
    const std::string name = fmt::format("with{}", i);
    text += data(name, thinned(f.with[i], x), f);
    plot += ", " + line(name.c_str(), f.with[i].label.c_str(), colour_of(i), 1.4);
  }
  return text + plot + "\nunset multiplot\n";
}

}  // namespace vcnc
