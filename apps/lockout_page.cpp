#include "apps/lockout_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/figure_style.hpp"
#include "analysis/html.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

namespace {

constexpr const char* kStyle = R"(
:root { --ink: #1d232b; --soft: #5a6270; --line: #dfe3e8; --pass: #1a7f52; --fail: #b3261e; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
main { max-width: 980px; margin: 0 auto; padding: 36px 28px 64px; }
h1 { font-size: 26px; font-weight: 650; margin: 0 0 2px; letter-spacing: -0.01em; }
h2 { font-size: 18px; font-weight: 650; margin: 44px 0 10px; padding-top: 14px; border-top: 1px solid var(--line); }
h3 { font-size: 15px; font-weight: 650; margin: 26px 0 0; }
p.lead { color: var(--soft); margin: 0 0 22px; }
.verdict { display: flex; gap: 18px; align-items: center; border: 1px solid var(--line); border-left: 6px solid var(--c); border-radius: 6px; padding: 14px 18px; }
.verdict b { font-size: 22px; color: var(--c); letter-spacing: 0.02em; }
.PASS { --c: var(--pass); } .FAIL, .INTERRUPTED { --c: var(--fail); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 16px 0 0; }
.tile { border: 1px solid var(--line); border-radius: 6px; padding: 10px 14px; }
.tile span { display: block; color: var(--soft); font-size: 13px; }
.tile b { font-size: 20px; font-weight: 620; white-space: nowrap; }
.tile i { display: block; font-style: normal; font-size: 13px; color: var(--soft); }
figure { margin: 0 0 6px; break-inside: avoid; }
figure svg { width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: 13.5px; margin: 4px 0 0; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 18px; }
.missing { border: 1px dashed var(--line); border-radius: 6px; padding: 26px; color: var(--soft); text-align: center; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; margin: 6px 0; }
th, td { padding: 5px 10px; border-bottom: 1px solid var(--line); text-align: right; }
th { color: var(--soft); font-weight: 600; } th:first-child, td:first-child { text-align: left; }
table.words td { text-align: left; vertical-align: top; }
code { font-size: 13px; overflow-wrap: anywhere; }
@media print { main { max-width: none; padding: 0; } body { font-size: 12px; } }
)";

using figure_style::heading;
using html::escaped;
using html::figure;

std::string histogram(const Distribution& d, double scale, double from, double to, std::size_t bins,
                      const char* label, const char* caption) {
  if (d.empty()) return "";
  const auto counts = d.histogram(from / scale, to / scale, bins);
  const double width = (to - from) / static_cast<double>(bins);
  std::string script = heading(470, 270) + "$h << EOD\n";
  for (std::size_t i = 0; i < bins; ++i)
    script += fmt::format("{:.6g} {}\n", from + width * (static_cast<double>(i) + 0.5), counts[i]);
  script += fmt::format(
      "EOD\nset boxwidth {:.6g}\nset style fill solid 0.85 noborder\nset xlabel '{}'\n"
      "set ylabel 'runs'\nset xrange [{}:{}]\nset yrange [0:*]\nunset key\n"
      "plot $h using 1:2 with boxes lc rgb '#0b3c6f'\n",
      0.9 * width, label, from, to);
  return figure(script, caption);
}

std::string row(const char* name, const Distribution& d, double scale, const char* unit) {
  if (d.empty()) return "";
  return fmt::format(
      "<tr><td>{}</td><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td>"
      "<td>{}</td></tr>\n",
      name, d.sorted.size(), d.min() * scale, d.quantile(0.5) * scale, d.quantile(0.95) * scale,
      d.max() * scale, unit);
}

std::string tile(const char* name, const std::string& value, const std::string& note) {
  return fmt::format("<div class=\"tile\"><span>{}</span><b>{}</b> <i>{}</i></div>\n", name, value,
                     note);
}

/// Four strips on one time axis: deflection, speed, states, spindle.
std::string trip_figure(const TripLog& log, const TripFigures& f, const Machine& machine) {
  const UsableRange range = usable_range(machine.probe);
  const double zero = std::isfinite(f.threshold) ? f.threshold : f.action;
  const double end = std::isfinite(f.standstill) ? f.standstill : f.action + 0.05;
  const double from = -0.25 * (end - zero) - 0.01, to = 1.3 * (end - zero) + 0.01;
  std::string deflection, states;
  for (std::size_t k = 1; k < log.size(); ++k) {
    const double t = seconds(static_cast<Tick>(k)) - zero;
    if (t < from || t > to) continue;
    for (std::size_t j = 0; j < kLoopStepsPerCycle; ++j) {
      const Vec3& d = log[k].deflection[j];
      deflection += fmt::format("{:.4f} {:.5f} {:.4f}\n",
                                (t - static_cast<double>(kLoopStepsPerCycle - 1 - j) * 1e-4) * 1e3,
                                d.norm() * 1e3, 100 * limit_share(machine.probe, d));
    }
    double commanded = 0, measured = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      commanded += std::pow(log[k].commanded[i] - log[k - 1].commanded[i], 2);
      measured += std::pow(log[k].measured[i] - log[k - 1].measured[i], 2);
    }
    // Of the cycle from t_k on: what is measured there, and what was commanded for it.
    states += fmt::format("{:.3f} {:.4f} {:.4f} {} {} {} {} {:.3f}\n", t * 1e3,
                          std::sqrt(measured) / kCycle * 1e3, std::sqrt(commanded) / kCycle * 1e3,
                          static_cast<int>(log[k].module), log[k].nc_alarm ? 1 : 0,
                          5 - log[k].drives_in_operation, log[k].spindle_locked ? 1 : 0,
                          log[k].spindle_speed);
  }
  const double smallest = std::min({range.positive.minCoeff(), range.negative.minCoeff()});
  std::string s =
      heading(940, 620) + "$d << EOD\n" + deflection + "EOD\n$s << EOD\n" + states + "EOD\n";
  s += fmt::format(
      "set multiplot\nset lmargin at screen 0.09\nset rmargin at screen 0.975\n"
      "set xrange [{:.4g}:{:.4g}]\nset format x ''\n",
      from * 1e3, to * 1e3);
  const auto strip = [&](double bottom, double top) {
    s += fmt::format("set bmargin at screen {}\nset tmargin at screen {}\n", bottom, top);
  };
  s += "set arrow 1 from 0, graph 0 to 0, graph 1 nohead lc rgb '#c0392b' dt 2\n";
  if (std::isfinite(f.action))
    s += fmt::format(
        "set arrow 2 from {0:.4f}, graph 0 to {0:.4f}, graph 1 nohead lc rgb "
        "'#1a8a6b' dt 2\n",
        (f.action - zero) * 1e3);
  strip(0.70, 0.97);
  s += fmt::format(
      "set ylabel 'deflection [mm]'\nset yrange [0:*]\nset offsets 0, 0, graph 0.3, 0\n"
      "plot $d using 1:2 with lines lw 1.6 lc rgb '#0b3c6f' title 'true deflection', "
      "{:.5g} with lines dt 3 lc rgb '#d9730d' title 'usable range, smallest'\n",
      smallest * 1e3);
  strip(0.42, 0.66);
  s += "set ylabel 'X, Y, Z [mm/s]'\n"
       "plot $s using 1:3 with steps lw 1.2 lc rgb '#8a8f98' title 'commanded for the next cycle', "
       "$s using 1:2 with steps lw 1.6 lc rgb '#0b3c6f' title 'measured'\n";
  strip(0.22, 0.38);
  s += "set ylabel 'module'\nunset offsets\nset yrange [-0.4:4.6]\n"
       "set ytics ('normal' 0, 'warn' 1, 'soft' 2, 'hard' 3)\n"
       "plot $s using 1:4 with steps lw 1.8 lc rgb '#7a4fa3' title 'overtravel module'\n";
  strip(0.07, 0.18);
  s += "set format x '%g'\nset xlabel 'time after the range was left [ms]'\nset ylabel ''\n"
       "set yrange [-0.4:5.4]\nset ytics ('drives' 0, 'NC unit' 1.6, 'spindle' 3.2)\nunset key\n"
       "plot $s using 1:($6/5.0) with steps lw 1.8 lc rgb '#c0392b' title 'drives out of "
       "operation', "
       "$s using 1:($5+1.6) with steps lw 1.8 lc rgb '#d9730d' title 'NC unit in alarm', "
       "$s using 1:($7+3.2) with steps lw 1.8 lc rgb '#1a8a6b' title 'spindle locked'\n"
       "unset multiplot\n";
  return s;
}

