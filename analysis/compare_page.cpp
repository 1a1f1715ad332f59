#include "analysis/compare_page.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "analysis/compare_figures.hpp"
#include "analysis/html.hpp"

namespace vcnc {

const std::string_view kCompareMark = "<!-- Written by vcnc compare. -->";

namespace {

using namespace html;

constexpr const char* kCompareStyle = R"(
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 16px; }
.run { border: 1px solid var(--line); border-top: 5px solid var(--c); border-radius: 6px; padding: 12px 16px; }
.run h2 { border: 0; margin: 0; padding: 0; } .run p { margin: 2px 0; font-size: 13.5px; color: var(--soft); overflow-wrap: anywhere; }
.run b.PASS, .run b.FAIL, .run b.INCOMPLETE { color: var(--c); }
td.delta { color: #1a8a6b; font-weight: 600; }
)";

std::string run_box(const char* letter, const char* colour, const ComparedRun& run) {
  const Summary& s = run.summary;
  return fmt::format(
      "<div class=\"run\" style=\"--c: {}\"><h2>{}</h2><p>{}</p><p>{} on {}, {}</p>"
      "<p>{:.2f} s, seed {}, {}</p><p><b class=\"{}\">{}</b> {}</p></div>\n",
      colour, letter, escaped(run.name), escaped(s.program_name), escaped(s.machine_name),
      s.piece_name.empty() ? "no piece" : "piece " + escaped(s.piece_name), run.seconds, s.seed,
      s.end.complete ? "complete" : escaped(s.end.reason), to_string(s.verdict),
      to_string(s.verdict), escaped(s.verdict_reason));
}

std::string errors_side_by_side(const Comparison& c) {
  std::string text =
      "<table><tr><th>error [µm]</th><th></th><th>max</th><th>min</th><th>mean</th><th>rms</th>"
      "<th>p-p</th></tr>\n";
  const auto rows = [&](const char* name, const Statistics& a, const Statistics& b) {
    const std::array of_a{a.max, a.min, a.mean(), a.rms(), a.peak_to_peak()};
    const std::array of_b{b.max, b.min, b.mean(), b.rms(), b.peak_to_peak()};
    std::string first, second, third;
    for (std::size_t i = 0; i < of_a.size(); ++i) {
      first += "<td>" + um(of_a[i]) + "</td>";
      second += "<td>" + um(of_b[i]) + "</td>";
      third += "<td class=\"delta\">" + um(of_b[i] - of_a[i]) + "</td>";
    }
    text += fmt::format(
        "<tr><td><b>{}</b></td><td>A</td>{}</tr><tr><td></td><td>B</td>{}</tr>"
        "<tr><td></td><td>B − A</td>{}</tr>\n",
        name, first, second, third);
  };
  const ErrorGroup &a = c.a.summary.groups.front(), &b = c.b.summary.groups.front();
  rows("e<sub>n</sub>", a.e_n, b.e_n);
  rows("e<sub>plan</sub>", a.e_plan, b.e_plan);
  rows("e<sub>servo</sub>", a.e_servo, b.e_servo);
  rows("e<sub>rest</sub>", a.e_rest, b.e_rest);
  return text + "</table>\n";
}

std::string axes_side_by_side(const Comparison& c) {
  std::string text =
      "<table><tr><th>axis</th><th>unit</th><th>max A</th><th>max B</th><th>B − A</th>"
      "<th>rms A</th><th>rms B</th><th>B − A</th></tr>\n";
  const auto row = [&](const std::string& name, const char* unit, const Statistics& a,
                       const Statistics& b, double scale) {
    const auto number = [&](double v) {
      return fmt::format("{:.3f}", std::round(v * scale * 1e3) / 1e3 + 0.0);
    };
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"delta\">{}</td><td>{}</td>"
        "<td>{}</td><td class=\"delta\">{}</td></tr>\n",
        name, unit, number(a.max_abs()), number(b.max_abs()), number(b.max_abs() - a.max_abs()),
        number(a.rms()), number(b.rms()), number(b.rms() - a.rms()));
  };
  for (std::size_t j = 0; j < kAxisCount; ++j)
    row(fmt::format("following error {}", kAxisNames[j]), is_rotary(j) ? "arcsec" : "µm",
        c.a.summary.following[j], c.b.summary.following[j], is_rotary(j) ? 3600 / kDegree : 1e6);
  for (std::size_t j = 0; j < kAxisCount; ++j)
    row(fmt::format("force {}", kAxisNames[j]), "% of the limit", c.a.force[j], c.b.force[j], 100);
  return text + "</table>\n";
}

std::string key_table(const std::vector<KeyDifference>& keys) {
  std::string text = "<table class=\"data\"><tr><th>key</th><th>A</th><th>B</th></tr>\n";
  const auto value = [](const std::string& v) { return v.empty() ? std::string("–") : escaped(v); };
  for (const KeyDifference& k : keys)
    text += fmt::format("<tr><td><code>{}</code></td><td>{}</td><td>{}</td></tr>\n", escaped(k.key),
                        value(k.a), value(k.b));
  return text + "</table>\n";
}

}  // namespace

std::string compare_page(const Comparison& c) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n{}\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>Comparison: {} and {}</title>\n<style>{}{}</style></head>\n<body><main>\n",
      kCompareMark, escaped(c.a.name), escaped(c.b.name), kPageStyle, kCompareStyle);
  page += "<h1>Two runs</h1>\n<p class=\"lead\">Commanded motion: ";
  page += c.same_motion ? "equal" : "differs";
  page += ". Trace hash: ";
  page += c.same_trace ? "equal, the runs are the same bit for bit" : "differs";
  page += ".</p>\n<div class=\"pair\">\n" + run_box("A", "#0b3c6f", c.a) +
          run_box("B", "#d9730d", c.b) + "</div>\n";
  if (!c.not_comparable.empty()) {
    page += "<h2>Cannot be compared</h2>\n<ul class=\"warnings\">\n";
    for (const std::string& s : c.not_comparable) page += "<li>" + escaped(s) + "</li>\n";
    page += "</ul>\n";
  }
  const bool a = c.a.profile.size() > 0, b = c.b.profile.size() > 0;
  if (a || b)
    page += "<h2>Error along the path</h2>\n" +
            figure(compared_error_figure(c),
                   c.same_line ? "e<sub>n</sub> of both runs, mean in bins of 0.25 mm, and their "
                                 "difference."
                               : "e<sub>n</sub> of each run over its own station, mean in bins of "
                                 "0.25 mm.");
  if (a && b) page += errors_side_by_side(c);
  page += "<h2>Following error</h2>\n" +
          figure(compared_following_figure(c),
                 "Measured minus commanded axis positions of both runs over time.") +
          axes_side_by_side(c);
  page += "<h2>Declared machine</h2>\n";
  page += c.machine.empty() ? "<p>Equal.</p>\n" : key_table(c.machine);
  if (!c.piece.empty()) page += "<h2>Piece</h2>\n" + key_table(c.piece);
  return page + "</main></body></html>\n";
}

}  // namespace vcnc
