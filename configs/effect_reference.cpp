#include "configs/effect_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "configs/spelling.hpp"
#include "model/effects/law.hpp"
#include "model/effects/list.hpp"
#include "model/effects/numbers.hpp"
#include "model/effects/port_list.hpp"

namespace vcnc {

namespace {

// ------------------------------------------------------------------------- the list as data

struct Row {
  std::string key, unit, doc;
  double to_si = 1;
  Range range;
  std::string by_default, nominal;  ///< as in a machine file
};

/// The places of an effect that have the same keys.
struct Seating {
  std::vector<std::string_view> places;
  std::vector<Row> rows;
};

struct Entry {
  EffectText text;
  std::string_view port;
  bool dissipative = false;
  std::vector<Seating> seatings;
};

/// Rounded as people write it.
std::string value_text(const EffectNumber& n) {
  const auto text = [&](int i) { return fmt::format("{:.10g}", n.get(i) / n.unit.to_si); };
  if (n.size() == 1) return text(0);
  return fmt::format("[{}, {}, {}]", text(0), text(1), text(2));
}

template <class Effect>
std::vector<Row> rows_of(bool rotary) {
  Effect null, nominal = nominal_of<Effect>(rotary);
  const std::vector<EffectNumber> by_default = numbers_of(null, rotary),
                                  typical = numbers_of(nominal, rotary);
  std::vector<Row> rows;
  for (std::size_t i = 0; i < typical.size(); ++i) {
    const EffectNumber& n = typical[i];
    rows.push_back({n.key, std::string(n.unit.suffix), n.doc, n.unit.to_si, n.range,
                    value_text(by_default[i]), value_text(n)});
  }
  return rows;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = [] {
    std::vector<Entry> list;
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      Entry entry{.text = Effect::text, .port = Effect::Port::name, .seatings = {}};
      if constexpr (requires { Effect::dissipative; }) entry.dissipative = Effect::dissipative;
      for (const EffectPlace& place : places_of(Effect::place)) {
        const bool same_keys =
            !entry.seatings.empty() && (Effect::place != Place::axis || place.axis != kA);
        if (!same_keys) entry.seatings.push_back({{}, rows_of<Effect>(place.rotary)});
        entry.seatings.back().places.push_back(place.name);
      }
      list.push_back(std::move(entry));
    });
    return list;
  }();
  return all;
}

const Entry& find(std::string_view name) {
  const Entry* nearest = nullptr;
  std::size_t fewest = ~std::size_t{0};
  for (const Entry& entry : entries()) {
    if (entry.text.name == name) return entry;
    const std::size_t edits = edit_distance(name, entry.text.name);
    const bool part = name.size() > 2 && entry.text.name.find(name) != std::string_view::npos;
    if (edits > std::max<std::size_t>(name.size() / 3, 1) && !part) continue;
    if (edits < fewest) fewest = edits, nearest = &entry;
  }
  throw InputError(fmt::format(
      "vcnc effects show {}: no such effect; {}", name,
      nearest ? fmt::format("did you mean {}?", nearest->text.name) : "vcnc effects lists all"));
}

constexpr Family kFamilies[]{
    Family::servo, Family::friction, Family::mechanics,   Family::geometry, Family::thermal,
    Family::probe, Family::setup,    Family::acquisition, Family::bus,      Family::nc};

std::string_view seen_in(Showing showing) {
  switch (showing) {
    case Showing::circle:
      return "a circle in both directions";
    case Showing::circle_feeds:
      return "a circle at three feeds";
    case Showing::line:
      return "a slow line there and back";
    case Showing::reversals:
      return "small reversals";
    case Showing::standstill:
      return "the ball at rest on the piece";
    case Showing::spin:
      return "a turn of the rotary axis about the ball";
    case Showing::s_piece:
      return "a lap of the S piece";
    case Showing::corner:
      return "the corners of a square";
  }
  return "";
}

// ------------------------------------------------------------------------------- text tools

std::string bounds(const Row& row) {
  return fmt::format("{:g} .. {:g}", row.range.min, row.range.max);
}

std::string joined(const std::vector<std::string_view>& words, std::string_view between) {
  return fmt::format("{}", fmt::join(words, between));
}

constexpr char kHard = '\x1f';  // a blank at which no line ends

