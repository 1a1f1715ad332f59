// The report of a run: one self-contained HTML file with figures as SVG.
#pragma once

#include <filesystem>

#include "analysis/recording.hpp"
#include "analysis/summary.hpp"

namespace vcnc {

/// Reads the recording once more for the curves. Without gnuplot the report has no figures and says
/// so. The file appears complete or not at all.
void write_report(const RecordingReader& recording, const Summary& summary,
                  const std::filesystem::path& path);

}  // namespace vcnc
