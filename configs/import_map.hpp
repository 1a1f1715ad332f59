// The map of a measured table: what each of its columns is.
//
// A map says of every column that counts which signal it is, of which axis, in which unit; where
// time comes from; and where the laps are. Nothing of this is ever taken from the numbers. Its keys
// are read like those of a machine file (configs/config.hpp); docs/import.md has an example for
// each kind of source.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/fields.hpp"

namespace vcnc {

/// What a unit measures.
enum class Dimension {
  length,
  angle,
  speed,
  angular_speed,
  force,
  torque,
  voltage,
  share,
  temperature,
  time
};

/// si = (value + shift) * factor.
struct MeasuredUnit {
  std::string_view name;
  Dimension dimension;
  double factor = 1, shift = 0;
};

/// Null where there is no such unit.
const MeasuredUnit* find_measured_unit(std::string_view name);
/// "m, mm, um, nm, in" of one dimension.
std::string measured_units(Dimension dimension);

/// Line of each key in a table of the file; "" is the table itself.
using KeyLines = std::map<std::string, int, std::less<>>;

struct ImportMap {
  enum class Kind {
    command,          ///< position the axis was told to have
    position,         ///< by the measuring system the loop is closed with
    motor_position,   ///< by an encoder on the motor, told on the load side
    load_position,    ///< by a scale or an encoder on the load
    following_error,  ///< command less position
    twist,            ///< load side minus motor side
    velocity,         ///< of the axis; for checks only
    force,            ///< of the drive on the load: force, torque, or current times a constant
    applied_force,    ///< known, on the load beside that of the drive
    added_force,      ///< known, added by the controller to its demand: part of force
    deflection,       ///< of the probe
    bar,              ///< length of a ball bar less its nominal one
    tool_position,    ///< of the tool centre in the frame of the table
    cosine,           ///< raw signal of the probe or of an encoder
    sine,
    temperature,
    clock  ///< time stamps of the device itself
  };

