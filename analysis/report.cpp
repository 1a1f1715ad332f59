#include "analysis/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/figures.hpp"
#include "analysis/html.hpp"
#include "analysis/whole_file.hpp"

namespace vcnc {
namespace {

using namespace html;

/// The verdict's plain text with proper symbols.
std::string typeset(std::string text) {
  const auto replace = [&](std::string_view from, std::string_view to) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  };
  replace("e_n", "e<sub>n</sub>");
  replace("e_plan", "e<sub>plan</sub>");
  replace(" um", " µm");
  replace("&lt;=", "≤");
  return text;
}

std::string tile(std::string_view name, const std::string& value, std::string_view note = "") {
  return fmt::format("<div class=\"tile\"><span>{}</span><b>{}</b> <i>{}</i></div>\n", name, value,
                     note);
}

std::string headline(const Summary& s) {
  std::string text = "<h1>Dynamic error</h1>\n<p class=\"lead\">";
  text += fmt::format("{} on {}", escaped(s.program_name), escaped(s.machine_name));
  if (!s.piece_name.empty()) text += fmt::format(", piece {}", escaped(s.piece_name));
  text += fmt::format("</p>\n<div class=\"verdict {0}\"><b>{0}</b><span>{1}</span></div>\n",
                      to_string(s.verdict), typeset(escaped(s.verdict_reason)));
  text += "<div class=\"tiles\">\n";
  const ErrorGroup& whole = s.groups.front();
  if (whole.e_n.count > 0) {
    text += tile("largest |e<sub>n</sub>|", fmt::format("{:.2f} µm", whole.e_n.max_abs() * 1e6),
                 fmt::format("tolerance ±{:g} µm", s.tolerance * 1e6));
    text +=
        tile("e<sub>n</sub> peak to peak", fmt::format("{:.2f} µm", whole.e_n.peak_to_peak() * 1e6),
             fmt::format("rms {:.2f} µm", whole.e_n.rms() * 1e6));
  }
  if (!s.bins.empty())
    text += tile("coverage", fmt::format("{:.1f} %", s.coverage_percent),
                 fmt::format("of {:.0f} mm", s.line_length * 1e3));
  text +=
      tile("duration", fmt::format("{:.2f} s", s.simulated_seconds()),
           s.real_time_factor() > 0 ? fmt::format("{:.1f} × real time", s.real_time_factor()) : "");
  text += tile("bus load, worst", fmt::format("{:.1f} %", s.end.bus_load_worst * 100),
               fmt::format("{} gaps", s.gaps()));
  text += "</div>\n";
  if (!s.warnings.empty()) {
    text += "<ul class=\"warnings\">\n";
    for (const std::string& w : s.warnings) text += "<li>" + typeset(escaped(w)) + "</li>\n";
    text += "</ul>\n";
  }
  return text;
}

struct BinLook {
  Coverage::Bin kind;
  const char* colour;
  const char* name;
};
constexpr BinLook kBinLooks[] = {{Coverage::Bin::ok, "#1a8a6b", "measured"},
                                 {Coverage::Bin::no_contact, "#e3a008", "no contact"},
                                 {Coverage::Bin::out_of_range, "#d9730d", "out of range"},
                                 {Coverage::Bin::invalid, "#c0392b", "invalid signal"},
                                 {Coverage::Bin::not_visited, "#d5d9df", "not visited"}};

/// One rectangle per stretch of equal bins, on the same x axis as the error figure.
std::string coverage_strip(const Summary& s) {
  if (s.bins.empty()) return "";
  constexpr double kLeft = 81, kWidth = 796.5;  // plot edges of the error figure
  const double scale = kWidth / static_cast<double>(s.bins.size());
  std::string text = "<figure><svg viewBox=\"0 0 900 26\" role=\"img\" aria-label=\"coverage\">";
  for (std::size_t i = 0; i < s.bins.size();) {
    std::size_t j = i;
    while (j < s.bins.size() && s.bins[j] == s.bins[i]) ++j;
    text += fmt::format("<rect x=\"{:.2f}\" y=\"3\" width=\"{:.2f}\" height=\"20\" fill=\"{}\"/>",
                        kLeft + static_cast<double>(i) * scale, static_cast<double>(j - i) * scale,
                        kBinLooks[static_cast<std::size_t>(s.bins[i])].colour);
    i = j;
  }
  text += "</svg><div class=\"legend\">";
  for (const BinLook& look : kBinLooks)
    if (const auto n = s.count(look.kind))
      text += fmt::format("<span><i style=\"background:{}\"></i>{}: {} of {} bins</span>",
                          look.colour, look.name, n, s.bins.size());
  return text +
         fmt::format(
             "</div><figcaption>Coverage of the path in bins of {:.2f} mm.</figcaption></figure>\n",
             s.bin_length * 1e3);
}

std::string error_table(const Summary& s) {
  std::string text =
      "<table><tr><th>part of the "
      "path</th><th></th><th>max</th><th>min</th><th>mean</th><th>rms</th>"
      "<th>p-p</th><th>samples</th></tr>\n";
  const auto row = [&](const std::string& name, const char* what, const Statistics& e) {
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        name, what, um(e.max), um(e.min), um(e.mean()), um(e.rms()), um(e.peak_to_peak()), e.count);
  };
  const ErrorGroup& whole = s.groups.front();
  row("<b>whole path</b>", "e<sub>n</sub>", whole.e_n);
  row("", "e<sub>plan</sub>", whole.e_plan);
  row("", "e<sub>servo</sub>", whole.e_servo);
  row("", "e<sub>rest</sub>", whole.e_rest);
  for (std::size_t i = 1; i < s.groups.size(); ++i)
    row(escaped(s.groups[i].name), "e<sub>n</sub>", s.groups[i].e_n);
  return text +
         "</table>\n<p class=\"lead\">Errors in µm; + = the machine is away from the part. "
         "Crossings: ±5 mm of path.</p>\n";
}

