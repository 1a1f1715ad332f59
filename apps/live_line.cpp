#include "apps/live_line.hpp"

#include <fmt/format.h>

namespace vcnc {

namespace {

std::string text_of(const LiveView& v) {
  std::string text = fmt::format("t {:7.2f} s  line {:5d}", v.t, v.line);
  if (v.on_path)
    text += fmt::format("  e_n {:+7.2f} um", v.e_n * 1e6);
  else
    text += "  e_n   (off path)";
  text += fmt::format("  [{:+.2f} .. {:+.2f}]  covered {:5.1f} %", v.e_n_min * 1e6, v.e_n_max * 1e6,
                      v.coverage_percent);
  if (v.failed) text += "  OUT OF TOLERANCE";
  if (v.alarms > 0) text += fmt::format("  {} alarm{}", v.alarms, v.alarms == 1 ? "" : "s");
  return text;
}

}  // namespace

void LiveLine::row(const TelemetryRow& row) {
  session_.row(row);
  if (++rows_ % 200 == 0) tell_(text_of(session_.snapshot()));
}

void LiveLine::end(const RunEnd& end) {
  tell_("writing the results");
  session_.end(end);
}

}  // namespace vcnc
