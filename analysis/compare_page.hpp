// A comparison as one self-contained page with overlaid figures.
#pragma once

#include <string>
#include <string_view>

#include "analysis/compare.hpp"

namespace vcnc {

/// Second line of the page, by which it is known.
extern const std::string_view kCompareMark;

std::string compare_page(const Comparison& comparison);

}  // namespace vcnc
