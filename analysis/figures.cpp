#include "analysis/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/figure_style.hpp"

namespace vcnc {
namespace {

using namespace figure_style;

/// Largest magnitude in an envelope.
double reach(const Envelope& e) {
  double m = 0;
  for (const Envelope::Point& p : e.points()) m = std::max(m, std::abs(p.y));
  return m;
}

/// 1, 2 or 5 times a power of ten, not above x.
double round_down(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x)));
  for (const double f : {5.0, 2.0})
    if (f * power <= x * (1 + 1e-9)) return f * power;
  return power;
}

/// Symmetric, with room for the key above.
std::string y_range(double reach_value) {
  const double r = std::max(reach_value, 1e-3);
  return fmt::format("set yrange [{:.6g}:{:.6g}]\n", -1.15 * r, 1.5 * r);
}

/// Labels for the faces above the plot and dotted lines at the crossings.
std::string landmarks(const Curves& curves, const Summary& s, bool names) {
  std::string text = "unset arrow\nunset label\nunset object\n";
  int id = 1;
  for (const FacePart& part : curves.faces) {
    if (part.face == Face::whole) continue;
    const bool cap = part.face == Face::end_cap || part.face == Face::start_cap;
    if (cap)
      text += fmt::format(
          "set object {} rectangle from first {:.6g},graph 0 to first {:.6g},graph 1 "
          "behind fillstyle solid noborder fillcolor rgb '#eef1f5'\n",
          id, part.from * 1e3, part.to * 1e3);
    if (names && !cap)
      text += fmt::format(
          "set label {} '{}' at first {:.6g},graph 1.17 center textcolor rgb '#555b63'\n", id,
          kFaceNames[static_cast<std::size_t>(part.face)], (part.from + part.to) / 2 * 1e3);
    ++id;
  }
  int number = 1;
  for (const CrossingMark& c : s.crossings) {
    text += fmt::format(
        "set arrow {} from first {:.6g},graph 0 to first {:.6g},graph 1 nohead back dt (4,4) lw 1 "
        "lc rgb '{}'\n",
        id, c.s * 1e3, c.s * 1e3, kViolet);
    if (names)
      text += fmt::format(
          "set label {} '{}' at first {:.6g},graph 1.07 center font ',11' textcolor rgb '{}'\n", id,
          number, c.s * 1e3, kViolet);
    ++number;
    ++id;
  }
  return text;
}

}  // namespace

std::string path_figure(const Curves& curves, const Summary& s, double& magnification) {
  std::string text = heading(900, 560) +
                     "set size ratio -1\nset xlabel 'X  [mm]'\nset ylabel 'Y  [mm]'\n"
                     "set key outside bottom center horizontal noopaque\n";
  magnification = 1;
  if (curves.path.empty()) {
    text += "$line << EOD\n";
    for (const Vec3& p : curves.theoretical)
      text += fmt::format("{:.6g} {:.6g}\n", p.x() * 1e3, p.y() * 1e3);
    return text + "EOD\nplot " + line("line", "theoretical path of the ball centre", kInk) + "\n";
  }
  // What is magnified must stay clear of the rest of the path; a tolerance that does not is left
  // out.
  constexpr double kClear = 0.02;  // of the extent
  double extent = 0, worst = 0.05 * s.tolerance;
  for (const CurvePoint& p : curves.path) {
    extent = std::max(extent, (p.centre - curves.path.front().centre).norm());
    worst = std::max(worst, std::abs(p.e_n));
  }
  magnification = round_down(kClear * extent / worst);
  const bool show_band = magnification * s.tolerance <= 1.5 * kClear * extent;
  const auto offset = [&](const CurvePoint& p, double e) {
    const Vec3 q = p.centre + magnification * e * p.n;
    return fmt::format("{:.6g} {:.6g}\n", q.x() * 1e3, q.y() * 1e3);
  };
  std::string nominal = "$nominal << EOD\n", actual = "$actual << EOD\n", over = "$over << EOD\n",
              band = "$band << EOD\n";
  std::string inner;
  bool any_over = false;
  for (const CurvePoint& p : curves.path) {
    nominal += offset(p, 0);
    band += offset(p, s.tolerance);
    inner += offset(p, -s.tolerance);
    actual += p.measured ? offset(p, p.e_n) : "\n";
    const bool out = p.measured && std::abs(p.e_n) > s.tolerance;
    over += out ? offset(p, p.e_n) : "\n";
    any_over = any_over || out;
  }
  text += nominal + "EOD\n" + band + "\n" + inner + "EOD\n" + actual + "EOD\n" + over +
          "NaN NaN\nEOD\n";
  text += "plot ";
  if (show_band)
    text +=
        line("band", fmt::format("tolerance ±{:g} µm", s.tolerance * 1e6).c_str(), "#b4bcc8", 1.0) +
        ", ";
  text +=
      line("nominal", "theoretical path", kGrey, 1.0) + ", " +
      line("actual", fmt::format("actual path, error × {:g}", magnification).c_str(), kInk, 1.8);
  if (any_over) text += ", " + line("over", "out of tolerance", kRed, 2.2);
  return text + "\n";
}

