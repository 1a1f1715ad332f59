// The part of the interpreter that turns axis words into moves.
#include <fmt/format.h>

#include <cmath>

#include "controller/gcode.hpp"

namespace vcnc {
namespace {

using Group = GcodeLine::Group;

constexpr double kRadiusTolerance = 2e-6, kRadiusToleranceShare = 1e-3;
constexpr double kStillTip = 1e-7;      ///< a shorter way counts as a pure turn of A and C [m]
constexpr double kLongestMove = 36000;  ///< [s]; beyond it F is surely a mistake

}  // namespace

Coordinates GcodeInterpreter::target(const GcodeLine& line, bool machine_coordinates) const {
  Coordinates end = position_;
  const Vec3& offset = machine_.setup.work_offset[modal_.offset];
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const char letter = kAxisLetters[i];
    if (!line.has(letter)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = line.value(letter) * (is_rotary(i) ? kDegree : modal_.length_unit);
    if (!modal_.absolute) {
      end[row] += word;
      continue;
    }
    end[row] = word;
    if (machine_coordinates || is_rotary(i) || frame_.rtcp) continue;
    end[row] += offset[row];
    if (i == kZ) end[row] += modal_.tool_length;
  }
  return end;
}

void GcodeInterpreter::emit_motion(const GcodeLine& line) {
  const bool machine_coordinates = line.is(Group::once, 530);
  const bool arc = modal_.motion.value_or(0) >= 2;
  const bool arc_words = line.has('I') || line.has('J') || line.has('K') || line.has('R');
  if (arc_words && !arc) fail("I, J, K or R without G2 or G3");
  if (!line.any_axis() && !arc_words) {
    if (machine_coordinates) fail("G53 without axis words");
    if (line.g.contains(Group::motion) && arc)
      fail("arc without end point and centre; allowed are axis words with I J K or R");
    return;
  }
  if (line.is(Group::once, 40)) return;
  if (!modal_.motion) fail("axis words without G0, G1, G2 or G3");
  if (machine_coordinates) {
    if (arc) fail("G53 with G2 or G3; allowed are G0 and G1");
    if (!modal_.absolute) fail("G53 under G91; allowed is G90");
    if (frame_.rtcp) fail("G53 while G43.4 is active; cancel with G49 first");
  }

  Move move;
  move.start = position_;
  move.end = target(line, machine_coordinates);
  move.alone = machine_coordinates;
  if (arc) {
    move.kind = Move::Kind::arc;
    move.arc = arc_to(line, move.end);
  } else {
    move.kind = *modal_.motion == 0 ? Move::Kind::rapid : Move::Kind::line;
  }
  if (move.kind != Move::Kind::rapid) set_move_feed(move);
  emit_move(std::move(move));
}

void GcodeInterpreter::set_move_feed(Move& move) const {
  if (!(modal_.linear_feed > 0))
    fail(fmt::format("G{} without F{}", *modal_.motion,
                     modal_.inverse_time ? "; under G93 every block needs its own" : ""));
  const Coordinates way = move.end - move.start;
  double tip = way.head<3>().norm();
  if (move.kind == Move::Kind::arc) {
    Vec3 radius = move.start.head<3>() - move.arc.centre;
    radius[static_cast<Eigen::Index>(move.arc.normal)] = 0;
    tip = std::max(tip, std::abs(move.arc.sweep) * radius.norm());
  }
  double seconds = 0;
  if (modal_.inverse_time) {
    move.feed_mode = Move::Feed::time;
    seconds = move.feed = 1 / modal_.linear_feed;
  } else if (tip < kStillTip) {
    move.feed_mode = Move::Feed::rotary;
    move.feed = modal_.rotary_feed;
    seconds = way.tail<2>().norm() / move.feed;
  } else {
    move.feed_mode = Move::Feed::tip;
    move.feed = modal_.linear_feed;
    seconds = tip / move.feed;
  }
  if (seconds > kLongestMove)
    fail(fmt::format("at this F the move would last {:.1f} h; allowed is up to {:.0f} h",
                     seconds / 3600, kLongestMove / 3600));
}

Arc GcodeInterpreter::arc_to(const GcodeLine& line, const Coordinates& end) const {
  if (!frame_.rtcp && (line.has('A') || line.has('C')))
    fail("G2 or G3 with A or C; allowed only while G43.4 is active");
  const std::size_t n = modal_.normal;
  const auto u = static_cast<Eigen::Index>((n + 1) % 3), v = static_cast<Eigen::Index>((n + 2) % 3);
  constexpr std::string_view kCentreLetters = "IJK";
  if (line.has(kCentreLetters[n]))
    fail(fmt::format("{} does not lie in the plane G{}", kCentreLetters[n], 19 - n));
  const Eigen::Vector2d from(position_[u], position_[v]), to(end[u], end[v]);
  const char centre_u = kCentreLetters[static_cast<std::size_t>(u)];
  const char centre_v = kCentreLetters[static_cast<std::size_t>(v)];
  const bool by_centre = line.has(centre_u) || line.has(centre_v);
  const bool clockwise = *modal_.motion == 2;
  if (by_centre == line.has('R'))
    fail(by_centre ? "arc with R and with I J K; allowed is one of both"
                   : "arc without centre; allowed are I J K or R");

  Eigen::Vector2d centre = from;
  if (by_centre) {
    if (line.has(centre_u)) centre[0] += line.value(centre_u) * modal_.length_unit;
    if (line.has(centre_v)) centre[1] += line.value(centre_v) * modal_.length_unit;
  } else {
    const double r = line.value('R') * modal_.length_unit;
    const Eigen::Vector2d chord = to - from;
    const double half = chord.norm() / 2;
    if (half < 1e-9) fail("arc by R that ends where it starts; give the centre by I J K");
    const double excess = half - std::abs(r);
    if (excess > kRadiusTolerance + kRadiusToleranceShare * std::abs(r))
      fail(fmt::format("R{} is shorter than half the chord, {:.4f} mm", line.value('R'),
                       half * 1e3));
    // Up to half a turn for R > 0, more for R < 0; the centre lies left of the chord for the
    // shorter counter-clockwise arc.
    const double rise = std::sqrt(std::max(0.0, r * r - half * half));
    const Eigen::Vector2d left = Eigen::Vector2d(-chord[1], chord[0]) / (2 * half);
    centre = from + chord / 2 + left * (((r > 0) != clockwise) ? rise : -rise);
  }

  const Eigen::Vector2d r0 = from - centre, r1 = to - centre;
  if (r0.norm() < 1e-9) fail("arc of radius 0");
  const double mismatch = std::abs(r0.norm() - r1.norm());
  if (mismatch > kRadiusTolerance + kRadiusToleranceShare * r0.norm())
    fail(
        fmt::format("radius mismatch: {:.4f} mm at the start, {:.4f} mm at the end; allowed is a "
                    "difference of 2 um + 0.1 %",
                    r0.norm() * 1e3, r1.norm() * 1e3));
  double sweep = std::atan2(r0[0] * r1[1] - r0[1] * r1[0], r0.dot(r1));
  const bool closed = (to - from).norm() < 1e-9;
  if (clockwise)
    sweep = closed ? -2 * kPi : sweep >= 0 ? sweep - 2 * kPi : sweep;
  else
    sweep = closed ? 2 * kPi : sweep <= 0 ? sweep + 2 * kPi : sweep;

  Arc arc{Vec3::Zero(), n, sweep};
  arc.centre[u] = centre[0];
  arc.centre[v] = centre[1];
  return arc;
}

void GcodeInterpreter::emit_reference_return(const GcodeLine& line) {
  if (!line.any_axis()) fail("G28 without axis words; allowed are the axes that shall go home");
  if (frame_.rtcp) fail("G28 while G43.4 is active; cancel with G49 first");
  const Coordinates home = start_coordinates(machine_);
  Move move;
  move.kind = Move::Kind::rapid;
  move.alone = true;
  move.start = position_;
  move.end = target(line, false);
  const Coordinates via = move.end;
  emit_move(move);
  move.start = move.end = via;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (line.has(kAxisLetters[i]))
      move.end[static_cast<Eigen::Index>(i)] = home[static_cast<Eigen::Index>(i)];
  emit_move(move);
}

void GcodeInterpreter::emit_move(Move move) {
  move.frame = frame_;
  move.exact = modal_.exact;
  move.tolerance = modal_.tolerance;
  move.line = lines_.number();
  position_ = move.end;
  if (move.start == move.end && move.kind != Move::Kind::arc) return;
  ready_.emplace_back(std::move(move));
}

}  // namespace vcnc
