// The gallery as one self-contained page: what every effect looks like, ready to be printed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/demonstrations.hpp"

namespace vcnc {

/// One effect with its picture.
struct GalleryEntry {
  Demonstration demonstration;
  std::vector<Reading> readings;
  std::string svg;      ///< empty: no picture
  std::string trouble;  ///< alarms and the like; empty: none
};

/// Runs the demonstration without and with the effect, reads it and draws it (with `draw`).
GalleryEntry gallery_entry(std::string_view effect, const Machine& machine, bool draw);

/// First line of the page: the folder is ours.
extern const std::string_view kGalleryMark;

/// Entries by family, in the order of the families. `note` stands on top where it is not empty.
std::string gallery_page(const std::vector<GalleryEntry>& entries, const Machine& machine,
                         const std::string& note);

}  // namespace vcnc
