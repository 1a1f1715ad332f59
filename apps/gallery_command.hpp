// `vcnc gallery`: a page with one figure per effect.
#pragma once

#include <string>
#include <vector>

namespace vcnc {

struct GalleryOptions {
  std::string out;                ///< folder; gets index.html
  std::vector<std::string> only;  ///< names of effects; empty: all
  std::string machine;            ///< machine file; empty: the ideal trunnion
};

/// Exit code of the program. Throws InputError before anything is run.
int gallery_command(const GalleryOptions& options);

}  // namespace vcnc
