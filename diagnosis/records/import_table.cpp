#include "diagnosis/records/import_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "configs/config.hpp"
#include "diagnosis/records/bar_readings.hpp"
#include "diagnosis/records/map_columns.hpp"
#include "diagnosis/records/position_jumps.hpp"
#include "diagnosis/records/record_check.hpp"
#include "diagnosis/records/signal_name.hpp"
#include "diagnosis/records/stretches.hpp"
#include "diagnosis/records/time_base.hpp"
#include "diagnosis/records/told_laps.hpp"

namespace vcnc {

namespace {

using Kind = ImportMap::Kind;

/// A run of fewer samples says nothing.
constexpr std::size_t kFewestSamples = 100;
/// Correlation of what an axis is ahead of its command with its speed.
constexpr double kAhead = 0.5;

constexpr double kZeroApart = 20;      // times the span of a twist, that is none of a transmission
constexpr double kMostTwisted = 3e-3;  ///< [m or rad] that a transmission may be twisted by
constexpr double kLeastMoved = 1e-3;   ///< [m or rad] of one encoder that the other one shows

/// The unit of a column by the table itself, spelled as in maps: below its heading, or in brackets
/// at its end, in UTF-8 or Latin-1. Empty: none, or none that maps have.
std::string told_unit(const MeasuredColumn& column) {
  std::string text = column.unit;
  const std::size_t open = column.name.find_last_of("[(");
  if (text.empty() && open != std::string::npos && !column.name.empty() &&
      (column.name.back() == ']' || column.name.back() == ')'))
    text = column.name.substr(open);
  std::string unit;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view two = std::string_view(text).substr(i, 2), one = two.substr(0, 1);
    if (one == "\xb5")
      unit += 'u';
    else if (one == "\xb0")
      unit += "deg";
    else if (two == "\u00b5" || two == "\u03bc")
      unit += 'u', ++i;
    else if (two == "\u00b0")
      unit += "deg", ++i;
    else if (std::string_view("[]() ").find(text[i]) == std::string_view::npos)
      unit += text[i];
  }
  return find_measured_unit(unit) ? unit : "";
}

class Importer {
 public:
  Importer(const MeasuredTable& table, const ImportMap& map, const std::string& map_name,
           const Machine* declared)
      : table_(table), map_(map), by_map_(table, map, map_name), declared_(declared) {}

  Record record() {
    find_columns();
    base_ = find_time_base();
    record_.source = table_.source;
    record_.period = base_.period;
    record_.begin = base_.begin;
    for (const ImportMap::Axis& a : map_.axes)
      if (const std::size_t axis = axis_named(a.place); axis < kAxisCount)
        record_.axis_names[axis] = a.name;
    tell_units();
    tell_time();
    if (base_.samples < kFewestSamples)
      throw MeasurementError(
          fmt::format("{}: {} samples are too short a run; at least {} are "
                      "needed",
                      table_.source, base_.samples, kFewestSamples));
    if (map_.bar.radius > 0) record_.on_table = {map_.bar.centre, map_.bar.radius};
    if (map_.tool_position.lines.contains("zero_mm"))
      record_.on_table = {map_.tool_position.zero, 0};
    if (map_.arcs.empty())
      for (const ImportMap::Signal& s : map_.signals) add(s);
    else
      add_bar_on_arcs(by_map_, *columns_.front(), base_, record_);
    for (MeasuredSignal& error : following_errors_) add_position(std::move(error));
    add_twists();
    check_record(record_, declared_);
    cut();
    return std::move(record_);
  }

 private:
  void warn(const std::string& sentence) { record_.warnings.push_back(sentence); }

