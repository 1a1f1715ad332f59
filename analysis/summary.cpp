#include "analysis/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/math.hpp"

namespace vcnc {
namespace {

/// Micrometres as they are shown with two decimals, never "-0.00".
double rounded_um(double metres) { return std::round(metres * 1e8) / 100 + 0.0; }

std::string error_line(const char* name, const Statistics& s) {
  return fmt::format("  {:<9}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}\n", name, rounded_um(s.max),
                     rounded_um(s.min), rounded_um(s.mean()), rounded_um(s.rms()),
                     rounded_um(s.peak_to_peak()));
}

std::string errors(const Summary& s) {
  const ErrorGroup& whole = s.groups.front();
  if (whole.e_n.count == 0) return "";
  return fmt::format("  {:<9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "error/um", "max", "min", "mean", "rms",
                     "p-p") +
         error_line("e_n", whole.e_n) + error_line("e_plan", whole.e_plan) +
         error_line("e_servo", whole.e_servo) + error_line("e_rest", whole.e_rest);
}

std::string circles(const Summary& s) {
  std::string text;
  for (const CircularSummary& c : s.circles)
    text += fmt::format("  circle {:<3} mean {:+.2f} um, G {:.2f} um, F {:+.2f}/{:+.2f} um\n",
                        c.direction > 0 ? "ccw" : "cw", c.result.mean * 1e6, c.result.G * 1e6,
                        c.result.F_max * 1e6, c.result.F_min * 1e6);
  return text;
}

std::string following(const Summary& s) {
  std::string text = "  following error, max:";
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    const double e = s.following[j].max_abs();
    text += is_rotary(j) ? fmt::format("  {} {:.2f}\"", kAxisNames[j], e / kDegree * 3600)
                         : fmt::format("  {} {:.2f} um", kAxisNames[j], e * 1e6);
  }
  return text + "\n";
}

std::string coverage(const Summary& s) {
  if (s.bins.empty()) return "";
  std::string text =
      fmt::format("  coverage {:.1f} % of {:.1f} mm", s.coverage_percent, s.line_length * 1e3);
  const auto add = [&](Coverage::Bin kind, const char* name) {
    if (const auto n = s.count(kind)) text += fmt::format(", {} {}", n, name);
  };
  add(Coverage::Bin::no_contact, "without contact");
  add(Coverage::Bin::out_of_range, "out of range");
  add(Coverage::Bin::invalid, "invalid");
  add(Coverage::Bin::not_visited, "not visited");
  return text + "\n";
}

}  // namespace

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "PASS";
    case Verdict::fail:
      return "FAIL";
    case Verdict::incomplete:
      break;
  }
  return "INCOMPLETE";
}

std::int64_t Summary::count(Coverage::Bin kind) const {
  return std::count(bins.begin(), bins.end(), kind);
}

std::string to_text(const Summary& s) {
  std::string text = fmt::format("{}  {}\n", to_string(s.verdict), s.verdict_reason);
  text += errors(s) + circles(s) + coverage(s) + following(s);
  text += fmt::format("  {} cycles, {}, bus load {:.1f} %", s.end.cycles,
                      s.end.complete ? "complete" : s.end.reason, s.end.bus_load_worst * 100);
  if (s.real_time_factor() > 0) text += fmt::format(", {:.1f} x real time", s.real_time_factor());
  text += fmt::format(", gaps {}\n", s.gaps());
  if (!s.end.trace_hash.empty()) text += fmt::format("  trace {}\n", s.end.trace_hash);
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, s.alarms.size()); ++i)
    text += fmt::format("  alarm at {:.3f} s, {}: {}\n", seconds(s.alarms[i].tick),
                        s.alarms[i].source, s.alarms[i].text);
  if (s.alarms.size() > kShown) text += fmt::format("  {} more alarms\n", s.alarms.size() - kShown);
  for (const std::string& warning : s.warnings) text += fmt::format("  warning: {}\n", warning);
  return text;
}

}  // namespace vcnc
