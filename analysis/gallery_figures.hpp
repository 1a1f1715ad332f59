// The figures of the gallery as gnuplot scripts: a signal without and with an effect.
#pragma once

#include <string>
#include <vector>

#include "analysis/features.hpp"

namespace vcnc {

struct GalleryFigure {
  std::string x_label, y_label;     ///< with units
  double x_scale = 1, y_scale = 1;  ///< from SI to the units of the labels
  std::string y_unit;               ///< alone, for the scale of the circle
  std::vector<Curve> without, with;
  bool polar = false;  ///< also draw the deviations around a circle
};

std::string gallery_figure(const GalleryFigure& figure);

}  // namespace vcnc