/// The words of a text in lines of at most `width` characters; all but the first are indented.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string out;
  std::size_t used = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (used > 0 && used + 1 + end > width) {
      out.append(1, '\n').append(indent, ' ');
      used = 0;
    }
    if (used > 0) out += ' ';
    out += text.substr(0, end);
    used += (used > 0 ? 1 : 0) + end;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  std::replace(out.begin(), out.end(), kHard, ' ');
  return out;
}

/// A text that must not be broken.
std::string hard(std::string text) {
  std::replace(text.begin(), text.end(), ' ', kHard);
  return text;
}

/// The text as a sentence.
std::string sentence(std::string_view text) {
  return fmt::format("{}{}", text, text.ends_with('.') ? "" : ".");
}

/// Every line of a text behind two blanks.
std::string block(std::string_view text) {
  std::string out = "  ";
  for (const char c : text) {
    out += c;
    if (c == '\n') out += "  ";
  }
  return out + "\n";
}

/// A text written as one line is broken; one written as lines stays as it is.
std::string prose(std::string_view text) {
  return block(text.find('\n') == text.npos ? wrapped(text, 98, 0) : std::string(text));
}

std::string heading(std::string_view title) { return fmt::format("\n{}\n", title); }

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> all;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (end > 0) all.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return all;
}

std::string injection(const Entry& entry) {
  const Seating& seating = entry.seatings.front();
  std::string options;
  for (const Row& row : seating.rows) {
    if (row.nominal == row.by_default) continue;
    const std::string assignment =
        fmt::format("{}.{}.{}={}", seating.places.front(), entry.text.name, row.key, row.nominal);
    const bool quoted = assignment.find(' ') != std::string::npos;
    options += fmt::format("{}--inject {}{}{}", options.empty() ? "" : " ", quoted ? "'" : "",
                           assignment, quoted ? "'" : "");
  }
  return options;
}

// ------------------------------------------------------------------------------------- ports

struct PortDoc {
  std::string_view name, when, where, signal;
};

constexpr PortDoc kPortDocs[]{
    {PlanPort::name, "at the start", "NC unit", "tolerances of the planner"},
    {InterpolationPort::name, "every 1 ms", "NC unit", "set-points of all axes"},
    {ReceptionPort::name, "every 1 ms", "drive", "the set-point a drive takes from the bus"},
    {SetpointPort::name, "every 100 us", "drive", "the set-point of the loops"},
    {ServoPort::name, "at the start", "drive", "gains and limits of the loops"},
    {EncoderPort::name, "at every reading", "drive", "the position a measuring system counts"},
    {MotorForcePort::name, "every 50 us", "drive", "force of the motor"},
    {TransmissionPort::name, "at the start", "drive", "gap, compliance and damping, uneven ratio"},
    {LoadForcePort::name, "every 50 us", "drive", "further force on the table"},
    {FrictionPort::name, "every 50 us", "drive", "terms of the friction law"},
    {DisplacementPort::name, "every 100 us", "drive", "tool centre against scale, along the axis"},
    {PosePort::name, "every 100 us", "probe module", "errors of guides, axis lines and piece"},
    {TouchPort::name, "every 100 us", "probe module", "the ball and its contact"},
    {DeflectionPort::name, "every 100 us", "probe module", "what the sensor feels"},
    {AnaloguePort::name, "every 100 us", "probe module", "sine and cosine of one channel [V]"},
    {ReadingPort::name, "every 100 us", "probe module", "what the counters say"},
};

const PortDoc& doc_of(std::string_view port) {
  return *std::find_if(std::begin(kPortDocs), std::end(kPortDocs) - 1,
                       [&](const PortDoc& doc) { return doc.name == port; });
}

// -------------------------------------------------------------------------------------- laws

struct LawPointDoc {
  std::string_view name;
  Law::Point point;
  std::string_view port, what;
};

constexpr LawPointDoc kLawPoints[]{
    {"command", Law::Point::command, SetpointPort::name, "added to the set-point of the loops"},
    {"command_time", Law::Point::command_time, SetpointPort::name,
     "the set-point is taken later by this"},
    {"motor_force", Law::Point::motor_force, MotorForcePort::name, "added to the motor's force"},
    {"table_force", Law::Point::table_force, LoadForcePort::name,
     "added to the force on the table"},
    {"displacement", Law::Point::displacement, DisplacementPort::name,
     "added to the tool centre's position"},
    {"reading", Law::Point::reading, ReadingPort::name,
     "added to the probe's reading; axis X, Y, Z is its component"},
};

