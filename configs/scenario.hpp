// A scenario of the overtravel protection as data: what a scenario file may hold, and how it is
// read.
//
// A scenario is a machine (file, assignments, injections), something that goes wrong, and what the
// protection must make of it. What goes wrong is a program of the user's, or one of the built-in
// kinds, which need no program: they put the ball next to a surface and drive it there.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/fields.hpp"
#include "model/math.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

struct Scenario {
  enum class Kind {
    program,        ///< the user's own program
    program_error,  ///< the programmed end point lies in the material
    wrong_offset,   ///< the piece does not stand where the work offset says
    wrong_length,   ///< the stylus is longer than its tool length says
    not_retracted,  ///< a rapid runs through the piece
    rotary,         ///< the A axis swings the ball and the piece into each other
    spindle_start,  ///< M3 with the probe in the spindle
    scan            ///< nothing goes wrong: approach, scan, retract
  };
  enum class Target { plane, sphere, bore, piece };
  enum class Expect {
    soft_stop,   ///< feed hold and retraction, no quick stop
    hard,        ///< quick stop of all axes
    trip,        ///< one of the two
    safe,        ///< refused before anything moves, or tripped
    refused,     ///< refused before anything moves
    fault_safe,  ///< with faults: safe whatever they are, see apps/lockout_fault.hpp
    none         ///< no trip; the program comes to its end
  };

  std::string name;
  std::string machine;              ///< machine file
  std::vector<std::string> set;     ///< as --set
  std::vector<std::string> inject;  ///< as --inject
  int seed = 1;                     ///< of all noise
  Kind kind = Kind::program;
  Expect expect = Expect::trip;
  std::string program;              ///< kind program: G-code file ...
  std::string gcode;                ///< ... or the program itself
  std::vector<std::string> faults;  ///< of modules and of the bus
  bool within_limit = true;         ///< the deflection must stay below the mechanical limit
  double reading_error = 5e-6;  ///< [m] deflections read wrong by less are no reason to complain

  // The built-in kinds. The way is along which the ball comes, relative to the tool.
  double feed = 1000e-3 / 60;    ///< [m/s]
  double rotary_feed = 0.3;      ///< [rad/s] kind rotary
  double axial_angle = 0;        ///< [rad] of the way: 0 across the tool, 90 deg along it
  double azimuth = 0;            ///< [rad] of the way about the tool
  double incidence = 0;          ///< [rad] between the surface normal and the way (plane)
  double incidence_azimuth = 0;  ///< [rad] of that tilt about the way
  double a = 0, c = 0;           ///< [rad] positions of the rotary axes
  double turn = 0;               ///< [rad] C turns by this on the way (RTCP)
  Target target = Target::plane;
  Vec3 at{0, 0, 0.06};       ///< ball centre when it first touches, workpiece frame [m]
  double station = 0;        ///< target piece: share of the way around it instead of `at`
  double radius = 0.025;     ///< sphere, bore [m]
  double run_up = 2e-3;      ///< [m] free way before the ball touches
  double depth = 8e-3;       ///< [m] way beyond the first touch that is driven
  double predeflection = 0;  ///< [m] scan: interference; else > 0: a dwell in contact on the way
  double sideways = 3e-3;    ///< [m] scan: way along the surface

