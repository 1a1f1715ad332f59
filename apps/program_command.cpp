#include "apps/program_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/output_file.hpp"
#include "configs/config.hpp"
#include "controller/diagnosis_program.hpp"
#include "controller/player.hpp"
#include "controller/program_writer.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc {

namespace {

/// In the head of every program of ours.
constexpr const char* kMark = "\n(Machine: ";

struct Arguments : ProgramOptions {
  std::string machine, out, axis = "X", direction = "ccw";
  std::vector<std::string> assignments;
};

std::unique_ptr<Piece> declared_piece(const Machine& machine) {
  return machine.setup.piece.empty() ? nullptr : make_piece(load_piece(machine.setup.piece));
}

const Piece& needed(const std::unique_ptr<Piece>& piece) {
  if (!piece) throw InputError("the machine file names no piece (setup.piece)");
  return *piece;
}

std::string program_text(const std::string& kind, const Machine& machine, const Arguments& a) {
  const std::unique_ptr<Piece> piece = declared_piece(machine);
  if (kind == "s-piece") return s_piece_program(machine, needed(piece), a);
  if (kind == "cone") return cone_program(machine, needed(piece), a);
  if (kind == "circle") return circle_program(machine, piece.get(), a);
  if (kind == "diagnosis") return diagnosis_program(machine, piece.get(), a);
  return step_program(machine, a);
}

/// Writes the file only if the machine can run it.
void write_program(const std::string& kind, Arguments a) {
  const Machine machine = load_machine(a.machine, a.assignments);
  a.ProgramOptions::direction = a.direction == "cw" ? ProgramOptions::Direction::clockwise
                                                    : ProgramOptions::Direction::counter_clockwise;
  a.ProgramOptions::axis = axis_named(a.axis);
  std::string text;
  try {
    text = program_text(kind, machine, a);
  } catch (const std::invalid_argument& e) {
    throw InputError(std::string("vcnc program ") + kind + ": " + e.what());
  }
  OutputFile out("--out", a.out, kMark);
  out.stream() << text;
  try {
    if (const auto file = out.so_far()) Player(*file, machine);
  } catch (const ProgramError& e) {
    throw InputError(std::string("this machine cannot run the program: ") + e.what());
  }
  out.commit();
  std::cout << a.out << ": " << std::count(text.begin(), text.end(), '\n') << " lines\n";
}

CLI::App* add_kind(CLI::App& program, const char* kind, const char* what,
                   const std::shared_ptr<Arguments>& a) {
  CLI::App* sub = program.add_subcommand(kind, what);
  sub->add_option("--machine", a->machine, "machine file; names the piece")->required();
  sub->add_option("--set", a->assignments, "override a key of the machine file")
      ->allow_extra_args(false);
  sub->add_option("--out", a->out, "G-code file to write")->required();
  sub->add_option("--feed-mm-min", a->feed_mm_min, "feed of the lap (deg/min for a rotary step)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--tolerance-um", a->tolerance_um, "G64 P tolerance")->check(CLI::PositiveNumber);
  sub->callback([kind, a] { write_program(kind, *a); });
  return sub;
}

void add_scan_options(CLI::App* sub, const std::shared_ptr<Arguments>& a) {
  sub->add_option("--approach-feed-mm-min", a->approach_feed_mm_min, "feed towards the piece")
      ->check(CLI::PositiveNumber);
  sub->add_option("--predeflection-mm", a->predeflection_mm,
                  "interference; default: setup.predeflection_mm");
  sub->add_option("--settle-s", a->settle_s, "dwell between approach and lap")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--laps", a->laps, "number of laps")->check(CLI::Range(1, 1000));
}

void add_rim_options(CLI::App* sub, const std::shared_ptr<Arguments>& a) {
  add_scan_options(sub, a);
  sub->add_option("--height-mm", a->height_mm,
                  "of the ball centre above the base; default: mid-height");
  sub->add_option("--chord-tolerance-um", a->chord_tolerance_um, "of the point list")
      ->check(CLI::PositiveNumber);
  sub->add_option("--run-in-mm", a->run_in_mm, "before and after the lap")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--approach-mm", a->approach_mm, "where the approach begins")
      ->check(CLI::PositiveNumber);
  sub->add_option("--clearance-mm", a->clearance_mm, "travel height over the piece")
      ->check(CLI::PositiveNumber);
}

}  // namespace

void add_program_command(CLI::App& app) {
  CLI::App* program = app.add_subcommand("program", "write a test program as G-code");
  program->require_subcommand(1);
  const auto a = std::make_shared<Arguments>();
  add_rim_options(add_kind(*program, "s-piece", "one lap around the S-shaped test piece", a), a);
  add_rim_options(add_kind(*program, "cone", "one lap around a cone, five axes", a), a);

  CLI::App* circle = add_kind(*program, "circle", "laps inside a ring gauge", a);
  add_scan_options(circle, a);
  circle->add_option("--radius-mm", a->radius_mm, "radius of the path; default: from the ring")
      ->check(CLI::PositiveNumber);
  circle->add_option("--direction", a->direction, "cw or ccw")->check(CLI::IsMember({"cw", "ccw"}));
  circle->add_option("--plane", a->plane, "17 XY, 18 ZX, 19 YZ")
      ->check(CLI::IsMember({17, 18, 19}));
  circle->add_option("--height-mm", a->height_mm,
                     "of the ball centre; default: mid-height of the ring");

  const auto d = std::make_shared<Arguments>();
  d->laps = 2;
  d->feed_mm_min = 2200;
  CLI::App* diagnosis =
      add_kind(*program, "diagnosis", "rings, ladders, lines and spins that show most effects", d);
  diagnosis->add_option("--laps", d->laps, "of each ring")->check(CLI::Range(2, 100));
  diagnosis->add_option("--radius-mm", d->radius_mm, "of the rings without a piece")
      ->check(CLI::PositiveNumber);
  diagnosis->add_option("--predeflection-mm", d->predeflection_mm,
                        "interference; default: setup.predeflection_mm");

  CLI::App* step = add_kind(*program, "step", "one axis in steps forward and back, with dwell", a);
  step->add_option("--axis", a->axis, "X Y Z A C")->check(CLI::IsMember({"X", "Y", "Z", "A", "C"}));
  step->add_option("--step", a->step_size, "size of a step [mm or deg]");
  step->add_option("--steps", a->steps, "number of steps")->check(CLI::Range(1, 10000));
  step->add_option("--dwell-s", a->dwell_s, "dwell at each position")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace vcnc