/// The run with the largest `value` among those for which it is a number.
template <class F>
const LockoutVerdict* largest(const LockoutResults& r, F&& value) {
  const LockoutVerdict* best = nullptr;
  double most = 0;
  for (const LockoutVerdict& v : r.verdicts) {
    const double x = v.figures.tripped() ? value(v) : kNever;
    if (std::isfinite(x) && (!best || x > most)) best = &v, most = x;
  }
  return best;
}

struct Example {
  const char* title;
  const LockoutVerdict* verdict;
};

std::vector<Example> examples(const LockoutResults& r) {
  std::vector<Example> all{
      {"Slowest reaction", largest(r,
                                   [](const LockoutVerdict& v) {
                                     return v.figures.countable ? v.figures.reaction() : kNever;
                                   })},
      {"Nearest to the mechanical limit, at a feed that was allowed",
       largest(r,
               [](const LockoutVerdict& v) {
                 return v.within_limit ? v.figures.limit_share : kNever;
               })},
      {"Deepest of all", largest(r, [](const LockoutVerdict& v) { return v.figures.deepest; })},
      {"A soft stop", largest(r, [](const LockoutVerdict& v) {
         return v.figures.soft && !v.figures.hard ? v.figures.speed : kNever;
       })}};
  for (const LockoutVerdict& v : r.verdicts)
    if (!v.passed() && !v.process && v.figures.tripped() && all.size() < 8)
      all.insert(all.begin(), {"Not as expected", &v});
  std::vector<Example> once;
  for (const Example& e : all)
    if (e.verdict && std::none_of(once.begin(), once.end(),
                                  [&](const Example& o) { return o.verdict == e.verdict; }))
      once.push_back(e);
  return once;
}

