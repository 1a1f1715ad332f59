// The common look of all figures: colours, fonts, axes, and pieces of gnuplot scripts.
#pragma once

#include <string>

#include "analysis/curves.hpp"

namespace vcnc::figure_style {

inline constexpr const char* kInk = "#0b3c6f";
inline constexpr const char* kGrey = "#8a8f98";
inline constexpr const char* kOrange = "#d9730d";
inline constexpr const char* kGreen = "#1a8a6b";
inline constexpr const char* kRed = "#c0392b";
inline constexpr const char* kViolet = "#7a4fa3";
/// Plot edges, shared so that x axes line up.
inline constexpr double kLeft = 0.09, kRight = 0.975;

/// Terminal of this size, borders, tics, grid and key.
std::string heading(int width, int height);
/// Plot edges as shares of the picture.
std::string margins(double bottom, double top, double left = kLeft, double right = kRight);
/// A named data block of an envelope.
std::string block(const std::string& name, const Envelope& e, double x_scale, double y_scale);
/// A plot element: a line through a named data block.
std::string line(const char* name, const char* title, const char* colour, double width = 1.2);

}  // namespace vcnc::figure_style