std::string axis_table(const Summary& s) {
  std::string text =
      "<table><tr><th>axis</th><th>unit</th><th>max</th><th>rms</th><th>max on the "
      "path</th><th>rms on the path</th>"
      "<th>largest share in e<sub>n</sub> [µm]</th></tr>\n";
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    const double scale = is_rotary(j) ? 3600 / kDegree : 1e6;
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td>"
        "<td>{:.3f}</td></tr>\n",
        kAxisNames[j], is_rotary(j) ? "arcsec" : "µm", s.following[j].max_abs() * scale,
        s.following[j].rms() * scale, s.following_on_path[j].max_abs() * scale,
        s.following_on_path[j].rms() * scale, s.share[j].max_abs() * 1e6);
  }
  return text + "</table>\n";
}

std::string circle_table(const Summary& s) {
  if (s.circles.empty()) return "";
  std::string text =
      "<h2>Circular test</h2>\n<table><tr><th>sense</th><th>mean radius "
      "deviation</th><th>G</th><th>F max</th>"
      "<th>F min</th><th>centre x, y</th><th>cos 2φ</th><th>sin 2φ</th><th>steps at 0, 90, 180, "
      "270°</th></tr>\n";
  for (const auto& [direction, r] : s.circles) {
    std::string steps;
    for (const auto& step : r.step)
      steps += (steps.empty() ? "" : ", ") + (step ? um(*step) : std::string("–"));
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}, {}</td><td>{}</td>"
        "<td>{}</td><td>{}</td></tr>\n",
        direction > 0 ? "counter-clockwise" : "clockwise", um(r.mean), um(r.G), um(r.F_max),
        um(r.F_min), um(r.centre_x), um(r.centre_y), um(r.cos2), um(r.sin2), steps);
  }
  return text + "</table>\n<p class=\"lead\">ISO 230-4, least-squares centre; all in µm.</p>\n";
}