std::string example(const LockoutResults& r, const Example& e) {
  const auto item = std::find_if(r.items.begin(), r.items.end(),
                                 [&](const LockoutItem& i) { return i.id == e.verdict->id; });
  if (item == r.items.end()) return "";
  const LockoutFolder folder;
  TripLog log;
  run_lockout(item->id, item->scenario, {.work_folder = folder.path()}, log);
  const TripFigures& f = e.verdict->figures;
  std::string facts = fmt::format("{:.1f} mm/s; deepest {:.3f} mm, {:.1f} % of the limit, {:.1f} N",
                                  f.speed * 1e3, f.deepest * 1e3, f.limit_share * 100, f.force);
  if (std::isfinite(f.reaction())) facts += fmt::format("; reaction {:.3f} ms", f.reaction() * 1e3);
  if (std::isfinite(f.standstill - f.threshold))
    facts += fmt::format(", at rest after {:.1f} ms", (f.standstill - f.threshold) * 1e3);
  return fmt::format("<h3>{}: {} ({})</h3>\n", e.title, escaped(e.verdict->id),
                     escaped(e.verdict->name)) +
         figure(trip_figure(log, f, make_case(item->scenario).machine),
                escaped(facts) + fmt::format(". Cause: {}. Red: the range is left; green: the axes "
                                             "begin to brake. <code>vcnc lockout {}</code>",
                                             text_of(static_cast<ProtectionCause>(f.cause)),
                                             escaped(repeat_arguments(r, *e.verdict))));
}

/// Runs with a fault, by kind: how they ended.
std::string fault_table(const LockoutResults& r) {
  struct FaultRow {
    std::size_t runs = 0, unsafe = 0, borne = 0, soft = 0, quick = 0;
    double deepest = 0;  ///< share of the limit, where the feed check covers the way
  };
  std::map<std::string_view, FaultRow> rows;
  for (const LockoutVerdict& v : r.verdicts) {
    if (v.faults.empty() || v.process) continue;
    const BusFault fault = parse_fault(v.faults.front());
    const auto kind = std::find_if(fault_kinds().begin(), fault_kinds().end(),
                                   [&](const FaultKind& k) { return k.kind == fault.kind; });
    FaultRow& row = rows[kind->name];
    ++row.runs;
    row.unsafe += !v.passed();
    row.borne += v.end.complete;
    row.quick += v.figures.hard;
    row.soft += v.figures.soft && !v.figures.hard;
    if (v.within_limit) row.deepest = std::max(row.deepest, v.figures.limit_share);
  }
  if (rows.empty()) return "";
  std::string text =
      "<h2>Crashes with a fault</h2>\n<table><tr><th>kind</th><th>runs</th><th>not safe</th>"
      "<th>quick stops</th><th>soft stops</th><th>ended as if none</th>"
      "<th>deepest [% of the limit]</th></tr>\n";
  for (const auto& [kind, row] : rows)
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.1f}</td>"
        "</tr>\n",
        kind, row.runs, row.unsafe, row.quick, row.soft, row.borne, 100 * row.deepest);
  return text +
         "</table>\n<p class=\"lead\">Every run has one more fault than its crash, from 50 ms "
         "before the first touch up to the trip.</p>\n";
}