  void find_columns() {
    std::map<const MeasuredColumn*, std::string> used;
    const auto use = [&](const MeasuredColumn& c, const KeyLines& lines, const std::string& path,
                         std::string_view key, const std::string& as) {
      const auto [known, fresh] = used.emplace(&c, as);
      if (!fresh)
        by_map_.refuse(lines, path, key,
                       fmt::format("column \"{}\" is used as {} already", c.name, known->second));
      rows_ = rows_ == 0 ? c.value.size() : rows_;
      if (c.value.size() != rows_)
        by_map_.refuse(lines, path, key,
                       fmt::format("column \"{}\" has {} rows, the others have {}", c.name,
                                   c.value.size(), rows_));
    };
    const ImportMap::Time& t = map_.time;
    if (t.rate == 0) {
      const std::string_view key = t.number > 0 ? "number" : "column";
      time_ = &by_map_.find(t.column, t.number, t.lines, "time.", key);
      use(*time_, t.lines, "time.", key, "time");
    }
    for (const ImportMap::Signal& s : map_.signals) {
      const std::string_view key = s.number > 0 ? "number" : "column";
      columns_.push_back(&by_map_.find(s.column, s.number, s.lines, "signals.", key));
      use(*columns_.back(), s.lines, "signals.", key,
          fmt::format("{}{}", to_string(s.kind), s.axis.empty() ? "" : " of " + s.axis));
    }
  }

  /// Units as the table has them that the map contradicts; a scale of the map's may convert them.
  void tell_units() {
    const auto tell = [&](const MeasuredColumn& column, const std::string& of_map) {
      const MeasuredUnit *told = find_measured_unit(told_unit(column)),
                         *taken = find_measured_unit(of_map);
      if (told && taken && told != taken)
        warn(fmt::format(
            "column \"{}\" is in {} by the table and in {} by the map, which was followed",
            column.name, told->name, of_map));
    };
    if (time_) tell(*time_, map_.time.unit);
    for (const ImportMap::Signal& s : map_.signals)
      if (s.scale == 1 && !s.unit.empty())
        tell(*columns_[static_cast<std::size_t>(&s - map_.signals.data())], s.unit);
  }

  TimeBase find_time_base() const {
    if (!time_) return uniform_time_base(rows_, 1 / map_.time.rate);
    const MeasuredUnit* unit = find_measured_unit(map_.time.unit);
    std::vector<double> seconds = time_->value;
    for (double& v : seconds) v *= unit->factor;
    return time_base(seconds, map_.time.jitter, table_);
  }

  void tell_time() {
    if (base_.gaps > 0 && map_.arcs.empty())  // a bar is not read between its arcs
      warn(fmt::format("{} samples are missing in {} gap{} and stay missing", base_.lost,
                       base_.gaps, base_.gaps == 1 ? "" : "s"));
    if (base_.jitter > 0.01 * base_.period)
      warn(
          fmt::format("time stamps jitter by {:.3g} us rms, at most {:.3g} us, of a period of "
                      "{:.6g} us",
                      base_.jitter * 1e6, base_.worst * 1e6, base_.period * 1e6));
    const double rate = 1 / base_.period;
    if (rate < 50)
      warn(fmt::format("{:.4g} samples per second are too few for effects of the drives", rate));
    if (rate > 1e6)
      warn(fmt::format("{:.4g} samples per second are unusually many; check time.unit", rate));
  }

