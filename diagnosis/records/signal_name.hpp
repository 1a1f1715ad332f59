// Names of signals, as messages, files and pages have them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "diagnosis/records/record.hpp"

namespace vcnc {

std::string_view to_string(SignalKind kind);  ///< "command", "position", ...
std::optional<SignalKind> signal_kind(std::string_view name);
/// "position X", "deflection z".
std::string signal_name(SignalKind kind, std::size_t axis);

}  // namespace vcnc
