// Draws with gnuplot as a child process.
#pragma once

#include <optional>
#include <string>

namespace vcnc {

/// Runs a gnuplot script that draws one SVG to standard output and returns the SVG element, without
/// XML heading. Empty when gnuplot is not installed or refuses the script; `why` then says so in
/// one sentence. Leaves no files.
std::optional<std::string> draw_svg(const std::string& script, std::string& why);

}  // namespace vcnc
