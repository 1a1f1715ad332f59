// Pieces of the self-contained HTML pages: report, comparison, gallery.
#pragma once

#include <string>
#include <string_view>

namespace vcnc::html {

/// The style sheet that all pages share.
extern const char* const kPageStyle;

std::string escaped(std::string_view text);

/// Micrometres with two decimals, never "-0.00".
std::string um(double metres);

/// A figure element from a gnuplot script; where it cannot be drawn, a box that says why.
std::string figure(const std::string& script, const std::string& caption);

}  // namespace vcnc::html
