// Canned cycles: G73 G74 G76 G81 .. G89.
//
// Each hole: rapid in the plane at the present height, rapid to R, the cycle to Z, back to R (G99)
// or to the height before the first hole if that is above R (G98). Under G90 R and Z are positions
// and L repeats in place; under G91 R counts from the height before the first cycle, Z from R, and
// L steps on by X, Y.
//   G73 feed by Q, back by kChipBreak      G83 feed by Q, out to R, rapid back to kPeckClearance
//   G82 dwell P     G84 G74 tap: dwell, spindle reversed, feed out     G85 feed out
//   G86 dwell, spindle stop, rapid out     G88 the same     G89 dwell, feed out
//   While tapping the operator's feed hold waits for the way out, and overrides stand at 100 %.
//   G76 (Fanuc) dwell, spindle oriented, aside by Q in +X, rapid out, back, spindle on
//   G87 (Fanuc) oriented, aside by Q, rapid to R below, back, spindle on, feed up to Z, dwell,
//       oriented, aside, rapid out, back, spindle on
// Source: LinuxCNC user manual, "Canned cycles"; Fanuc series 30i user's manual for G76.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr double kChipBreak = 0.254e-3;      ///< [m]
constexpr double kPeckClearance = 0.254e-3;  ///< [m]
constexpr int kMostCycleRepeats = 100'000;
constexpr double kMostPecks = 100'000;

}  // namespace

void ProgramRun::cycle_move(const Coordinates& words, Move::Kind kind) {
  Move move;
  move.kind = kind;
  move.start = position_;
  move.end = work_.to_frame(words);
  // What the words leave as it is stays so to the last bit.
  for (Eigen::Index i = 0; i < 5; ++i)
    if (std::abs(move.end[i] - move.start[i]) < 1e-12) move.end[i] = move.start[i];
  if (move.end == move.start) return;
  if (kind == Move::Kind::line) set_move_feed(move);
  const bool tapping = cycle_.code == 740 || cycle_.code == 840;
  if (tapping && kind == Move::Kind::line) move.panel = Move::Panel::locked;
  emit_move(std::move(move));
}

void ProgramRun::cycle_dwell(double seconds) {
  if (seconds > 0) emit(Dwell{seconds, line_number()});
}

void ProgramRun::cycle_spindle(int code) {
  using Mode = SpindleWord::Mode;
  const Mode mode = code == 3    ? Mode::clockwise
                    : code == 4  ? Mode::counter_clockwise
                    : code == 19 ? Mode::orient
                                 : Mode::off;
  const bool turns = code == 3 || code == 4;
  emit(SpindleWord{mode, turns ? spindle_speed_at(position_[kX]) : 0, line_number(),
                   turns ? modal_.surface : std::nullopt});
}

void ProgramRun::emit_cycle(int code) {
  const std::string name = code_name(code);
  const int column = words_.column(GGroup::motion);
  need_no_compensation(name.c_str(), column);
  if (modal_.feed == 930) fail(name + " under G93; allowed are G94 and G95", column);
  if (words_.any_of("AC")) fail(name + " with A or C; allowed are X Y Z", column);
  const std::size_t n = modal_.normal;
  const auto w = static_cast<Eigen::Index>(n);
  if (work_.program().linear(w, w) != 1)
    fail(fmt::format("{} while {} is scaled or mirrored", name, kAxisLetters[n]), column);
  const char letter_w = kAxisLetters[n];
  if (words_.has(GGroup::motion) && !words_.any_of("XYZ"))
    fail(name + " without X, Y or Z", column);
  words_.use("XYZRLQP");
  if (code == 760) words_.use("IJ");
  if (modal_.surface && (code == 740 || code == 840))
    fail(name + " under G96; allowed is G97", column);

  if (words_.has('R')) cycle_.r = length('R');
  if (words_.has(letter_w)) cycle_.z = length(letter_w);
  if (words_.has('Q')) cycle_.q = length('Q');
  if (words_.has('P')) cycle_.p = words_.value('P') * (fanuc_ ? 1e-3 : 1);
  if (!cycle_.r) fail(name + " without R", column);
  if (!cycle_.z) fail(fmt::format("{} without {}", name, letter_w), column);
  if ((code == 730 || code == 830) && !(cycle_.q.value_or(0) > 0))
    fail(name + " needs Q greater than 0", std::max(column, words_.column('Q')));
  if ((code == 820 || code == 890 || code == 860 || code == 880) && !cycle_.p) {
    if (!fanuc_) fail(name + " without P (the dwell)", column);
    cycle_.p = 0;
  }
  if (cycle_.p.value_or(0) < 0 || cycle_.p.value_or(0) > 36000)
    fail("P of a cycle must be 0 to 36000 seconds", words_.column('P'));
  const int turns = code == 840 ? 3 : code == 740 ? 4 : modal_.spindle;
  const bool needs_spindle =
      code == 740 || code == 760 || code == 840 || code == 860 || code == 870 || code == 880;
  if (needs_spindle && modal_.spindle != 3 && modal_.spindle != 4)
    fail(name + " with the spindle at rest; M3 or M4 first", column);
  if (turns != modal_.spindle) fail(fmt::format("{} needs M{}", name, turns), column);
  const int repeats = words_.has('L') ? whole_number(words_.value('L')) : 1;
  if (repeats < 0 || repeats > kMostCycleRepeats)
    fail(
        fmt::format("L{:g} of {}: allowed are 0 to {}", words_.value('L'), name, kMostCycleRepeats),
        words_.column('L'));

  Coordinates at = work_.to_words(position_);
  if (!cycle_.initial) cycle_.initial = at[w];
  // LinuxCNC goes on from the height before the first of equal cycles, Fanuc from the present one.
  const bool goes_on = cycle_.code == code;
  cycle_.code = code;
  if (goes_on && modal_.to_initial && !fanuc_) at[w] = *cycle_.initial;
  const double initial = at[w];
  const double plane = modal_.absolute ? *cycle_.r : *cycle_.initial + *cycle_.r;
  const double bottom = modal_.absolute ? *cycle_.z : plane + *cycle_.z;
  if (code == 870) {
    if (bottom < plane)
      fail(fmt::format("{}: {} {:.4f} mm is below R {:.4f} mm, from where it bores upwards", name,
                       letter_w, bottom * 1e3, plane * 1e3),
           words_.column(letter_w));
    if (!modal_.to_initial) fail(name + " under G99; allowed is G98", column);
    if (!(cycle_.q.value_or(0) > 0)) fail(name + " needs Q greater than 0", column);
  } else if (bottom > plane)
    fail(fmt::format("{}: R {:.4f} mm is below {} {:.4f} mm", name, plane * 1e3, letter_w,
                     bottom * 1e3),
         words_.column('R'));
  if (initial < plane && code != 870) {
    at[w] = plane;
    cycle_move(at, Move::Kind::rapid);
  }
  const double clear = modal_.to_initial ? std::max(*cycle_.initial, plane) : plane;
  for (int i = 0; i < repeats; ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const char letter = kAxisLetters[static_cast<std::size_t>(axis)];
      if (axis == w || !words_.has(letter)) continue;
      const double word = length(letter);
      at[axis] = modal_.absolute ? word : at[axis] + word;
    }
    if (polar_) put_polar(at);
    cycle_move(at, Move::Kind::rapid);
    if (code != 870) {
      at[w] = plane;
      cycle_move(at, Move::Kind::rapid);
    }
    cycle_bottom(code, at, bottom, clear, plane);
    at[w] = clear;
  }
}