std::string error_figure(const Curves& curves, const Summary& s) {
  const double um = 1e6, mm = 1e3, length = std::max(s.line_length, s.last_station) * mm;
  const double worst = reach(curves.e_n) * um, tolerance = s.tolerance * um;
  const bool show_tolerance = worst > 0.2 * tolerance;
  const double parts =
      std::max({reach(curves.e_plan), reach(curves.e_servo), reach(curves.e_rest)}) * um;
  std::string text = heading(900, 560);
  text += block("en", curves.e_n, mm, um) + block("plan", curves.e_plan, mm, um) +
          block("servo", curves.e_servo, mm, um) + block("rest", curves.e_rest, mm, um);
  text += fmt::format("set multiplot\nset xrange [0:{:.6g}]\n", length);
  text += margins(0.55, 0.89) + landmarks(curves, s, true) +
          y_range(show_tolerance ? std::max(worst, tolerance) : worst) +
          "set format x ''\nset ylabel 'e_n  [µm]' offset 0.5\nset key top right\n";
  text += "plot " + line("en", "e_n", kInk, 1.4);
  if (show_tolerance)
    text += fmt::format(
        ", {} with lines dt 2 lw 1.2 lc rgb '{}' title 'tolerance', {} with lines dt 2 lw 1.2 "
        "lc rgb '{}' notitle",
        tolerance, kRed, -tolerance, kRed);
  text += "\n";
  text += margins(0.12, 0.49) + landmarks(curves, s, false) + y_range(parts) +
          "set format x '%g'\nset xlabel 'station on the path  s  [mm]'\nset ylabel 'parts  [µm]' "
          "offset 0.5\n";
  text += "plot " + line("rest", "e_{rest}", kGreen) + ", " + line("servo", "e_{servo}", kOrange) +
          ", " + line("plan", "e_{plan}", kGrey) + "\nunset multiplot\n";
  return text;
}

std::string following_figure(const Curves& curves) {
  static constexpr std::array<const char*, 5> colours{kInk, kOrange, kGreen, kViolet, kRed};
  std::string text = heading(900, 460), linear, rotary;
  double linear_reach = 0, rotary_reach = 0;
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    const double scale = is_rotary(j) ? 3600 / kDegree : 1e6;
    const std::string name(kAxisNames[j]);
    text += block(name.c_str(), curves.following[j], 1, scale);
    std::string& list = is_rotary(j) ? rotary : linear;
    double& most = is_rotary(j) ? rotary_reach : linear_reach;
    most = std::max(most, reach(curves.following[j]) * scale);
    list += (list.empty() ? "" : ", ") + line(name.c_str(), name.c_str(), colours[j]);
  }
  text += "set multiplot\nset key top right\n" + margins(0.57, 0.96) + y_range(linear_reach) +
          "set format x ''\nset ylabel 'X, Y, Z  [µm]' offset 0.5\nplot " + linear + "\n";
  text +=
      margins(0.14, 0.51) + y_range(rotary_reach) +
      "set format x '%g'\nset xlabel 'time  [s]'\nset ylabel 'A, C  [arcsec]' offset 0.5\nplot " +
      rotary + "\nunset multiplot\n";
  return text;
}

std::string lissajous_figure(const Curves& curves) {
  static constexpr std::array<const char*, 3> names{"x", "y", "z"};
  std::string text = heading(900, 350) +
                     "set size square\nset xrange [-1.4:1.4]\nset yrange [-1.4:1.4]\n"
                     "set xtics 1\nset ytics 1\nset xlabel 'cos'\nset ylabel 'sin' offset 1\n"
                     "set parametric\nset trange [0:2*pi]\nset samples 181\nunset key\n";
  for (std::size_t i = 0; i < 3; ++i) {
    text += fmt::format("${} << EOD\n", names[i]);
    for (const auto& [cosine, sine] : curves.lissajous[i])
      text += fmt::format("{:.4f} {:.4f}\n", cosine, sine);
    text += "NaN NaN\nEOD\n";
  }
  text += "set multiplot layout 1,3 margins 0.06,0.99,0.20,0.89 spacing 0.06\n";
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format(
        "set title 'channel {}' textcolor rgb '#333333'\n"
        "plot 1.2*cos(t),1.2*sin(t) with lines dt 3 lw 1 lc rgb '{}', "
        "0.6*cos(t),0.6*sin(t) with lines dt 3 lw 1 lc rgb '{}', "
        "${} using 1:2 with points pt 7 ps 0.16 lc rgb '{}'\n",
        names[i], kRed, kRed, names[i], kInk);
  return text + "unset multiplot\n";
}

std::string load_figure(const Curves& curves) {
  std::string text = heading(900, 270) + block("load", curves.bus_load, 1, 100) +
                     block("feed", curves.feed, 1, 60e3);
  const double feed = curves.path_feed > 0 ? curves.path_feed : reach(curves.feed);
  text += fmt::format(
      "set lmargin at screen {}\nset rmargin at screen 0.9\nset bmargin at screen 0.24\n"
      "set tmargin at screen 0.88\nset border 11\n"
      "set xlabel 'time  [s]'\nset yrange [0:105]\nset ytics 25\nset ylabel 'bus load  [%]'\n"
      "set y2range [0:{:.6g}]\nset y2tics out scale 0.6 textcolor rgb '#333333'\n"
      "set y2label 'feed  [mm/min]' offset -1\nset key at graph 1,graph 1.17 noopaque\n",
      kLeft, std::max(feed * 60e3 * 2.0, 1.0));
  return text + "plot " + line("load", "bus load", kInk) + ", " + line("feed", "feed", kOrange) +
         " axes x1y2\n";
}

}  // namespace vcnc