std::string law_key(const LawPointDoc& doc) {
  const std::string linear = fmt::format("`value_{}`", Law::unit_of(doc.point, false).suffix),
                    rotary = fmt::format("`value_{}`", Law::unit_of(doc.point, true).suffix);
  if (doc.point == Law::Point::reading) return linear + " (not A, C)";
  return linear == rotary ? linear : linear + ", " + rotary + " (A, C)";
}

constexpr std::string_view kLawIntroduction = R"(## Laws: what is not in the library

Any function of the machine's state, or any time series, can be added at one of six points of an
axis and runs through the closed loop:

    y = m f(c)

`f` is piecewise linear through the knots (`at_UNIT`, `value_UNIT`) and constant beyond its ends.
`over` is its argument c: `time` (knots `at_s`), or `position`, `velocity`, `acceleration` of
`over_axis` (`at_mm`, `at_mm_s`, `at_mm_s2`; of A and C `at_deg`, `at_deg_s`, `at_deg_s2`).
`times` is the factor m: `one`, or `sign`, `position`, `velocity`, `acceleration` of `times_axis`
(the sign of its velocity, else its value in SI), or `forwards`, `backwards` (1 while it goes that
way, else 0). Laws act after the effects of the same port. A drive knows the true motion of its own
axis and the commanded motion of the others; the probe knows the true motion of all.

| point | port | y is | values |
|---|---|---|---|
)";

constexpr std::string_view kLawExample = R"(
A dirty stretch of guide: friction that rises by 150 N between x = 90 and 110 mm, against the
motion:

```toml
[[effects.law]]
label = "chips under the wiper"
axis = "X"
point = "table_force"
over = "position"
over_axis = "X"
at_mm = [90, 95, 105, 110]
value_N = [0, -150, -150, 0]
times = "sign"
times_axis = "X"
```

## Deviations: the machine is not as its file says

`--inject axes.Y.load_kg=550` gives a declared number another true value. Only the simulators have
it; the controller's feed-forward, the analysis and the NC unit go on with the declared one, except
where the number is the NC unit's own setting (`nc.*`, velocity, acceleration and jerk of an axis).
In a machine file:

```toml
[[effects.deviation]]
key = "axes.Y.load_kg"
value = 550
```
)";

// ------------------------------------------------------------------------------------- JSON

std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += fmt::format("\\{}", c);
    else if (c == '\n')
      out += "\\n";
    else if (static_cast<unsigned char>(c) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    else
      out += c;
  }
  return out + "\"";
}

std::string number(double v) { return std::isfinite(v) ? fmt::format("{}", v) : "null"; }

template <class Range_, class F>
std::string array(const Range_& range, F&& f) {
  std::string out;
  for (const auto& element : range) {
    if (!out.empty()) out += ',';
    out += f(element);
  }
  return fmt::format("[{}]", out);
}

std::string json(const Entry& e) {
  const EffectText& t = e.text;
  std::string out = "{";
  for (const auto& [key, value] : {std::pair{"name", t.name},
                                   {"title", t.title},
                                   {"family", name_of(t.family)},
                                   {"port", e.port},
                                   {"brief", t.brief},
                                   {"equation", t.equation},
                                   {"validity", t.validity},
                                   {"source", t.source},
                                   {"signature", t.signature},
                                   {"separate", t.separate},
                                   {"seen_in", seen_in(t.showing)}})
    out += fmt::format("\"{}\":{},", key, json_string(value));
  out += fmt::format("\"confusable\":{},", array(words(t.confusable), json_string));
  out += fmt::format("\"dissipative\":{},", e.dissipative);
  out += fmt::format("\"inject\":{},", json_string(injection(e)));
  std::vector<std::string> places;
  for (const Seating& seating : e.seatings)
    for (const std::string_view place : seating.places)
      places.push_back(fmt::format(
          "{{\"place\":{},\"parameters\":{}}}", json_string(place),
          array(seating.rows, [&](const Row& row) {
            return fmt::format(
                "{{\"key\":{},\"unit\":{},\"to_si\":{},\"min\":{},\"max\":{},\"default\":{},"
                "\"nominal\":{},\"meaning\":{}}}",
                json_string(fmt::format("effects.{}.{}.{}", place, t.name, row.key)),
                json_string(row.unit), number(row.to_si), number(row.range.min),
                number(row.range.max), row.by_default, row.nominal, json_string(row.doc));
          })));
  return out + "\"places\":" + array(places, [](const std::string& p) { return p; }) + "}";
}