void ProgramRun::cycle_bottom(int code, Coordinates at, double bottom, double clear, double plane) {
  const auto w = static_cast<Eigen::Index>(modal_.normal);
  const auto rapid = [&](double height) {
    at[w] = height;
    cycle_move(at, Move::Kind::rapid);
  };
  const auto feed = [&](double height) {
    at[w] = height;
    cycle_move(at, Move::Kind::line);
  };
  const double dwell = cycle_.p.value_or(0);
  const int spindle = modal_.spindle;
  switch (code) {
    case 730:
    case 830: {
      if ((plane - bottom) / *cycle_.q > kMostPecks)
        fail(fmt::format("Q{:.6f} mm is too small for this depth", *cycle_.q * 1e3),
             words_.column('Q'));
      for (double depth = plane - *cycle_.q; depth > bottom; depth -= *cycle_.q) {
        feed(depth);
        if (code == 730) {
          rapid(depth + kChipBreak);
        } else {
          rapid(plane);
          rapid(depth + kPeckClearance);
        }
      }
      feed(bottom);
      rapid(clear);
      break;
    }
    case 740:
    case 840:
      feed(bottom);
      cycle_spindle(5);
      cycle_dwell(dwell);
      cycle_spindle(spindle == 3 ? 4 : 3);
      feed(plane);
      cycle_spindle(5);
      cycle_spindle(spindle);
      rapid(clear);
      break;
    case 760: {
      feed(bottom);
      cycle_dwell(dwell);
      cycle_spindle(19);
      Coordinates aside = at;
      const double shift = cycle_.q.value_or(0);
      aside[static_cast<Eigen::Index>((modal_.normal + 1) % 3)] += shift;
      cycle_move(aside, Move::Kind::rapid);
      aside[w] = clear;
      cycle_move(aside, Move::Kind::rapid);
      rapid(clear);
      cycle_spindle(spindle);
      break;
    }
    case 870: {
      const auto aside = static_cast<Eigen::Index>((modal_.normal + 1) % 3);
      const auto across = [&](double way) {
        at[aside] += way;
        cycle_move(at, Move::Kind::rapid);
      };
      const double shift = cycle_.q.value_or(0);
      cycle_spindle(19);
      across(shift);
      rapid(plane);
      across(-shift);
      cycle_spindle(spindle);
      feed(bottom);
      cycle_dwell(dwell);
      cycle_spindle(19);
      across(shift);
      rapid(std::max(clear, *cycle_.initial));
      across(-shift);
      cycle_spindle(spindle);
      break;
    }
    case 850:
    case 890:
      feed(bottom);
      if (code == 890) cycle_dwell(dwell);
      feed(code == 890 && !fanuc_ ? clear : plane);
      rapid(clear);
      break;
    case 860:
    case 880:
      feed(bottom);
      cycle_dwell(dwell);
      cycle_spindle(5);
      rapid(clear);
      cycle_spindle(spindle);
      break;
    default:
      feed(bottom);
      if (code == 820) cycle_dwell(dwell);
      rapid(clear);
  }
}

}  // namespace vcnc