  void add(const ImportMap::Signal& s) {
    const MeasuredColumn& column = *columns_[static_cast<std::size_t>(&s - map_.signals.data())];
    MeasuredSignal signal;
    const SignalPlace place = place_of(map_, s);
    signal.axis = place.axis;
    signal.source = column.name;
    signal.value.assign(base_.samples, kMissing);
    std::size_t missing = 0;
    for (std::size_t i = 0; i < rows_; ++i) {
      signal.value[base_.index[i]] = to_si(s, column.value[i]);
      missing += !std::isfinite(column.value[i]);
    }
    if (missing == rows_)
      by_map_.refuse(s.lines, "signals.", s.number > 0 ? "number" : "column",
                     fmt::format("column \"{}\" holds no value", column.name));
    if (missing > 0)
      warn(fmt::format("\"{}\": {} of {} values are missing and stay missing", column.name, missing,
                       rows_));
    switch (s.kind) {
      case Kind::command:
        signal.kind = SignalKind::command;
        break;
      case Kind::position:
      case Kind::motor_position:
      case Kind::load_position:
        positions_[place.axis][s.kind] = record_.signals.size();
        signal.kind = SignalKind::position;
        break;
      case Kind::following_error:
        following_errors_.push_back(std::move(signal));
        return;
      case Kind::twist:
        signal.kind = SignalKind::twist;
        break;
      case Kind::velocity:
        signal.kind = SignalKind::velocity;
        break;
      case Kind::force:
        signal.kind = SignalKind::force;
        break;
      case Kind::applied_force:
        signal.kind = SignalKind::applied_force;
        break;
      case Kind::added_force:
        signal.kind = SignalKind::added_force;
        break;
      case Kind::deflection:
        signal.kind = SignalKind::deflection;
        break;
      case Kind::bar:
        check_bar_length(by_map_, s, column);
        signal.kind = SignalKind::bar;
        break;
      case Kind::tool_position:
        signal.kind = SignalKind::tool_position;
        break;
      case Kind::cosine:
        signal.kind = SignalKind::cosine;
        break;
      case Kind::sine:
        signal.kind = SignalKind::sine;
        break;
      case Kind::temperature:
        signal.kind = SignalKind::temperature;
        signal.axis = temperatures_++;
        if (signal.axis >= kAxisCount)
          by_map_.refuse(s.lines, "signals.", "kind",
                         fmt::format("more than {} temperatures", kAxisCount));
        break;
      case Kind::clock:
        signal.kind = SignalKind::clock;
        break;
    }
    if (signal.kind == SignalKind::position || signal.kind == SignalKind::command)
      check_jumps(column, s.kind);
    record_.signals.push_back(std::move(signal));
  }

  /// Of an axis of which it is known how far it is behind its command.
  void add_position(MeasuredSignal error) {
    const MeasuredSignal& command = *record_.find(SignalKind::command, error.axis);
    tell_if_ahead(error, command);
    MeasuredSignal position = std::move(error);
    position.kind = SignalKind::position;
    for (std::size_t k = 0; k < base_.samples; ++k)
      position.value[k] = command.value[k] - position.value[k];
    position.source = fmt::format("{} - {}", command.source, position.source);
    positions_[position.axis][Kind::position] = record_.signals.size();
    record_.signals.push_back(std::move(position));
  }

  /// No drive without feed-forward is ahead of its command.
  void tell_if_ahead(const MeasuredSignal& error, const MeasuredSignal& command) {
    double both = 0, own = 0, moved = 0;
    for (std::size_t k = 1; k < base_.samples; ++k) {
      const double v = command.value[k] - command.value[k - 1], e = error.value[k];
      if (std::isfinite(v * e)) both += v * e, own += e * e, moved += v * v;
    }
    if (!(both < -kAhead * std::sqrt(own * moved))) return;
    warn(
        fmt::format("by \"{}\" {} goes ahead of its command: a following error is command less "
                    "position; if the "
                    "controller counts the other way, say sign = -1",
                    error.source, kAxisNames[error.axis]));
  }

  void check_jumps(const MeasuredColumn& c, Kind kind) const {
    const std::optional<PositionJump> jump = position_jump(c.value);
    if (!jump) return;
    const std::string what =
        fmt::format("{}: \"{}\" ({})", table_.place(jump->row), c.name, to_string(kind));
    if (jump->rows > 0)
      throw MeasurementError(
          fmt::format("{} is 0 in {} rows, {:.6g} before: if it was not measured there, leave the "
                      "values empty",
                      what, jump->rows, jump->from));
    throw MeasurementError(
        fmt::format("{} jumps from {:.6g} to {:.6g} and goes on from there: it wraps, and must be "
                    "unrolled before",
                    what, jump->from, jump->to));
  }

  bool commanded(std::size_t axis) const {
    return record_.find(SignalKind::command, axis) != nullptr;
  }

