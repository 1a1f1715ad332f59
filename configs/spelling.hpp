// For "did you mean".
#pragma once

#include <cstddef>
#include <string_view>

namespace vcnc {

/// Edits (insert, delete, replace a letter) from one word to the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace vcnc
