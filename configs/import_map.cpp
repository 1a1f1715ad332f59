#include "configs/import_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include "configs/config.hpp"
#include "configs/spelling.hpp"
#include "model/axes.hpp"

namespace vcnc {

namespace {

using ColumnKind = ImportMap::Kind;

constexpr std::array kUnits{
    MeasuredUnit{"m", Dimension::length, 1},
    MeasuredUnit{"mm", Dimension::length, 1e-3},
    MeasuredUnit{"um", Dimension::length, 1e-6},
    MeasuredUnit{"nm", Dimension::length, 1e-9},
    MeasuredUnit{"in", Dimension::length, 25.4e-3},
    MeasuredUnit{"rad", Dimension::angle, 1},
    MeasuredUnit{"mrad", Dimension::angle, 1e-3},
    MeasuredUnit{"urad", Dimension::angle, 1e-6},
    MeasuredUnit{"deg", Dimension::angle, kDegree},
    MeasuredUnit{"arcsec", Dimension::angle, kDegree / 3600},
    MeasuredUnit{"rev", Dimension::angle, 2 * kPi},
    MeasuredUnit{"m/s", Dimension::speed, 1},
    MeasuredUnit{"mm/s", Dimension::speed, 1e-3},
    MeasuredUnit{"mm/min", Dimension::speed, 1e-3 / 60},
    MeasuredUnit{"m/min", Dimension::speed, 1.0 / 60},
    MeasuredUnit{"rad/s", Dimension::angular_speed, 1},
    MeasuredUnit{"deg/s", Dimension::angular_speed, kDegree},
    MeasuredUnit{"rpm", Dimension::angular_speed, 2 * kPi / 60},
    MeasuredUnit{"N", Dimension::force, 1},
    MeasuredUnit{"kN", Dimension::force, 1e3},
    MeasuredUnit{"Nm", Dimension::torque, 1},
    MeasuredUnit{"mNm", Dimension::torque, 1e-3},
    MeasuredUnit{"V", Dimension::voltage, 1},
    MeasuredUnit{"mV", Dimension::voltage, 1e-3},
    MeasuredUnit{"1", Dimension::share, 1},
    MeasuredUnit{"K", Dimension::temperature, 1},
    MeasuredUnit{"degC", Dimension::temperature, 1, 273.15},
    MeasuredUnit{"s", Dimension::time, 1},
    MeasuredUnit{"ms", Dimension::time, 1e-3},
    MeasuredUnit{"us", Dimension::time, 1e-6},
    MeasuredUnit{"ns", Dimension::time, 1e-9},
    MeasuredUnit{"min", Dimension::time, 60},
};

constexpr double kLeastSweep = 10 * kDegree;  // of an arc

constexpr std::array<std::string_view, 3> kProbeNames{"x", "y", "z"};

/// What a signal may be measured in.
std::vector<Dimension> dimensions(ColumnKind kind, bool rotary) {
  switch (kind) {
    case ColumnKind::velocity:
      return {rotary ? Dimension::angular_speed : Dimension::speed};
    case ColumnKind::force:
    case ColumnKind::applied_force:
    case ColumnKind::added_force:
      return {rotary ? Dimension::torque : Dimension::force};
    case ColumnKind::deflection:
    case ColumnKind::bar:
    case ColumnKind::tool_position:
      return {Dimension::length};
    case ColumnKind::cosine:
    case ColumnKind::sine:
      return {Dimension::voltage, Dimension::share};
    case ColumnKind::temperature:
      return {Dimension::temperature};
    case ColumnKind::clock:
      return {Dimension::time};
    case ColumnKind::command:
    case ColumnKind::position:
    case ColumnKind::motor_position:
    case ColumnKind::load_position:
    case ColumnKind::following_error:
    case ColumnKind::twist:
      break;
  }
  return {rotary ? Dimension::angle : Dimension::length};
}

bool of_table(ColumnKind kind) { return kind == ColumnKind::tool_position; }
bool of_probe(ColumnKind kind) {
  return kind == ColumnKind::deflection || kind == ColumnKind::cosine || kind == ColumnKind::sine ||
         of_table(kind);
}
bool of_nothing(ColumnKind kind) {
  return kind == ColumnKind::temperature || kind == ColumnKind::clock || kind == ColumnKind::bar;
}

int line_of(const KeyLines& lines, std::string_view key) {
  if (const auto at = lines.find(key); at != lines.end()) return at->second;
  const auto whole = lines.find("");
  return whole == lines.end() ? 0 : whole->second;
}

/// Refuses with the place of a key.
class Refusal {
 public:
  Refusal(const std::string& name, std::string path, const KeyLines& lines)
      : name_(name), path_(std::move(path)), lines_(lines) {}

