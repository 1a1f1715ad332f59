#include "analysis/figure_style.hpp"

#include <fmt/format.h>

namespace vcnc::figure_style {

std::string heading(int width, int height) {
  return fmt::format(
      "set terminal svg size {},{} dynamic enhanced font 'Helvetica,13' background '#ffffff'\n"
      "set encoding utf8\n"
      "set border 3 lw 1 lc rgb '#5a6068'\n"
      "set tics nomirror out scale 0.6 textcolor rgb '#333333'\n"
      "set grid back lw 0.6 lc rgb '#e4e7eb'\n"
      "set key top right horizontal Left reverse samplen 2 width 1 textcolor rgb '#333333' "
      "opaque\n",
      width, height);
}

std::string margins(double bottom, double top, double left, double right) {
  return fmt::format(
      "set lmargin at screen {}\nset rmargin at screen {}\n"
      "set bmargin at screen {}\nset tmargin at screen {}\n",
      left, right, bottom, top);
}

std::string block(const std::string& name, const Envelope& e, double x_scale, double y_scale) {
  std::string text = fmt::format("${} << EOD\n", name);
  bool any = false;
  for (const Envelope::Point& p : e.points()) {
    if (p.starts && any) text += "\n";
    text += fmt::format("{:.7g} {:.7g}\n", p.x * x_scale, p.y * y_scale);
    any = true;
  }
  if (!any) text += "NaN NaN\n";
  return text + "EOD\n";
}

std::string line(const char* name, const char* title, const char* colour, double width) {
  return fmt::format("${} using 1:2 with lines lw {} lc rgb '{}' title '{}'", name, width, colour,
                     title);
}

}  // namespace vcnc::figure_style