  PieceParams piece;  ///< kind program: a piece of its own instead of the machine's
  /// Whether the file gives a piece.
  bool has_piece() const { return piece.kind != PieceParams::Kind::ruled || !piece.bottom.empty(); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("name", p.name, "shown in the results");
    visit("machine", p.machine, "machine file, relative to this file");
    visit("set", p.set, "assignments as of --set, e.g. \"probe.stylus_mass_g=30\"");
    visit("inject", p.inject, "injections as of --inject, e.g. \"X.backlash.gap_um=12\"");
    visit("seed", p.seed, Range{0, 2147483647}, "seed of all noise");
    visit.choice("kind", p.kind,
                 {{"program", Kind::program},
                  {"program_error", Kind::program_error},
                  {"wrong_offset", Kind::wrong_offset},
                  {"wrong_length", Kind::wrong_length},
                  {"not_retracted", Kind::not_retracted},
                  {"rotary", Kind::rotary},
                  {"spindle_start", Kind::spindle_start},
                  {"scan", Kind::scan}},
                 "what goes wrong; program: see program, gcode");
    visit.choice("expect", p.expect,
                 {{"soft_stop", Expect::soft_stop},
                  {"hard", Expect::hard},
                  {"trip", Expect::trip},
                  {"safe", Expect::safe},
                  {"refused", Expect::refused},
                  {"fault_safe", Expect::fault_safe},
                  {"none", Expect::none}},
                 "what the machine must do; trip: soft_stop or hard; safe: refused or trip; "
                 "fault_safe: whatever the faults allow");
    visit("program", p.program, "kind program: G-code file, relative to this file");
    visit("gcode", p.gcode, "kind program: the program itself");
    visit("faults", p.faults,
          "as of vcnc run --fault; at=contact lets from_s count from the first touch, e.g. "
          "\"probe mute at=contact from_s=0.02\"");
    visit("within_limit", p.within_limit,
          "the deflection must stay below the probe's mechanical limit");
    visit("reading_error_um", p.reading_error, unit::um, Range{0.01, 1000},
          "how wrong a deflection may be read");
    visit("feed_mm_min", p.feed, unit::mm_min, Range{1, 1e6}, "feed of the way");
    visit("rotary_feed_deg_s", p.rotary_feed, unit::deg_s, Range{0.01, 1e4},
          "kind rotary: speed of the A axis");
    visit("axial_deg", p.axial_angle, unit::deg, Range{0, 90},
          "way relative to the tool: 0 across, 90 along it");
    visit("azimuth_deg", p.azimuth, unit::deg, Range{-360, 360}, "way about the tool");
    visit("incidence_deg", p.incidence, unit::deg, Range{0, 75},
          "plane: angle between its normal and the way");
    visit("incidence_azimuth_deg", p.incidence_azimuth, unit::deg, Range{-360, 360},
          "plane: of that tilt about the way");
    visit("a_deg", p.a, unit::deg, Range{-180, 180}, "position of the A axis");
    visit("c_deg", p.c, unit::deg, Range{-3600, 3600}, "position of the C axis");
    visit("turn_deg", p.turn, unit::deg, Range{-90, 90}, "C turns by this on the way");
    visit.choice("target", p.target,
                 {{"plane", Target::plane},
                  {"sphere", Target::sphere},
                  {"bore", Target::bore},
                  {"piece", Target::piece}},
                 "what is run into; piece: the machine's own");
    visit("at_mm", p.at, unit::mm, Range{-1e4, 1e4},
          "ball centre at the first touch, workpiece frame");
    visit("station", p.station, unit::none, Range{0, 1},
          "target piece: where, as a share of the way around it at mid-height");
    visit("radius_mm", p.radius, unit::mm, Range{5, 1e4}, "sphere, bore");
    visit("run_up_mm", p.run_up, unit::mm, Range{0.01, 500}, "free way before the first touch");
    visit("depth_mm", p.depth, unit::mm, Range{0.01, 100}, "way beyond the first touch");
    visit("predeflection_mm", p.predeflection, unit::mm, Range{0, 10},
          "scan: interference; else: a dwell at this depth on the way");
    visit("sideways_mm", p.sideways, unit::mm, Range{0, 100}, "scan: way along the surface");
    visit.effect("piece", p.piece, "kind program: a piece instead of the machine's");
  }
};

/// Reads a scenario file; paths in it become absolute, relative to the file. Throws ConfigError.
Scenario load_scenario(const std::string& path);
/// The same for text; paths stay as they are.
Scenario parse_scenario(std::string_view toml, const std::string& name);
/// parse(to_toml(x)) gives x.
std::string to_toml(const Scenario& scenario);
/// The reference of all keys as Markdown.
std::string scenario_key_reference();

/// What single ranges cannot say. Throws ConfigError; `name` stands for the file.
void check_scenario(const Scenario& scenario, const std::string& name);

/// As they are written in a file.
const char* to_string(Scenario::Kind kind);
const char* to_string(Scenario::Expect expect);

}  // namespace vcnc
