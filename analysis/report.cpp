#include "analysis/report.hpp"
namespace vcnc { void write_report(const RecordingReader&, const Summary&, const std::filesystem::path&) {} }