std::string alarm_table(const Summary& s) {
  if (s.alarms.empty()) return "<p>None.</p>\n";
  std::string text = "<table><tr><th>time</th><th>source</th><th>code</th><th>alarm</th></tr>\n";
  constexpr std::size_t kMost = 200;
  for (std::size_t i = 0; i < std::min(kMost, s.alarms.size()); ++i) {
    const Alarm& a = s.alarms[i];
    text += fmt::format(
        "<tr><td>{:.3f} s</td><td>{}</td><td>{}</td><td style=\"text-align:left\">{}</td></tr>\n",
        seconds(a.tick), escaped(a.source), a.code, escaped(a.text));
  }
  text += "</table>\n";
  if (s.alarms.size() > kMost)
    text += fmt::format("<p>{} more alarms.</p>\n", s.alarms.size() - kMost);
  return text;
}

std::string run_table(const Summary& s) {
  std::string text = "<table class=\"data\">\n";
  const auto row = [&](const char* name, const std::string& value) {
    text += fmt::format("<tr><td>{}</td><td><code>{}</code></td></tr>\n", name, escaped(value));
  };
  row("run", s.run_id);
  row("program", s.program_name);
  row("end", s.end.complete ? "complete: " + s.end.reason : s.end.reason);
  row("cycles of 1 ms", std::to_string(s.end.cycles));
  row("samples received, missing", fmt::format("{}, {}", s.rows, s.gaps()));
  row("trace hash", s.end.trace_hash.empty() ? "–" : s.end.trace_hash);
  row("seed", std::to_string(s.seed));
  if (s.real_time_factor() > 0)
    row("speed", fmt::format("{:.1f} × real time", s.real_time_factor()));
  if (s.interference) {
    row("interference, programmed", fmt::format("{:.3f} mm", *s.interference * 1e3));
    row("interference, declared", fmt::format("{:.3f} mm", s.predeflection * 1e3));
  }
  if (s.line_length > 0)
    row("scan line",
        fmt::format("{:.2f} mm long at z = {:.3f} mm", s.line_length * 1e3, s.line_z * 1e3));
  return text + "</table>\n";
}

}  // namespace

void write_report(const RecordingReader& recording, const Summary& s,
                  const std::filesystem::path& path) {
  const Curves curves = collect_curves(recording, s);
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>Dynamic error: {}</title>\n<style>{}</style></head>\n<body><main>\n",
      escaped(s.program_name), kPageStyle);
  html += headline(s);
  const bool measured = s.groups.front().e_n.count > 0;
  if (measured) {
    double magnification = 1;
    const std::string script = path_figure(curves, s, magnification);
    html +=
        "<h2>Path</h2>\n" +
        figure(script,
               fmt::format(
                   "Theoretical and actual path of the ball centre in workpiece coordinates; the "
                   "error is magnified {:g} times.",
                   magnification));
    html += "<h2>Error along the path</h2>\n" +
            figure(error_figure(curves, s),
                   s.crossings.empty() ? "e<sub>n</sub> and its parts over the path."
                                       : "e<sub>n</sub> and its parts over the path. Numbered "
                                         "lines: crossings, where the wall "
                                         "changes between open and closed angle. Grey: end caps.");
    html += coverage_strip(s);
    html += "<h2>Statistics</h2>\n" + error_table(s);
  }
  html += circle_table(s);
  html += "<h2>Following error</h2>\n" +
          figure(following_figure(curves), "Measured minus commanded axis positions.") +
          axis_table(s);
  if (measured)
    html += "<h2>Probe signals</h2>\n" +
            figure(lissajous_figure(curves),
                   "Raw cosine and sine of the three channels, 1 = nominal amplitude. Dotted: "
                   "limits of a 1 V<sub>pp</sub> "
                   "interface, 0.6 and 1.2.");
  html += "<h2>Bus and feed</h2>\n" +
          figure(load_figure(curves),
                 "Share of each cycle the bus is busy, and the commanded feed; rapids "
                 "leave the picture.");
  html += "<h2>Alarms</h2>\n" + alarm_table(s) + "<h2>Run</h2>\n" + run_table(s) +
          "</main></body></html>\n";
  write_whole_file(path, html);
}

}  // namespace vcnc
