// Files of configs/ that programs carry with them, so that they work from any folder.
#pragma once

#include <string_view>

namespace vcnc {

extern const std::string_view kIdealTrunnion;  ///< configs/machines/trunnion.toml
extern const std::string_view kSPiece;         ///< configs/pieces/s_eq1.toml

}  // namespace vcnc