// --------------------------------------------------------------------------------- Markdown

std::string markdown(const Entry& e) {
  const EffectText& t = e.text;
  std::string out = fmt::format("### {}\n\n**{}**: {}\n\n```\n{}\n```\n\n", t.name, t.title,
                                sentence(t.brief), t.equation);
  out += fmt::format("*Valid*: {}\n\n*Source*: {}\n\n*Signature*: {}\n\n", t.validity,
                     sentence(t.source), sentence(t.signature));
  out += fmt::format("*Looks like* {}; told apart: {} *Best seen in* {}.\n\n",
                     joined(words(t.confusable), ", "), sentence(t.separate), seen_in(t.showing));
  out += "| key | allowed | default | typical | meaning |\n|---|---|---|---|---|\n";
  for (const Seating& seating : e.seatings)
    for (const Row& row : seating.rows)
      out += fmt::format(
          "| `effects.{}.{}.{}`{} | {} | {} | {} | {} |\n", seating.places.front(), t.name, row.key,
          seating.places.size() == 1 ? ""
                                     : fmt::format(" ({})", fmt::join(seating.places.begin() + 1,
                                                                      seating.places.end(), ", ")),
          bounds(row), row.by_default, row.nominal, row.doc);
  return out + "\n";
}

std::string places_text(const Entry& e) {
  std::vector<std::string_view> all;
  for (const Seating& seating : e.seatings)
    all.insert(all.end(), seating.places.begin(), seating.places.end());
  return joined(all, " ");
}

/// Keys and bounds in a row.
std::string parameters_text(const Seating& seating) {
  std::string text;
  for (const Row& row : seating.rows)
    text += (text.empty() ? "" : "; ") + hard(row.key + " " + bounds(row));
  return text;
}

}  // namespace

std::string effect_injection(std::string_view name) { return injection(find(name)); }

std::string effect_table() {
  constexpr std::size_t kBrief = 36, kWidth = 100;
  std::string out;
  for (const Family family : kFamilies) {
    std::string rows;
    for (const Entry& e : entries()) {
      if (e.text.family != family) continue;
      rows += fmt::format("  {:<22} {:<10} {}\n", e.text.name, places_text(e),
                          wrapped(e.text.brief, kWidth - kBrief, kBrief));
      const bool alike = std::all_of(e.seatings.begin(), e.seatings.end(), [&](const Seating& s) {
        return parameters_text(s) == parameters_text(e.seatings.front());
      });
      for (const Seating& seating : e.seatings) {
        if (alike && &seating != &e.seatings.front()) break;
        const std::string parameters =
            (alike ? "" : joined(seating.places, " ") + ": ") + parameters_text(seating);
        rows += std::string(kBrief, ' ') + wrapped(parameters, kWidth - kBrief, kBrief) + "\n";
      }
    }
    if (!rows.empty())
      out += fmt::format("{}{}\n{}", out.empty() ? "" : "\n", name_of(family), rows);
  }
  return out +
         "\nvcnc effects show NAME           equation, source, signature and parameters of one\n"
         "vcnc run ... --inject KEY=VALUE  with KEY as in X.backlash.gap_um; repeatable\n"
         "Anything else: laws and deviations, docs/effects.md (vcnc effects --markdown)\n";
}

