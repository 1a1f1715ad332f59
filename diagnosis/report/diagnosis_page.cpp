#include "diagnosis/report/diagnosis_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/html.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/report/diagnosis_figures.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "diagnosis/report/shown_law.hpp"

namespace vcnc {

const std::string_view kDiagnosisMark = "<!-- Written by vcnc diagnose. -->";

namespace {

using namespace html;

constexpr std::size_t kShownChannels = 6, kShownCovariates = 3;
constexpr double kWorthShowing = 0.02;  ///< of the residual's variance

constexpr const char* kDiagnosisStyle = R"(
.verdict.good { --c: var(--pass); } .verdict.bad { --c: var(--fail); } .verdict.open { --c: var(--open); }
.effect { border: 1px solid var(--line); border-left: 5px solid #0b3c6f; border-radius: 6px; padding: 10px 16px; margin: 12px 0; }
.effect.minor { border-left-color: #8a8f98; } .effect h3 { margin: 0 0 4px; font-size: 16px; }
.effect h3 small { font-weight: 400; color: var(--soft); } .effect p { margin: 4px 0; font-size: 14px; }
.effect td, .effect th { text-align: left; }
.bar { position: relative; height: 10px; width: 180px; background: #eef1f4; border-radius: 5px; }
.bar i { position: absolute; top: 2px; height: 6px; background: #0b3c6f; border-radius: 3px; min-width: 2px; }
.bar u { position: absolute; top: -2px; bottom: -2px; width: 1px; background: #1d232b; }
td.better { color: #1a8a6b; font-weight: 600; }
)";

const char* verdict_class(DiagnosisVerdict v) {
  switch (v) {
    case DiagnosisVerdict::explained:
    case DiagnosisVerdict::no_deviation:
      return "good";
    case DiagnosisVerdict::unexplained:
      return "bad";
    case DiagnosisVerdict::partly:
    case DiagnosisVerdict::not_identifiable:
    case DiagnosisVerdict::interrupted:
      break;
  }
  return "open";
}

/// The interval between zero and its far end, with a tick at zero.
std::string interval_bar(const FittedNumber& n) {
  const double low = std::min(0.0, n.low), high = std::max(0.0, n.high);
  if (!(n.high > n.low) || !std::isfinite(high - low)) return "";
  const auto share = [&](double v) { return (v - low) / (high - low) * 100; };
  return fmt::format(
      "<div class=\"bar\"><u style=\"left:{:.1f}%\"></u><i "
      "style=\"left:{:.1f}%;width:{:.1f}%\"></i>"
      "</div>",
      share(0), share(n.low), share(n.high) - share(n.low));
}

std::string effect_box(const FoundEffect& e, const Diagnosis& d) {
  const bool deviation = e.name == "deviation";
  std::string text = fmt::format(
      "<div class=\"effect{}\"><h3>{} <small>{}{}</small></h3>\n<table><tr><th>number</th>"
      "<th>value [95 % interval]</th><th>unit</th><th>from 0</th></tr>\n",
      e.minor ? " minor" : "", escaped(deviation ? "declared number" : e.name),
      deviation ? "out of tolerance" : "at " + escaped(e.place),
      e.minor         ? ", of no consequence for the contour"
      : e.acquisition ? ", of the measurement"
                      : "");
  for (const FittedNumber& n : e.numbers)
    text += fmt::format(
        "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(n.key),
        deviation ? with_interval(n) + ", " + against_declared(n, d) : with_change(n, d),
        escaped(unit_of_key(n.key)), interval_bar(n));
  text += "</table><p>";
  if (std::isfinite(e.gain))
    text += fmt::format("Chi-square gained on what was held out: {:.3g}. ", e.gain);
  if (e.contour_error_um != 0)
    text += fmt::format("Contour error: {:+.3g} µm rms.", e.contour_error_um);
  text += "</p>\n";
  if (!e.class_with.empty()) {
    std::string others;
    for (const std::string& c : e.class_with) others += (others.empty() ? "" : ", ") + escaped(c);
    text += "<p>This run cannot tell it from: " + others + ".";
    if (!e.separating_program.empty())
      text += " <code>vcnc program " + escaped(e.separating_program) +
              "</code>, at another feed or size if this is one, may.";
    text += "</p>\n";
  }
  return text + "</div>\n";
}

std::string uncertain_section(const std::vector<FittedNumber>& all) {
  if (all.empty()) return "";
  std::string text =
      "<h2>Declared as uncertain</h2>\n<table><tr><th>number</th><th>value [95 % interval]</th>"
      "<th>unit</th></tr>\n";
  for (const FittedNumber& n : all)
    text += fmt::format("<tr><td><code>{}</code></td><td>{}</td><td>{}</td></tr>\n", escaped(n.key),
                        with_interval(n), escaped(unit_of_key(n.key)));
  return text + "</table>\n";
}

std::string figure_row(const SignalFigure& f) {
  const ShownUnit unit = shown_unit(f.channel);
  return fmt::format(
      "<tr><td>{}</td><td>{}</td><td>{:.4g}</td><td{}>{:.4g}</td><td>{}</td><td>{}</td></tr>\n",
      channel_name(f.channel), escaped(f.run), f.before * unit.factor,
      f.after < 0.95 * f.before ? " class=\"better\"" : "", f.after * unit.factor,
      f.floor > 0 ? fmt::format("{:.4g}", f.floor * unit.factor) : "–", unit.name);
}

std::string figures_section(const std::vector<SignalFigure>& figures) {
  constexpr const char* head =
      "<table><tr><th>signal</th><th>run</th><th>before</th><th>after</th><th>noise</th>"
      "<th>unit</th></tr>\n";
  std::string changed, same;
  std::size_t unchanged = 0;
  for (const SignalFigure& f : figures) {
    // Of a signal that is not there, rounding is all that is left.
    if (std::max(f.before, f.after) < 1e-3 * f.floor) continue;
    const bool moved = std::abs(f.after - f.before) > 0.05 * std::max(f.before, f.floor);
    (moved ? changed : same) += figure_row(f);
    unchanged += !moved;
  }
  std::string text = changed.empty() ? "" : head + changed + "</table>\n";
  if (unchanged > 0)
    text += fmt::format(
        "<details{}><summary>{} within 5 % of what {} before, or of the noise</summary>\n{}{}"
        "</table></details>\n",
        changed.empty() ? " open" : "",
        unchanged == 1 ? "one row" : fmt::format("{} rows", unchanged),
        unchanged == 1 ? "it was" : "they were", head, same);
  return text;
}

double energy(const std::vector<double>& value) {
  double square = 0;
  for (const double v : value)
    if (std::isfinite(v)) square += v * v;
  return square;
}

/// Channels with something to see, those first that changed most.
std::vector<std::size_t> shown_channels(const ModelResiduals& r) {
  std::vector<double> ratio;
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < r.channels.size(); ++c) {
    const double after = energy(r.after[c]);
    ratio.push_back(after > 0 ? energy(r.before[c]) / after : 0);
    if (energy(r.before[c]) > 0) order.push_back(c);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return ratio[a] > ratio[b]; });
  if (order.size() > kShownChannels) order.resize(kShownChannels);
  return order;
}

/// Of a channel that is off, or that still is when everything was added.
enum class Off { before, after };

std::string correlation_section(const DiagnosisStory& story, std::size_t c, Off when) {
  const ModelResiduals& r = story.residuals;
  const std::vector<RelatedQuantity> all = related_quantities(story.record);
  std::vector<std::pair<double, std::size_t>> shares;
  for (std::size_t i = 0; i < all.size(); ++i)
    shares.emplace_back(explained_by(all[i], when == Off::before ? r.before[c] : r.after[c]), i);
  std::stable_sort(shares.begin(), shares.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text = fmt::format(
      "<h2>What {} goes along with</h2>\n<p>Share of the variance of {} that its means over a "
      "quantity explain; going along is no cause.</p>\n<table><tr><th>quantity</th><th>before</th>"
      "<th>after</th></tr>\n",
      when == Off::before ? "it" : "is left", channel_name(r.channels[c]));
  for (std::size_t i = 0; i < std::min<std::size_t>(shares.size(), 2 * kShownCovariates); ++i)
    text += fmt::format("<tr><td>{}</td><td>{:.1f} %</td><td>{:.1f} %</td></tr>\n",
                        escaped(all[shares[i].second].name), shares[i].first * 100,
                        explained_by(all[shares[i].second], r.after[c]) * 100);
  text += "</table>\n";
  for (std::size_t i = 0; i < std::min(shares.size(), kShownCovariates); ++i)
    if (shares[i].first > kWorthShowing)
      text +=
          figure(correlation_figure(all[shares[i].second], r.channels[c], r.before[c], r.after[c]),
                 fmt::format("Mean residual of {} over {}.", channel_name(r.channels[c]),
                             escaped(all[shares[i].second].name)));
  return text;
}

std::string size_cell(const Excitation& e, double limit) {
  return e.excited && std::isfinite(limit) ? fmt::format("{:.3g} {}", limit, unit_of_key(e.key))
                                           : std::string("not excited");
}

std::string excitation_section(const std::vector<Excitation>& all) {
  if (all.empty()) return "";
  const bool found = std::any_of(all.begin(), all.end(),
                                 [](const Excitation& e) { return e.beside_found.has_value(); });
  std::string text = fmt::format(
      "<h2>What this run could have shown</h2>\n<table><tr><th>candidate</th><th>smallest size "
      "that would show</th>{}<th>program that would show it</th></tr>\n",
      found ? "<th>beside what else was found</th>" : "");
  for (const Excitation& e : all) {
    const std::string beside = !e.beside_found ? ""
                               : e.excited && !std::isfinite(*e.beside_found)
                                   ? "hidden"
                                   : size_cell(e, *e.beside_found);
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td>{}<td>{}</td></tr>\n", escaped(e.name),
        size_cell(e, e.detection_limit), found ? "<td>" + beside + "</td>" : "",
        e.program.empty() ? std::string() : "<code>vcnc program " + escaped(e.program) + "</code>");
  }
  return text + "</table>\n";
}

std::string list_section(const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string text = fmt::format("<h2>{}</h2>\n<ul class=\"warnings\">\n", title);
  for (const std::string& l : lines) text += "<li>" + escaped(l) + "</li>\n";
  return text + "</ul>\n";
}

std::string law_section(const LearnedLaw& law, bool first) {
  std::string text =
      fmt::format("<h2>{}</h2>\n<p>", first ? "A law without a name" : "A further law") +
      escaped(law_words({law})) +
      fmt::format(", which takes {:.0f} % of what {} left.</p>\n", 100 * law.share,
                  first ? "is otherwise" : "those before have") +
      figure(law_figure(law),
             "f, as it was learned, with the band of 95 %: " + law_numbers(law) + ".");
  if (law.not_distinguishable_from.empty()) return text;
  text += "<p>This run cannot tell it from:";
  for (const std::string& n : law.not_distinguishable_from)
    text.append(" ").append(escaped(n)).append(";");
  text.back() = '.';
  return text + "</p>\n";
}

}  // namespace

std::string diagnosis_page(const DiagnosisStory& story) {
  const Diagnosis& d = story.diagnosis;
  const double seconds = static_cast<double>(story.record.samples()) * story.record.period;
  std::string page = fmt::format(
      "<!DOCTYPE html>\n{}\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>Diagnosis of {}</title>\n<style>{}{}</style></head>\n<body><main>\n",
      kDiagnosisMark, escaped(story.record.source), kPageStyle, kDiagnosisStyle);
  page += fmt::format(
      "<h1>Diagnosis</h1>\n<p class=\"lead\">{}: {:.2f} s at {:.6g} Hz, {} motions; against {} "
      "({}).</p>\n<div class=\"verdict {}\"><b>{}</b><span>{}</span></div>\n",
      escaped(story.record.source), seconds, 1 / story.record.period, story.record.stretches.size(),
      escaped(d.declared.name),
      d.differential ? "differential: what a healthy run has besides is taken off"
                     : "absolute: all that differs from the declared model",
      verdict_class(d.verdict), to_string(d.verdict), escaped(verdict_sentence(d)));
  if (const std::string axes = axes_told(d); !axes.empty())
    page += fmt::format("<p>{}.</p>\n", escaped(axes));
  if (!d.suspects.empty())
    page += fmt::format("<p>Sought was nothing but {}.</p>\n",
                        escaped(fmt::to_string(fmt::join(d.suspects, ", "))));
  if (!d.effects.empty()) {
    page += "<h2>What was found</h2>\n";
    for (const FoundEffect& e : d.effects) page += effect_box(e, d);
  }
  page += uncertain_section(d.uncertain);
  for (const LearnedLaw& law : d.laws) page += law_section(law, &law == d.laws.data());
  const std::vector<std::size_t> shown = shown_channels(story.residuals);
  if (!shown.empty())
    page += "<h2>Measured less predicted</h2>\n" +
            figure(residual_figure(story.record, story.residuals, shown),
                   "Before: the declared machine. After: with what was found. Gaps are outside the "
                   "laps, or an axis at rest.");
  if (!d.figures.empty()) page += "<h2>Before and after</h2>\n" + figures_section(d.figures);
  if (!shown.empty()) {
    page += correlation_section(story, shown.front(), Off::before);
    const std::vector<ComparedChannel>& channels = story.residuals.channels;
    if (d.still_off && *d.still_off != channels[shown.front()])
      page += correlation_section(
          story,
          static_cast<std::size_t>(std::find(channels.begin(), channels.end(), *d.still_off) -
                                   channels.begin()),
          Off::after);
  }
  if (d.ladder.size() > 1)
    page += "<h2>One effect after the other</h2>\n" +
            figure(ladder_figure(d.ladder), "What is left of chi-square on what was held out.");
  page += list_section("Warnings", d.warnings) + list_section("Notes", d.notes);
  page += excitation_section(d.excitation);
  return page + "</main></body></html>\n";
}

}  // namespace vcnc