  /// Whether of two measuring systems that of the load is the loop's. Without a command there is no
  /// loop to be seen, and the motor is what moves.
  bool closed_with_load(std::size_t axis) {
    if (!commanded(axis)) return false;
    if (declared_) return declared_->axes[axis].servo.feedback == ServoParams::Feedback::load;
    warn(fmt::format(
        "without a machine it is not known with which of the two measuring systems the "
        "loop of {} is closed: taken is that of the motor; name the machine in the map, "
        "or call the one position",
        kAxisNames[axis]));
    return false;
  }

  /// The only position of an axis must be that of its loop.
  void check_one_position(std::size_t axis, Kind kind) {
    if (kind == Kind::position || !commanded(axis)) return;
    if (!declared_)
      return warn(
          fmt::format("without a machine it is not known whether the loop of {} is closed with the "
                      "{}, of which there is a position alone: it is taken to be; name the machine "
                      "in the map",
                      kAxisNames[axis], kind == Kind::load_position ? "load" : "motor"));
    const bool of_load = kind == Kind::load_position;
    if (of_load == (declared_->axes[axis].servo.feedback == ServoParams::Feedback::load)) return;
    throw MeasurementError(fmt::format(
        "{}: the {}_position of {} alone cannot be compared: the loop of the declared machine is "
        "closed with the {} (axes.{}.feedback); say there which it is, or call the column position "
        "if it is that of the loop",
        table_.source, of_load ? "load" : "motor", kAxisNames[axis], of_load ? "motor" : "load",
        kAxisNames[axis]));
  }

  /// Of two positions of one axis the second becomes the twist.
  void add_twists() {
    std::set<std::size_t> gone;
    for (const auto& [axis, of] : positions_) {
      if (of.size() < 2) {
        check_one_position(axis, of.begin()->first);
        continue;
      }
      const bool motor = of.contains(Kind::motor_position);
      const bool load = of.contains(Kind::load_position);
      // position is that of the motor, unless the motor has a column of its own.
      const std::size_t m = motor ? of.at(Kind::motor_position) : of.at(Kind::position);
      const std::size_t l = load ? of.at(Kind::load_position) : of.at(Kind::position);
      const std::size_t closed = of.contains(Kind::position) ? of.at(Kind::position)
                                 : closed_with_load(axis)    ? l
                                                             : m;
      if (is_copy(record_.signals[l].value, record_.signals[m].value))
        throw MeasurementError(fmt::format(
            "{}: \"{}\" is \"{}\" itself, value by value (but for a factor and an offset): no "
            "transmission is that stiff; give the column of the other measuring system",
            table_.source, record_.signals[l].source, record_.signals[m].source));
      check_both_move(record_.signals[l], record_.signals[m]);
      check_both_move(record_.signals[m], record_.signals[l]);
      MeasuredSignal twist;
      twist.kind = SignalKind::twist;
      twist.axis = axis;
      twist.source = record_.signals[l].source + " - " + record_.signals[m].source;
      for (std::size_t i = 0; i < base_.samples; ++i)
        twist.value.push_back(record_.signals[l].value[i] - record_.signals[m].value[i]);
      twist.relative = true;
      take_zero_off(twist);
      gone.insert(closed == m ? l : m);
      record_.signals.push_back(std::move(twist));
    }
    for (auto i = gone.rbegin(); i != gone.rend(); ++i)
      record_.signals.erase(record_.signals.begin() + static_cast<std::ptrdiff_t>(*i));
  }

  void check_both_move(const MeasuredSignal& stays, const MeasuredSignal& moves) const {
    const auto [low, high] = range_of(moves.value);
    const double far = std::max(kLeastMoved, 0.1 * (high - low));
    if (const auto begin = stays_while(stays.value, moves.value, far))
      throw MeasurementError(fmt::format(
          "{}: \"{}\" stays at {:.6g} (SI) from {:.3f} s on while \"{}\" goes on: a measuring "
          "system that failed, or a column that was not written",
          table_.source, stays.source, stays.value[*begin], record_.time_of(*begin), moves.source));
  }

