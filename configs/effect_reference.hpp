// The library of effects as text: table, page of one effect, Markdown and JSON, all written from
// the list (model/effects/list.hpp) and the declarations of the effects themselves.
#pragma once

#include <string>
#include <string_view>

#include "model/input_error.hpp"

namespace vcnc {

/// All effects by family: place, brief, parameters with bounds. At most 100 columns.
std::string effect_table();

/// Everything about one effect. Throws InputError with a suggestion for an unknown name.
std::string effect_page(std::string_view name);

/// docs/effects.md.
std::string effect_markdown();

std::string effect_json();

/// The options that give an effect its typical size at its first place:
/// "--inject X.backlash.gap_um=10.0". Throws InputError for an unknown name.
std::string effect_injection(std::string_view name);

}  // namespace vcnc
