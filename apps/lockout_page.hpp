// The results of a lockout suite as one self-contained HTML page.
#pragma once

#include <string>

#include "apps/lockout_report.hpp"

namespace vcnc {

/// Runs the worst and some typical trips again to draw them. Needs gnuplot for the figures; the
/// page says so where it is missing.
std::string lockout_page(const LockoutResults& results);

}  // namespace vcnc
