#include "apps/gallery_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "analysis/gallery_figures.hpp"
#include "analysis/html.hpp"
#include "analysis/plot.hpp"

namespace vcnc {

const std::string_view kGalleryMark = "<!-- Written by vcnc gallery. -->";

namespace {

using html::escaped;

constexpr const char* kGalleryStyle = R"(
@page { size: A4 portrait; margin: 11mm 12mm; }
main { max-width: 1000px; }
h1 { font-size: 34px; margin-bottom: 4px; }
h2.family { font-size: 13px; letter-spacing: 0.16em; text-transform: uppercase; color: #fff; background: #0b3c6f; border: 0; border-radius: 4px; padding: 6px 14px; margin: 40px 0 14px; }
nav { columns: 4; column-gap: 22px; font-size: 13px; margin: 22px 0 0; border-top: 2px solid #0b3c6f; padding-top: 12px; }
nav div { break-inside: avoid; margin-bottom: 10px; } nav b { display: block; font-size: 11px; letter-spacing: 0.12em; text-transform: uppercase; color: var(--soft); }
nav a { display: block; color: #0b3c6f; text-decoration: none; line-height: 1.45; }
article { border: 1px solid var(--line); border-radius: 8px; padding: 14px 18px 12px; margin: 0 0 16px; break-inside: avoid; }
article header { display: flex; justify-content: space-between; align-items: flex-start; gap: 24px; }
h3 { font-size: 21px; font-weight: 650; margin: 0; letter-spacing: -0.01em; }
.brief { margin: 1px 0 0; color: var(--soft); font-size: 14px; }
.number { text-align: right; min-width: 190px; max-width: 46%; }
.number b { display: block; font-size: 23px; font-weight: 650; color: #d9730d; line-height: 1.15; }
.number b.long { font-size: 16px; }
.number span { display: block; font-size: 12.5px; color: var(--soft); }
article figure { margin: 8px -6px 2px; }
.setting { font-size: 12.5px; color: var(--soft); margin: 0 0 8px; border-bottom: 1px solid var(--line); padding-bottom: 8px; }
.setting code { color: var(--ink); font-size: 12px; }
.columns { display: grid; grid-template-columns: 1fr 1fr; gap: 22px; }
h4 { font-size: 11px; letter-spacing: 0.1em; text-transform: uppercase; color: #0b3c6f; margin: 0 0 3px; }
.columns p, .columns pre { margin: 0 0 8px; font-size: 13px; line-height: 1.42; } .columns pre { white-space: pre-wrap; }
.columns pre { font: 12px/1.42 "DejaVu Sans Mono", Menlo, Consolas, monospace; }
.source { font-size: 12px; color: var(--soft); margin: 2px 0 0; }
.trouble { background: #fffaf0; border: 1px solid #ecd9b4; border-radius: 4px; padding: 5px 10px; font-size: 13px; margin: 8px 0 0; }
@media print {
  h1 { font-size: 26px; } nav { font-size: 10.5px; } h2.family { margin: 0 0 8px; break-before: page; break-after: avoid; -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  article figure svg { width: 93%; margin: 0 auto; } article figure { margin: 3px 0 0; }
  article { margin-bottom: 9px; padding: 9px 12px 7px; } h3 { font-size: 16px; } .brief, .number span { font-size: 10.5px; }
  .number b { font-size: 17px; } .columns p { font-size: 10px; } .columns pre { font-size: 9.2px; } .setting, .setting code, .source { font-size: 9.5px; } nav a { color: inherit; }
}
)";

std::string x_label(const Demonstration& d) {
  switch (d.with.abscissa) {
    case Abscissa::angle:
      return "angle on the circle  [deg]";
    case Abscissa::position:
      return fmt::format("position of {}  [{}]", kAxisNames[d.with.axis],
                         abscissa_scale_of(d).unit);
    case Abscissa::time:
      return "time  [s]";
    case Abscissa::station:
      break;
  }
  return d.with.showing == Showing::corner ? "way around the square  [mm]"
                                           : "station on the path  [mm]";
}

std::string y_label(const Demonstration& d) {
  const char* unit = scale_of(d).unit;
  const std::string_view axis = kAxisNames[d.with.axis];
  switch (d.quantity) {
    case Quantity::machine_error:
      if (d.with.lever != 1) return fmt::format("error along {}  [{}]", axis, unit);
      return fmt::format("e_n - e_{{plan}}  [{}]", unit);
    case Quantity::total_error:
      return fmt::format("e_n  [{}]", unit);
    case Quantity::following:
      return fmt::format("following error {}  [{}]", axis, unit);
    case Quantity::force:
      return fmt::format("force {}  [{}]", axis, unit);
    case Quantity::free_reading:
      return fmt::format("reading in the air  [{}]", unit);
    case Quantity::contour:
      break;
  }
  return fmt::format("off the square  [{}]", unit);
}

/// How the experiment moves, for the line below the figure.
std::string motion_of(const Demonstration& d) {
  const std::string_view axis = kAxisNames[d.with.axis];
  const double feed = d.with.passes.empty() ? 0 : d.with.passes.front().feed;
  const std::string speed = is_rotary(d.with.axis) && d.with.showing == Showing::spin
                                ? fmt::format("{:.0f} deg/s", feed / kDegree)
                                : fmt::format("{:.0f} mm/min", feed * 60e3);
  switch (d.with.showing) {
    case Showing::circle:
      return fmt::format("Circle of 25 mm radius inside a ring, {}", speed);
    case Showing::circle_feeds:
      return "Circle of 25 mm radius inside a ring at three feeds";
    case Showing::line:
      if (!d.with.piece) return fmt::format("{} alone, there and back, {}", axis, speed);
      return d.with.lever != 1
                 ? fmt::format("Along a wall at 45 deg to {}, there and back, {}", axis, speed)
                 : fmt::format("{} along a wall, there and back, {}", axis, speed);
    case Showing::reversals:
      return fmt::format("Reversals of {}, {}", axis, speed);
    case Showing::standstill:
      return "The ball rests on a wall";
    case Showing::spin:
      return fmt::format("{} turns, the ball is held on the piece, {}", axis, speed);
    case Showing::s_piece:
      return fmt::format("One lap of the S piece, {}", speed);
    case Showing::corner:
      break;
  }
  return fmt::format("Square of 20 mm, G64 P0.02, {}", speed);
}

std::string draw(const Demonstration& d, std::vector<Curve> without, std::vector<Curve> with,
                 std::string& why) {
  GalleryFigure f;
  f.x_label = x_label(d);
  f.y_label = y_label(d);
  f.x_scale = 1 / abscissa_scale_of(d).to_si;
  f.y_scale = 1 / scale_of(d).to_si;
  f.y_unit = scale_of(d).unit;
  f.polar = d.with.abscissa == Abscissa::angle && d.quantity != Quantity::force;
  f.without = std::move(without);
  f.with = std::move(with);
  const auto svg = draw_svg(gallery_figure(f), why);
  return svg.value_or("");
}

std::string trouble_of(const Observation& without, const Observation& with) {
  if (!without.clean())
    return "The machine without the effect stopped: " + without.nc.end.reason + ".";
  if (!with.nc.end.complete) return "With the effect the machine stopped: " + with.nc.end.reason;
  if (!with.alarms.empty()) return "With the effect the machine said: " + with.alarms.front().text;
  return "";
}

std::string card(const GalleryEntry& entry) {
  const Demonstration& d = entry.demonstration;
  const EffectText& t = *d.text;
  std::string text =
      fmt::format("<article id=\"{}\"><header><div><h3>{}</h3><p class=\"brief\">{}</p></div>",
                  t.name, escaped(t.title), escaped(t.brief));
  if (!entry.readings.empty()) {
    const Reading& first = entry.readings.front();
    text += fmt::format("<div class=\"number\"><b{}>{}</b><span>{}",
                        first.value.size() > 18 ? " class=\"long\"" : "", escaped(first.value),
                        escaped(first.name));
    for (std::size_t i = 1; i < entry.readings.size(); ++i)
      if (entry.readings[i].name != first.name)
        text += fmt::format("<br>{} {}", escaped(entry.readings[i].name),
                            escaped(entry.readings[i].value));
    text += "</span></div>";
  }
  text += "</header>\n";
  if (!entry.trouble.empty())
    text += fmt::format("<p class=\"trouble\">{}</p>\n", escaped(entry.trouble));
  if (!entry.svg.empty()) text += "<figure>" + entry.svg + "</figure>\n";
  text += fmt::format(
      "<p class=\"setting\">{}. Effect: <code>{}</code> on {}, <code>{}</code>.{}</p>\n",
      motion_of(d), t.name, escaped(d.where), escaped(d.setting),
      d.prepared.empty() ? "" : fmt::format(" Both runs: {}.", escaped(d.prepared)));
  text += fmt::format(
      "<div class=\"columns\"><div><h4>Equation</h4><pre>{}</pre></div>"
      "<div><h4>Signature</h4><p>{}</p><h4>Told apart</h4><p>{}</p></div></div>\n",
      escaped(t.equation), escaped(t.signature), escaped(t.separate));
  return text + fmt::format("<p class=\"source\">{} Source: {}.</p></article>\n",
                            escaped(t.validity), escaped(t.source));
}

}  // namespace

GalleryEntry gallery_entry(std::string_view effect, const Machine& machine, bool with_picture) {
  GalleryEntry entry{demonstration(effect, machine), {}, "", ""};
  const Demonstration& d = entry.demonstration;
  const Observation without = observe(d.without), with = observe(d.with);
  entry.trouble = trouble_of(without, with);
  std::vector<Curve> before = curves(d.without, without, d.quantity);
  std::vector<Curve> after = curves(d.with, with, d.quantity);
  entry.readings = readings(d, before, after);
  std::string why;
  if (with_picture) entry.svg = draw(d, std::move(before), std::move(after), why);
  if (!why.empty() && entry.trouble.empty()) entry.trouble = why;
  return entry;
}

std::string gallery_page(const std::vector<GalleryEntry>& entries, const Machine& machine,
                         const std::string& note) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n{}\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>Effects of a machine tool</title>\n<style>{}{}</style></head>\n<body><main>\n",
      kGalleryMark, html::kPageStyle, kGalleryStyle);
  page += fmt::format(
      "<h1>Effects of a machine tool</h1>\n<p class=\"lead\">What {} {} like in a measurement. "
      "Each "
      "figure shows one short program on the machine \"{}\", grey without and coloured with the "
      "effect at its nominal size; the number is read off the figure.</p>\n",
      entries.size() == 1 ? "one effect" : fmt::format("{} effects", entries.size()),
      entries.size() == 1 ? "looks" : "look", escaped(machine.name));
  if (!note.empty()) page += fmt::format("<p class=\"trouble\">{}</p>\n", escaped(note));
  const auto family = [](const GalleryEntry& e) { return e.demonstration.text->family; };
  page += "<nav>";
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || family(entries[i]) != family(entries[i - 1]))
      page += fmt::format("{}<div><b>{}</b>", i ? "</div>" : "", name_of(family(entries[i])));
    const EffectText& t = *entries[i].demonstration.text;
    page += fmt::format("<a href=\"#{}\">{}</a>", t.name, escaped(t.title));
  }
  page += entries.empty() ? "</nav>\n" : "</div></nav>\n";
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || family(entries[i]) != family(entries[i - 1]))
      page += fmt::format("<h2 class=\"family\">{}</h2>\n", name_of(family(entries[i])));
    page += card(entries[i]);
  }
  return page + "</main></body></html>\n";
}

}  // namespace vcnc
