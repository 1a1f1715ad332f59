// The figures of a report as gnuplot scripts.
#pragma once

#include <string>

#include "analysis/curves.hpp"
#include "analysis/summary.hpp"

namespace vcnc {

/// Theoretical and actual path in the plane, the error magnified; `magnification` is what was used.
std::string path_figure(const Curves& curves, const Summary& summary, double& magnification);
/// e_n with tolerance and crossings, below it the parts it consists of, over the station.
std::string error_figure(const Curves& curves, const Summary& summary);
/// Following errors of the axes over time.
std::string following_figure(const Curves& curves);
/// Raw cos/sin signals of the probe's three channels.
std::string lissajous_figure(const Curves& curves);
/// Bus load and commanded feed over time.
std::string load_figure(const Curves& curves);

}  // namespace vcnc
