// The figures of a comparison as gnuplot scripts.
#pragma once

#include <string>

#include "analysis/compare.hpp"

namespace vcnc {

/// e_n of both runs over the station, below it their difference.
std::string compared_error_figure(const Comparison& comparison);
/// Following errors of the axes of both runs over time.
std::string compared_following_figure(const Comparison& comparison);

}  // namespace vcnc