  [[noreturn]] void operator()(std::string_view key, const std::string& reason) const {
    const int line = line_of(lines_, key);
    const std::string place = line > 0 ? fmt::format("{}:{}", name_, line) : name_;
    throw ConfigError(fmt::format("{}: {}{}: {}", place, path_, key, reason));
  }

 private:
  const std::string& name_;
  std::string path_;
  const KeyLines& lines_;
};

template <class List, class T>
bool contains(const List& list, const T& wanted) {
  return std::find(list.begin(), list.end(), wanted) != list.end();
}

/// Of axes that the map gives a name, those that may have a column of this kind.
std::string own_names(const ImportMap& map, ColumnKind kind) {
  std::string all;
  for (const ImportMap::Axis& a : map.axes)
    if (contains(kProbeNames, a.place) == of_probe(kind)) all += ", \"" + a.name + "\"";
  return all;
}

/// The place that a signal's axis names; empty where there is none of that name.
std::string_view place_name(const ImportMap& map, std::string_view axis) {
  for (const ImportMap::Axis& a : map.axes)
    if (a.name == axis) return a.place;
  return axis;
}

std::string unit_hint(const MeasuredUnit& unit, ColumnKind kind, bool rotary) {
  if (kind != ColumnKind::force && kind != ColumnKind::applied_force &&
      kind != ColumnKind::added_force)
    return "";
  if (unit.dimension == Dimension::torque && !rotary)
    return "; of a motor's torque give unit \"N\" and as scale the newtons at the carriage per "
           "newton metre";
  return "";
}

void check_unit(const ImportMap& map, const ImportMap::Signal& s, const Refusal& refuse) {
  const SignalPlace place = place_of(map, s);
  const std::vector<Dimension> may = dimensions(s.kind, place.rotary);
  std::string allowed;
  for (const Dimension d : may) allowed += (allowed.empty() ? "" : ", ") + measured_units(d);
  const std::string subject = of_nothing(s.kind) ? fmt::format("a {}", to_string(s.kind))
                                                 : fmt::format("the {} of {}", to_string(s.kind),
                                                               of_table(s.kind)   ? "the tool"
                                                               : of_probe(s.kind) ? "the probe"
                                                               : place.rotary     ? "a rotary axis"
                                                                              : "a linear axis");
  const std::string tail = fmt::format("allowed for {}: {}", subject, allowed);
  if (s.unit.empty()) refuse("unit", "is missing; " + tail);
  const MeasuredUnit* unit = find_measured_unit(s.unit);
  if (!unit && (s.unit == "A" || s.unit == "%"))
    refuse("unit", fmt::format("\"{}\" is no unit of a force; give unit \"{}\" and as scale the "
                               "{} per {}",
                               s.unit, place.rotary ? "Nm" : "N",
                               place.rotary ? "newton metres" : "newtons",
                               s.unit == "A" ? "ampere" : "per cent"));
  if (!unit) refuse("unit", fmt::format("\"{}\" is unknown; {}", s.unit, tail));
  if (!contains(may, unit->dimension))
    refuse("unit", fmt::format("\"{}\" does not fit; {}{}", s.unit, tail,
                               unit_hint(*unit, s.kind, place.rotary)));
}

/// The heading or number that a signal names.
std::string column_text(const std::string& column, int number) {
  return column.empty() ? fmt::format("number {}", number) : fmt::format("\"{}\"", column);
}

void check_axes(const ImportMap& map, const std::string& name) {
  std::set<std::string> names, places;
  for (std::size_t i = 0; i < map.axes.size(); ++i) {
    const ImportMap::Axis& a = map.axes[i];
    const Refusal refuse(name, "axes.", a.lines);
    if (a.name.empty()) refuse("name", "is missing");
    if (!contains(kAxisNames, a.place) && !contains(kProbeNames, a.place))
      refuse("place", fmt::format("\"{}\" is no place; allowed X, Y, Z, A, C, or x, y, z of "
                                  "probe or table",
                                  a.place));
    if (contains(kAxisNames, a.name) && a.name != a.place)
      refuse("name", fmt::format("\"{}\" is the name of another axis of the machine file", a.name));
    if (!names.insert(a.name).second) refuse("name", fmt::format("\"{}\" is given twice", a.name));
    if (!places.insert(a.place).second)
      refuse("place", fmt::format("\"{}\" is taken by another axis already", a.place));
  }
}

void check_time(const ImportMap& map, const std::string& name) {
  const ImportMap::Time& t = map.time;
  const Refusal refuse(name, "time.", t.lines);
  const bool column = !t.column.empty() || t.number > 0;
  if (!t.column.empty() && t.number > 0)
    refuse("number", "column is given as well; one of them is too many");
  if (column == (t.rate > 0))
    refuse(column ? "rate_hz" : "column",
           column ? "a column with the time is given as well; one of them is too many"
                  : "is missing; time needs a column (or its number) with its unit, or rate_hz");
  if (!column) return;
  const MeasuredUnit* unit = find_measured_unit(t.unit);
  const std::string allowed = "allowed: " + measured_units(Dimension::time);
  if (t.unit.empty()) refuse("unit", "is missing; " + allowed);
  if (!unit || unit->dimension != Dimension::time)
    refuse("unit", fmt::format("\"{}\" is no unit of time; {}", t.unit, allowed));
}

void check_laps(const ImportMap& map, const std::string& name) {
  if (!map.laps.empty() && !map.lap_column.empty())
    Refusal(name, "", map.lines)("lap_column", "laps are given as well; one of them is too many");
  if (!map.condition_column.empty() && map.lap_column.empty())
    Refusal(name, "", map.lines)("condition_column", "needs lap_column");
  double last = -HUGE_VAL;
  for (const ImportMap::Lap& lap : map.laps) {
    const Refusal refuse(name, "laps.", lap.lines);
    if (!(lap.from < lap.to)) refuse("to_s", "must be after from_s");
    if (lap.from < last) refuse("from_s", "the lap begins before the one above it ends");
    last = lap.to;
  }
}

/// A record holds the readings of one device.
void check_devices(const ImportMap& map, const std::string& name) {
  std::optional<ColumnKind> first;
  for (const ImportMap::Signal& s : map.signals) {
    if (!contains(std::array{ColumnKind::deflection, ColumnKind::bar, ColumnKind::tool_position},
                  s.kind))
      continue;
    if (first && *first != s.kind)
      Refusal(name, "signals.", s.lines)(
          "kind", fmt::format("a {} was read as well; a record holds one or the other",
                              *first == ColumnKind::deflection ? "probe" : to_string(*first)));
    first = s.kind;
  }
  const ImportMap::ToolPosition& of = map.tool_position;
  const Refusal refuse(name, "tool_position.", of.lines);
  if (first == ColumnKind::tool_position && !of.lines.contains("zero_mm"))
    refuse("zero_mm", "is missing; columns of kind tool_position need where they read 0");
  if (first != ColumnKind::tool_position && of.lines.contains("zero_mm"))
    refuse("zero_mm", "no column is of kind tool_position");
}

void check_bar(const ImportMap& map, const std::string& name) {
  const auto is_bar = [](const ImportMap::Signal& s) { return s.kind == ColumnKind::bar; };
  const auto column = std::find_if(map.signals.begin(), map.signals.end(), is_bar);
  const Refusal refuse(name, "bar.", map.bar.lines);
  if (column == map.signals.end()) {
    if (map.bar.radius > 0) refuse("radius_mm", "no column is of kind bar");
    if (!map.arcs.empty())
      Refusal(name, "", map.arcs.front().lines)(
          "arcs", "no column is of kind bar; of anything else the commands must be columns");
    return;
  }
  if (!(map.bar.radius > 0))
    refuse("radius_mm", "is missing; a column of kind bar needs the nominal length of the bar");
  if (!map.bar.lines.contains("centre_mm"))
    refuse("centre_mm", "is missing; a column of kind bar needs where the circle's centre is");
  if (map.arcs.empty()) {
    const auto commands =
        std::count_if(map.signals.begin(), map.signals.end(),
                      [](const ImportMap::Signal& s) { return s.kind == ColumnKind::command; });
    if (commands < 2)
      Refusal(name, "signals.", column->lines)(
          "kind", "a bar needs how the axes moved: columns with their commands, or [[arcs]]");
    return;
  }
  if (!(map.bar.feed > 0)) refuse("feed_mm_min", "is missing; arcs need their feed");
  for (const ImportMap::Signal& s : map.signals)
    if (!is_bar(s))
      Refusal(name, "signals.", s.lines)(
          "kind", fmt::format("with arcs the bar alone can be read, no {}; give the commands of "
                              "the axes as columns instead of arcs",
                              to_string(s.kind)));
  if (!map.laps.empty())
    Refusal(name, "", map.laps.front().lines)("laps", "arcs say already which parts count");
  if (!map.lap_column.empty())
    Refusal(name, "", map.lines)("lap_column", "arcs say already which parts count");
  double last = -HUGE_VAL;
  for (const ImportMap::Arc& arc : map.arcs) {
    const Refusal refuse_arc(name, "arcs.", arc.lines);
    if (arc.from < last)
      refuse_arc("from_s", fmt::format("the arc begins before the one above it ends, by its sweep, "
                                       "radius and feed at {:.3f} s",
                                       last));
    if (std::abs(arc.sweep) < kLeastSweep)
      refuse_arc("sweep_deg", fmt::format("{:g} is too short an arc; at least {:g}",
                                          arc.sweep / kDegree, kLeastSweep / kDegree));
    last = arc.from + std::abs(arc.sweep) * map.bar.radius / map.bar.feed;
  }
}

void check_signal(const ImportMap& map, const ImportMap::Signal& s, const Refusal& refuse) {
  if (!s.column.empty() && s.number > 0)
    refuse("number", "column is given as well; one of them is too many");
  if (s.column.empty() && s.number == 0) refuse("column", "is missing");
  if (!s.lines.contains("kind"))
    refuse("kind",
           "is missing; allowed command, position, motor_position, load_position, "
           "following_error, twist, velocity, force, applied_force, added_force, deflection, bar, "
           "tool_position, cosine, sine, temperature, clock");
  if (s.sign == 0) refuse("sign", "0 is not possible, allowed 1 or -1");
  if (s.scale == 0) refuse("scale", "0 would make every value the same");
  if (of_nothing(s.kind)) {
    if (!s.axis.empty()) refuse("axis", fmt::format("a {} belongs to no axis", to_string(s.kind)));
    return;
  }
  if (s.axis.empty())
    refuse("axis",
           fmt::format("is missing; allowed {}{}", of_probe(s.kind) ? "x, y, z" : "X, Y, Z, A, C",
                       own_names(map, s.kind)));
  const std::string_view place = place_name(map, s.axis);
  const bool fits = of_probe(s.kind) ? contains(kProbeNames, place) : contains(kAxisNames, place);
  if (!fits)
    refuse("axis",
           fmt::format("\"{}\" is no axis that has a {}; allowed {}{}", s.axis, to_string(s.kind),
                       of_table(s.kind)   ? "x, y, z of the table"
                       : of_probe(s.kind) ? "x, y, z of the probe"
                                          : "X, Y, Z, A, C",
                       own_names(map, s.kind)));
}

void check_signals(const ImportMap& map, const std::string& name) {
  if (map.signals.empty())
    Refusal(name, "", map.lines)("signals", "is missing; a map needs at least one [[signals]]");
  std::set<std::tuple<ColumnKind, bool, std::size_t>> seen;
  std::set<std::string> columns;
  if (map.time.number > 0 || !map.time.column.empty())
    columns.insert(column_text(map.time.column, map.time.number));
  for (const ImportMap::Signal& s : map.signals) {
    const Refusal refuse(name, "signals.", s.lines);
    check_signal(map, s, refuse);
    check_unit(map, s, refuse);
    const SignalPlace place = place_of(map, s);
    if (!columns.insert(column_text(s.column, s.number)).second)
      refuse(s.column.empty() ? "number" : "column",
             fmt::format("column {} is given twice", column_text(s.column, s.number)));
    if (s.kind != ColumnKind::temperature && !seen.insert({s.kind, place.probe, place.axis}).second)
      refuse("kind", fmt::format("the {}{} is given twice", to_string(s.kind),
                                 s.axis.empty() ? "" : " of " + s.axis));
  }
  for (const ImportMap::Signal& s : map.signals) {
    const Refusal refuse(name, "signals.", s.lines);
    const SignalPlace place = place_of(map, s);
    const auto has = [&](ColumnKind kind) {
      return seen.contains({kind, place.probe, place.axis});
    };
    const bool closed = has(ColumnKind::position);
    if (s.kind == ColumnKind::following_error) {
      if (!has(ColumnKind::command))
        refuse("kind", fmt::format("a following_error of {} says where it is beside its command, "
                                   "which is not given",
                                   s.axis));
      if (closed || has(ColumnKind::motor_position) || has(ColumnKind::load_position))
        refuse("kind",
               fmt::format("{} has a position as well; one of the two is too many", s.axis));
    }
    if (s.kind == ColumnKind::twist &&
        (has(ColumnKind::motor_position) || has(ColumnKind::load_position)))
      refuse("kind", fmt::format("the twist of {} follows from its two positions, which are given "
                                 "as well",
                                 s.axis));
    if (s.kind == ColumnKind::load_position && closed && has(ColumnKind::motor_position))
      refuse("kind",
             fmt::format("{} has three positions; position is that of the motor or of the load",
                         s.axis));
    if (s.kind == ColumnKind::sine && !has(ColumnKind::cosine))
      refuse("kind", fmt::format("{} has a sine, but no cosine", s.axis));
    if (s.kind == ColumnKind::cosine && !has(ColumnKind::sine))
      refuse("kind", fmt::format("{} has a cosine, but no sine", s.axis));
  }
}

}  // namespace

const MeasuredUnit* find_measured_unit(std::string_view name) {
  const auto at = std::find_if(kUnits.begin(), kUnits.end(),
                               [&](const MeasuredUnit& u) { return u.name == name; });
  return at == kUnits.end() ? nullptr : &*at;
}

std::string measured_units(Dimension dimension) {
  std::string all;
  for (const MeasuredUnit& u : kUnits)
    if (u.dimension == dimension) all += (all.empty() ? "" : ", ") + std::string(u.name);
  return all;
}

std::string_view to_string(ImportMap::Kind kind) {
  switch (kind) {
    case ColumnKind::command:
      return "command";
    case ColumnKind::position:
      return "position";
    case ColumnKind::motor_position:
      return "motor_position";
    case ColumnKind::load_position:
      return "load_position";
    case ColumnKind::following_error:
      return "following_error";
    case ColumnKind::twist:
      return "twist";
    case ColumnKind::velocity:
      return "velocity";
    case ColumnKind::force:
      return "force";
    case ColumnKind::applied_force:
      return "applied_force";
    case ColumnKind::added_force:
      return "added_force";
    case ColumnKind::deflection:
      return "deflection";
    case ColumnKind::bar:
      return "bar";
    case ColumnKind::tool_position:
      return "tool_position";
    case ColumnKind::cosine:
      return "cosine";
    case ColumnKind::sine:
      return "sine";
    case ColumnKind::temperature:
      return "temperature";
    case ColumnKind::clock:
      return "clock";
  }
  return "?";
}

SignalPlace place_of(const ImportMap& map, const ImportMap::Signal& signal) {
  if (of_nothing(signal.kind)) return {};
  const std::string_view place = place_name(map, signal.axis);
  for (std::size_t i = 0; i < kAxisNames.size(); ++i)
    if (kAxisNames[i] == place) return {.axis = i, .rotary = is_rotary(i)};
  for (std::size_t i = 0; i < kProbeNames.size(); ++i)
    if (kProbeNames[i] == place) return {.axis = i, .probe = true};
  return {};
}

double to_si(const ImportMap::Signal& signal, double value) {
  const MeasuredUnit* unit = find_measured_unit(signal.unit);
  const double in_unit = signal.sign * signal.scale * value + signal.offset;
  return unit ? (in_unit + unit->shift) * unit->factor : in_unit;
}

void check_import_map(const ImportMap& map, const std::string& name) {
  check_axes(map, name);
  check_time(map, name);
  check_signals(map, name);
  check_laps(map, name);
  check_devices(map, name);
  check_bar(map, name);
}

}  // namespace vcnc