  static std::pair<double, double> range_of(const std::vector<double>& value) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const double v : value)
      if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    return {low, high};
  }

  /// Two measuring systems begin to count somewhere.
  void take_zero_off(MeasuredSignal& twist) {
    const auto [low, high] = range_of(twist.value);
    const double middle = 0.5 * (low + high);
    if (!(std::abs(middle) > std::max(kMostTwisted, kZeroApart * (high - low)))) return;
    for (double& v : twist.value) v -= middle;
    warn(fmt::format(
        "\"{}\" is {:.6g} {} and changes by {:.3g} only: the two measuring systems have zeros of "
        "their own; their difference is taken off, and what twists {} all the time with it",
        twist.source, middle, is_rotary(twist.axis) ? "rad" : "m", high - low,
        kAxisNames[twist.axis]));
  }

  void cut() {
    if (!map_.laps.empty() || !map_.lap_column.empty())
      add_told_laps(by_map_, base_, record_);
    else if (map_.detect_laps)
      record_.stretches = stretches_of(record_);
    std::map<int, int> repetitions;
    for (const Stretch& s : record_.stretches) ++repetitions[s.condition];
    const bool repeated = std::any_of(repetitions.begin(), repetitions.end(),
                                      [](const auto& r) { return r.second > 1; });
    const bool compared = std::any_of(record_.signals.begin(), record_.signals.end(),
                                      [](const MeasuredSignal& s) { return is_compared(s.kind); });
    if (!repeated && compared)
      warn("no motion is repeated: noise can only be estimated from the residual itself");
  }

  const MeasuredTable& table_;
  const ImportMap& map_;
  MapColumns by_map_;
  const Machine* declared_;
  const MeasuredColumn* time_ = nullptr;
  std::vector<const MeasuredColumn*> columns_;  // of each signal of the map
  std::size_t rows_ = 0, temperatures_ = 0;
  std::map<std::size_t, std::map<Kind, std::size_t>> positions_;  // axis: kind: signal
  std::vector<MeasuredSignal> following_errors_;
  TimeBase base_;
  Record record_;
};

}  // namespace

Record import_table(const MeasuredTable& table, const ImportMap& map, const std::string& map_name,
                    const Machine* declared) {
  return Importer(table, map, map_name, declared).record();
}

Record import_files(const std::string& table, const std::string& map, const std::string& model) {
  const ImportMap read = load_import_map(map);
  std::optional<Machine> named, declared;
  if (!read.machine.empty()) named = load_machine(read.machine);
  declared = model.empty() ? named : load_machine(model);
  const TextFormat format{
      .separator = read.separator, .decimal = read.decimal, .missing = read.missing};
  Record record =
      import_table(read_measured_table(table, format), read, map, declared ? &*declared : nullptr);
  if (named) {
    record.machine_toml = to_toml(*named);
    if (!named->setup.piece.empty()) record.piece_toml = to_toml(load_piece(named->setup.piece));
  }
  return record;
}

std::string describe(const Record& record) {
  std::string text =
      fmt::format("{}: {} samples in {:.3f} s, {:.6g} Hz\n", record.source, record.samples(),
                  static_cast<double>(record.samples()) * record.period, 1 / record.period);
  for (const MeasuredSignal& s : record.signals) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    std::size_t there = 0;
    for (const double v : s.value)
      if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v), ++there;
    text += fmt::format("  {:<16} from \"{}\": {:.6g} .. {:.6g} in SI", signal_name(s.kind, s.axis),
                        s.source, low, high);
    if (s.resolution > 0) text += fmt::format(", in steps of {:.3g}", s.resolution);
    if (there < s.value.size()) text += fmt::format(", {} missing", s.value.size() - there);
    text += "\n";
  }
  std::map<int, std::pair<std::string, int>> conditions;
  for (const Stretch& s : record.stretches) {
    auto& [label, count] = conditions[s.condition];
    label = s.label;
    ++count;
  }
  for (const auto& [number, of] : conditions)
    text += fmt::format("  {}: {} lap{}\n", of.first, of.second, of.second == 1 ? "" : "s");
  return text;
}

}  // namespace vcnc