  struct Time {
    std::string column;
    int number = 0;       ///< of the column, from 1
    std::string unit;     ///< s, ms, us, ns, min
    double rate = 0;      ///< [Hz] where there is no such column
    double jitter = 0.2;  ///< of a period, that a time stamp may be off
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("column", p.column, "heading of the column with the time");
      visit("number", p.number, Range{0, 100000}, "its number from 1, instead of the heading");
      visit("unit", p.unit, "s, ms, us, ns or min");
      visit("rate_hz", p.rate, unit::hz, Range{0, 1e7},
            "samples per second, without such a column");
      visit("jitter_percent", p.jitter, Unit{"percent", 0.01}, Range{0, 49},
            "how far a time stamp may be off the uniform grid, in shares of the sampling period");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  struct Axis {
    std::string name;   ///< what the user calls it
    std::string place;  ///< X Y Z A C of the machine file, x y z of probe and table
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("name", p.name, "what the signals call it, e.g. \"carriage\", \"joint 2\"");
      visit("place", p.place,
            "its axis in the machine file: X, Y, Z (linear), A, C (rotary), or x, y, z of probe "
            "or table");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  struct Signal {
    std::string column;
    int number = 0;
    Kind kind = Kind::position;
    std::string axis;
    std::string unit;
    double scale = 1;   ///< units per one of the column
    int sign = 1;       ///< -1: the column counts the other way
    double offset = 0;  ///< added, in the unit
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("column", p.column, "heading of the column (HDF5: path of the data set)");
      visit("number", p.number, Range{0, 100000}, "number of the column from 1, instead of it");
      visit.choice("kind", p.kind,
                   {{"command", Kind::command},
                    {"position", Kind::position},
                    {"motor_position", Kind::motor_position},
                    {"load_position", Kind::load_position},
                    {"following_error", Kind::following_error},
                    {"twist", Kind::twist},
                    {"velocity", Kind::velocity},
                    {"force", Kind::force},
                    {"applied_force", Kind::applied_force},
                    {"added_force", Kind::added_force},
                    {"deflection", Kind::deflection},
                    {"bar", Kind::bar},
                    {"tool_position", Kind::tool_position},
                    {"cosine", Kind::cosine},
                    {"sine", Kind::sine},
                    {"temperature", Kind::temperature},
                    {"clock", Kind::clock}},
                   "what it is; position: by the measuring system the loop is closed with");
      visit("axis", p.axis, "X, Y, Z, A, C; x, y, z of probe or table; or a name of `axes`");
      visit("unit", p.unit, "unit of the column, after scale");
      visit("scale", p.scale, Unit{"", 1}, Range{-1e12, 1e12},
            "units per one of the column, e.g. newtons per volt or metres per count");
      visit("sign", p.sign, Range{-1, 1}, "-1: the column counts the other way");
      visit("offset", p.offset, Unit{"", 1}, Range{-1e12, 1e12}, "added after scale, in the unit");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  struct Lap {
    double from = 0, to = 0;  ///< [s] in the time of the table
    std::string condition;    ///< equal for repetitions of the same motion
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("from_s", p.from, unit::s, Range{-1e12, 1e12}, "begin, in the time of the table");
      visit("to_s", p.to, unit::s, Range{-1e12, 1e12}, "end");
      visit("condition", p.condition, "the same text for repetitions of the same motion");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  /// A ball bar, and the circle it is read on.
  struct Bar {
    enum class Plane { XY, ZX, YZ };
    Vec3 centre = Vec3::Zero();  ///< X, Y, Z of the machine at the circle's centre [m]
    double radius = 0;           ///< nominal length [m]; 0: no bar
    Plane plane = Plane::XY;
    double feed = 0;  ///< of the arcs [m/s]
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("centre_mm", p.centre, unit::mm, Range{-1e5, 1e5},
            "machine coordinates X, Y, Z of the circle's centre");
      visit("radius_mm", p.radius, unit::mm, Range{0, 1e4},
            "nominal length of the bar, which is the radius of the circle; 0: no bar");
      visit.choice("plane", p.plane, {{"XY", Plane::XY}, {"ZX", Plane::ZX}, {"YZ", Plane::YZ}},
                   "of the arcs; angles count from its first axis to its second one");
      visit("feed_mm_min", p.feed, unit::mm_min, Range{0, 1e6}, "of the arcs");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  /// What sees where the tool is against the table: grid encoder, R-test.
  struct ToolPosition {
    Vec3 zero = Vec3::Zero();  ///< X, Y, Z of the machine at which it reads nought [m]
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("zero_mm", p.zero, unit::mm, Range{-1e5, 1e5},
            "machine coordinates X, Y, Z at which it reads 0, with rotary axes as the run begins");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  /// What a bar was read on, where no commands were recorded.
  struct Arc {
    double from = 0;         ///< [s] in the time of the table
    double start = 0;        ///< angle [rad]
    double sweep = 2 * kPi;  ///< negative: clockwise [rad]
    KeyLines lines;

    template <class Self, class Visit>
    static void fields(Self& p, Visit& visit) {
      visit("from_s", p.from, unit::s, Range{-1e12, 1e12}, "begin, in the time of the table");
      visit("start_deg", p.start, unit::deg, Range{-3600, 3600}, "angle at which it begins");
      visit("sweep_deg", p.sweep, unit::deg, Range{-36000, 36000},
            "angle it covers; clockwise: negative");
      if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
    }
  };

  enum class Separator { any, comma, semicolon, tab, space };
  enum class Decimal { point, comma };

  std::string machine;  ///< declared machine file
  Separator separator = Separator::any;
  Decimal decimal = Decimal::point;
  std::vector<std::string> missing;  ///< texts that stand for "no value"
  bool detect_laps = true;
  std::string lap_column, condition_column;
  Time time;
  std::vector<Axis> axes;
  std::vector<Signal> signals;
  std::vector<Lap> laps;
  Bar bar;
  std::vector<Arc> arcs;
  ToolPosition tool_position;
  KeyLines lines;

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("machine", p.machine, "declared machine file, relative to this file");
    visit.choice("separator", p.separator,
                 {{"any", Separator::any},
                  {"comma", Separator::comma},
                  {"semicolon", Separator::semicolon},
                  {"tab", Separator::tab},
                  {"space", Separator::space}},
                 "between the values of a text table; any: told from its first lines");
    visit.choice("decimal", p.decimal, {{"point", Decimal::point}, {"comma", Decimal::comma}},
                 "sign before the decimals of a text table; comma: 1,5 is one and a half");
    visit("missing", p.missing, "values that mean there is none, besides nothing and nan");
    visit("detect_laps", p.detect_laps,
          "look for repetitions of the same motion in the commands, where no laps are given");
    visit("lap_column", p.lap_column, "a new lap begins wherever this column changes");
    visit("condition_column", p.condition_column,
          "laps with the same number here repeat the same motion");
    visit.group("time", p.time, "where the time comes from");
    visit.list("axes", p.axes, "names of the user's own for places of the machine file");
    visit.list("signals", p.signals, "the columns that count");
    visit.list("laps", p.laps, "the parts of the run that count");
    visit.group("bar", p.bar, "where a ball bar was, for a column of kind bar");
    visit.list("arcs", p.arcs, "what it was read on at constant feed, instead of commands");
    visit.group("tool_position", p.tool_position,
                "where a grid encoder or an R-test was, for columns of kind tool_position");
    if constexpr (requires { visit.lines(p.lines); }) visit.lines(p.lines);
  }
};

std::string_view to_string(ImportMap::Kind kind);

/// Where a signal belongs in a record.
struct SignalPlace {
  std::size_t axis = 0;
  bool probe = false;   ///< axis counts x, y, z of the probe, or of the table
  bool rotary = false;  ///< of an axis
};

/// Of a map that parse_import_map() has let pass.
SignalPlace place_of(const ImportMap& map, const ImportMap::Signal& signal);

/// The column's value in SI.
double to_si(const ImportMap::Signal& signal, double value);

/// What single keys cannot say: columns and signals given twice, unknown axes, units of another
/// dimension. Throws ConfigError with FILE:LINE, key and what is allowed.
void check_import_map(const ImportMap& map, const std::string& name);

ImportMap parse_import_map(std::string_view toml, const std::string& name);
/// The machine file becomes absolute.
ImportMap load_import_map(const std::string& path);

/// The reference of all keys as Markdown.
std::string import_map_key_reference();

}  // namespace vcnc