std::string failures(const LockoutResults& r) {
  std::string rows;
  std::size_t told = 0;
  for (const LockoutVerdict& v : r.verdicts) {
    if (v.passed() || ++told > 200) continue;
    std::string all;
    for (const std::string& sentence : v.failures) all += escaped(sentence) + "<br>";
    rows += fmt::format("<tr><td>{}<br>{}</td><td>{}<code>vcnc lockout {}</code></td></tr>\n",
                        escaped(v.id), escaped(v.name), all, escaped(repeat_arguments(r, v)));
  }
  return rows.empty() ? ""
                      : "<h2>Not as expected</h2>\n<table class=\"words\">\n" + rows + "</table>\n";
}

}  // namespace

std::string lockout_page(const LockoutResults& r) {
  const LockoutSummary& s = r.summary;
  const bool pass = s.as_expected == s.runs && !r.interrupted;
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Overtravel "
      "protection</title>\n<style>" +
      std::string(kStyle) + "</style></head><body><main>\n<h1>Overtravel protection</h1>\n";
  page += fmt::format(
      "<p class=\"lead\">{} simulated crashes, {} ordinary runs and {} crashes with a fault, seed "
      "{}</p>\n",
      s.crashes, s.ordinary, s.faulted, r.seed);
  page += fmt::format(
      "<div class=\"verdict {0}\"><b>{0}</b><span>{1} of {2} runs as expected; {3} missed trips, "
      "{4} "
      "trips in ordinary runs</span></div>\n",
      pass            ? "PASS"
      : r.interrupted ? "INTERRUPTED"
                      : "FAIL",
      s.as_expected, s.runs, s.missed, s.false_trips);
  page += "<div class=\"tiles\">\n";
  if (!s.reaction.empty())
    page += tile("reaction, worst", fmt::format("{:.3f} ms", s.reaction.max() * 1e3),
                 fmt::format("median {:.3f} ms", s.reaction.quantile(0.5) * 1e3));
  if (!s.limit_share.empty())
    page += tile("deepest", fmt::format("{:.1f} %", s.limit_share.max() * 100),
                 "of the mechanical limit");
  page += tile("stopped softly", std::to_string(s.soft),
               fmt::format("{} more became quick stops", s.both));
  page += tile("quick stops at once", std::to_string(s.hard),
               fmt::format("{} too fast to be counted", s.uncountable));
  page += tile("refused", std::to_string(s.refused), "before anything moved");
  if (s.faulted > 0)
    page += tile("with a fault", fmt::format("{} safe", s.faulted - s.unsafe),
                 fmt::format("{} not, {} ended as if none", s.unsafe, s.borne));
  page += "</div>\n";
  page += failures(r);
  page +=
      "<h2>Distributions</h2>\n<table><tr><th></th><th>runs</th><th>min</th><th>median</th>"
      "<th>95 %</th><th>max</th><th></th></tr>\n";
  page += row("out of range to braking axes", s.reaction, 1e3, "ms");
  page += row("hard stage to quick stop", s.hard_reaction, 1e3, "ms");
  page += row("out of range to locked spindle", s.lock_time, 1e3, "ms");
  page += row("out of range to stand-still", s.standstill_time, 1e3, "ms");
  page += row("stopping distance", s.stopping_distance, 1e3, "mm");
  page += row("deepest, share of the limit", s.limit_share, 100, "%");
  page += row("the same where it may pass it", s.unchecked_share, 100, "%");
  page += "</table>\n<div class=\"pair\">\n";
  page += histogram(s.reaction, 1e3, 0, 3, 30, "reaction [ms]",
                    "From the true deflection leaving the range to braking axes. A sample of cycle "
                    "k acts from t<sub>k+1</sub> on; from t<sub>k+2</sub> if one path is dead.");
  page += histogram(s.hard_reaction, 1e3, 0, 3, 30, "reaction [ms]",
                    "From the hard stage to all drives out of operation.");
  page +=
      histogram(s.stopping_distance, 1e3, 0,
                s.stopping_distance.empty() ? 1 : 1.05e3 * s.stopping_distance.max(), 30,
                "way [mm]", "Way of the controlled point from leaving the range to stand-still.");
  page += histogram(s.limit_share, 100, 0, 100, 25, "deepest deflection [% of the limit]",
                    "Where the feed check covers the way.");
  page += "</div>\n" + fault_table(r);
  if (s.processes > 0)
    page += "<h2>Real processes</h2>\n<pre>" + escaped(process_table(r)) + "</pre>\n";
  page += "<h2>Trips</h2>\n";
  for (const Example& e : examples(r)) page += example(r, e);
  return page + "</main></body></html>\n";
}

}  // namespace vcnc