std::string effect_page(std::string_view name) {
  const Entry& e = find(name);
  const EffectText& t = e.text;
  std::string out = fmt::format("{}: {}\n", t.name, t.title);
  out += block(wrapped(t.brief, 98, 0));
  const PortDoc& port = doc_of(e.port);
  out += block(wrapped(fmt::format("family {}; acts in the {} at \"{}\" ({}), {}",
                                   name_of(t.family), port.where, e.port, port.signal, port.when),
                       98, 0));
  out += heading("Equation") + block(t.equation) + heading("Valid") + prose(t.validity) +
         heading("Source") + prose(t.source) + heading("Signature") + prose(t.signature) +
         heading("Looks like") + prose(t.confusable) + heading("Told apart by") + prose(t.separate);
  out += heading("Best seen in") + block(seen_in(t.showing));
  out += heading("Parameters");
  for (const Seating& seating : e.seatings)
    for (const Row& row : seating.rows) {
      std::string others;
      for (std::size_t i = 1; i < seating.places.size(); ++i)
        others += fmt::format("{} {}", i == 1 ? "; also" : ",", seating.places[i]);
      out += fmt::format("  effects.{}.{}.{}{}\n", seating.places.front(), t.name, row.key, others);
      out += "      " +
             wrapped(fmt::format("{}{}; allowed {}, default {}, typical {}", row.doc,
                                 row.unit.empty() ? "" : fmt::format(" [{}]", row.unit),
                                 hard(bounds(row)), hard(row.by_default), hard(row.nominal)),
                     94, 6) +
             "\n";
    }
  out += heading("Try it");
  return out + "  vcnc run PROGRAM.ngc --machine MACHINE.toml --out FOLDER " + injection(e) + "\n";
}

std::string effect_json() {
  std::string ports;
  for_each_port([&]<class Port>(std::type_identity<Port>) {
    std::vector<std::string_view> order;
    for (const Entry& e : entries())
      if (e.port == Port::name) order.push_back(e.text.name);
    ports += fmt::format("{}{{\"name\":{},\"order\":{}}}", ports.empty() ? "" : ",",
                         json_string(Port::name), array(order, json_string));
  });
  return fmt::format(
      "{{\"effects\":{},\n\"ports\":[{}],\n\"law_points\":{}}}\n",
      array(entries(), [](const Entry& e) { return fmt::format("\n{}", json(e)); }), ports,
      array(kLawPoints, [](const LawPointDoc& doc) { return json_string(doc.name); }));
}

std::string effect_markdown() {
  std::string out =
      "# Effects\n\nWhat a real machine does besides what it was told. Each is absent unless a "
      "machine file or `--inject`\ngives it a size; `vcnc effects show NAME` prints one of them, "
      "`vcnc effects --json` all for scripts.\nThis page is written by `vcnc effects --markdown`."
      "\n\n```\nvcnc run part.ngc --machine machine.toml --out out/run --inject "
      "X.backlash.gap_um=12 "
      "--inject C.coulomb.level_Nm=4\n```"
      "\n\n## Order of application\n\nFrom the set-point to the reading. Where several act at one "
      "port, they act from left to right, those of\naxes in the order X Y Z A C, then laws (last "
      "section).\n\n| port | signal | in the | when | effects |\n|---|---|---|---|---|\n";
  for_each_port([&]<class Port>(std::type_identity<Port>) {
    const PortDoc& doc = doc_of(Port::name);
    std::vector<std::string> order;
    for (const Entry& e : entries())
      if (e.port == Port::name) order.push_back(fmt::format("[{0}](#{0})", e.text.name));
    for (const LawPointDoc& law : kLawPoints)
      if (law.port == Port::name) order.push_back(fmt::format("law `{}`", law.name));
    out += fmt::format("| {} | {} | {} | {} | {} |\n", Port::name, doc.signal, doc.where, doc.when,
                       fmt::join(order, ", "));
  });
  for (const Family family : kFamilies) {
    std::string index, pages;
    for (const Entry& e : entries()) {
      if (e.text.family != family) continue;
      index +=
          fmt::format("| [{0}](#{0}) | {1} | {2} |\n", e.text.name, places_text(e), e.text.brief);
      pages += markdown(e);
    }
    if (pages.empty()) continue;
    out += fmt::format("\n## {}\n\n| effect | at | what it does |\n|---|---|---|\n{}\n{}",
                       name_of(family), index, pages);
    out.pop_back();
  }
  out.append(1, '\n').append(kLawIntroduction);
  for (const LawPointDoc& doc : kLawPoints)
    out += fmt::format("| `{}` | {} | {} | {} |\n", doc.name, doc.port, doc.what, law_key(doc));
  return out + std::string(kLawExample);
}

}  // namespace vcnc
