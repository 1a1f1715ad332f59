#include "controller/gcode/cutter_compensation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "controller/gcode/cursor.hpp"

namespace vcnc {
namespace {

constexpr double kStill = 1e-9;     ///< [m]
constexpr double kSmooth = 5e-3;    ///< [rad] a corner that is none: 3e-6 r off at its tip
constexpr double kSlack = 1e-8;     ///< [m] of a cut beyond the end of a move
constexpr double kReversal = 1e-7;  ///< [rad] from half a turn

double cross(const Vec2& a, const Vec2& b) { return a[0] * b[1] - a[1] * b[0]; }
Vec2 left_of(const Vec2& t) { return {-t[1], t[0]}; }

/// Angle from a to b in the sense of `sense`, 0 .. 2 pi.
double turn_from(const Vec2& a, const Vec2& b, double sense) {
  double angle = std::atan2(cross(a, b), a.dot(b));
  if (sense < 0) angle = -angle;
  return angle < 0 ? angle + 2 * kPi : angle;
}

[[noreturn]] void gouge(const Move& move, const char* what) {
  throw LineError(fmt::format("the tool would gouge: {} (move of line {})", what, move.line), 0);
}

/// Points where a line meets a circle.
int meet(const Vec2& p, const Vec2& t, const Vec2& centre, double radius,
         std::array<Vec2, 2>& points) {
  const double along = (centre - p).dot(t);
  const Vec2 foot = p + along * t;
  double rest = radius * radius - (foot - centre).squaredNorm();
  if (rest < 0 && rest > -2 * radius * kSlack) rest = 0;
  if (rest < 0) return 0;
  const double half = std::sqrt(rest);
  points = {foot - half * t, foot + half * t};
  return 2;
}

int meet_circles(const Vec2& c0, double r0, const Vec2& c1, double r1,
                 std::array<Vec2, 2>& points) {
  const Vec2 between = c1 - c0;
  const double distance = between.norm();
  if (distance < kStill) return 0;
  const double along = (distance * distance + r0 * r0 - r1 * r1) / (2 * distance);
  double rest = r0 * r0 - along * along;
  if (rest < 0 && rest > -2 * r0 * kSlack) rest = 0;
  if (rest < 0) return 0;
  const Vec2 t = between / distance;
  const Vec2 foot = c0 + along * t, up = left_of(t) * std::sqrt(rest);
  points = {foot - up, foot + up};
  return 2;
}

}  // namespace

void CutterCompensation::begin(double radius, bool left, std::size_t normal) {
  state_ = State::entry;
  s_ = left ? radius : -radius;
  normal_ = normal;
  u_ = static_cast<Eigen::Index>((normal + 1) % 3);
  v_ = static_cast<Eigen::Index>((normal + 2) % 3);
  held_ = false;
  begin_anew();
}

void CutterCompensation::end() {
  if (state_ == State::entry) state_ = State::off;
  if (state_ == State::on) state_ = State::leaving;
}

void CutterCompensation::place(Move& move, const Vec2& from, const Vec2& to) const {
  move.start[u_] = from[0];
  move.start[v_] = from[1];
  move.end[u_] = to[0];
  move.end[v_] = to[1];
}

CutterCompensation::Element CutterCompensation::shifted(Move move) const {
  Element e;
  const Vec2 p0 = planar(move.start), p1 = planar(move.end);
  e.corner = p1;
  if (move.kind != Move::Kind::arc) {
    e.leaves = e.arrives = (p1 - p0).normalized();
    e.from = p0 + s_ * left_of(e.leaves);
    e.to = p1 + s_ * left_of(e.arrives);
    e.move = std::move(move);
    return e;
  }
  e.arc = true;
  e.sweep = move.arc.sweep;
  e.centre = {move.arc.centre[u_], move.arc.centre[v_]};
  const double sense = e.sweep > 0 ? 1 : -1;
  const Vec2 r0 = p0 - e.centre, r1 = p1 - e.centre;
  e.radius = r1.norm() - sense * s_;
  if (!(e.radius > kStill) || !(r0.norm() - sense * s_ > kStill))
    throw LineError(
        fmt::format("the tool would gouge: the arc's radius {:.4f} mm is not greater than that "
                    "of the tool, {:.4f} mm",
                    r1.norm() * 1e3, std::abs(s_) * 1e3),
        0);
  e.bend = sense / r1.norm();
  e.leaves = sense * left_of(r0.normalized());
  e.arrives = sense * left_of(r1.normalized());
  e.from = p0 + s_ * left_of(e.leaves);
  e.to = p1 + s_ * left_of(e.arrives);
  e.move = std::move(move);
  return e;
}

void CutterCompensation::add(Block block, std::vector<Block>& ready) {
  if (!active()) {
    ready.push_back(std::move(block));
    return;
  }
  Move* move = std::get_if<Move>(&block);
  const bool planar_motion = move && (move->kind == Move::Kind::arc ||
                                      (planar(move->end) - planar(move->start)).norm() > kStill);
  if (!planar_motion) {
    if (state_ == State::entry || !held_) {
      ready.push_back(std::move(block));
      return;
    }
    if (behind_.size() >= kMostWaiting)
      throw LineError(fmt::format("more than {} blocks without motion in the plane of the cutter "
                                  "compensation",
                                  kMostWaiting),
                      0);
    behind_.push_back(std::move(block));
    return;
  }
  const bool arc = move->kind == Move::Kind::arc;
  if (arc && state_ == State::entry)
    throw LineError("the first move after G41 or G42 must be straight", 0);
  if (arc && state_ == State::leaving)
    throw LineError("the first move after G40 must be straight", 0);
  if (move->feed_mode == Move::Feed::time)
    throw LineError("cutter compensation under G93; allowed are G94 and G95", 0);
  if (state_ == State::leaving) {
    const Vec2 end = planar(move->end);
    release(ready);
    place(*move, last_.to, end);
    ready.push_back(std::move(block));
    state_ = State::off;
    return;
  }
  if (state_ == State::on) look_at_programmed(*move);
  Element next = shifted(std::move(*move));
  if (state_ == State::entry) {
    const Vec2 begin = planar(next.move.start);
    if ((next.corner - begin).norm() <= std::abs(s_))
      throw LineError(
          fmt::format("the entry move of the cutter compensation is {:.4f} mm long; it must be "
                      "longer than the tool's radius, {:.4f} mm",
                      (next.corner - begin).norm() * 1e3, std::abs(s_) * 1e3),
          0);
    next.entry = true;
    next.from = begin;
    state_ = State::on;
    last_ = std::move(next);
    held_ = true;
    return;
  }
  join(next, ready);
}

void CutterCompensation::join(Element& next, std::vector<Block>& ready) {
  double turn = std::atan2(cross(last_.arrives, next.leaves), last_.arrives.dot(next.leaves));
  // A reversal between curves turns to the side on which the second lies; between lines it is
  // outside.
  if (std::abs(turn) > kPi - kReversal) {
    const double bend = last_.bend + next.bend;
    turn = bend < 0 ? kPi : bend > 0 ? -kPi : s_ > 0 ? -kPi : kPi;
  }
  corner_.clear();
  if (std::abs(turn) <= kSmooth)
    mitre(next, turn);
  else if (turn * s_ < 0)
    add_corner(next, turn);
  else
    cut(next);
  release(ready);
  for (Move& corner : corner_) {
    watch(corner);
    ready.emplace_back(std::move(corner));
  }
  last_ = std::move(next);
  held_ = true;
}

/// The arc about the corner. It is part of the next move; before a rapid, of the last one.
void CutterCompensation::add_corner(const Element& next, double turn) {
  const Move& like = next.move.feed_mode != Move::Feed::none ? next.move : last_.move;
  Move corner = like;
  corner.line = next.move.line;
  corner.start = corner.end = next.move.start;
  place(corner, last_.to, next.from);
  corner.kind = Move::Kind::line;
  if (like.feed_mode == Move::Feed::none) {
    corner.kind = Move::Kind::rapid;
  } else {
    corner.kind = Move::Kind::arc;
    corner.arc = {Vec3::Zero(), normal_, turn};
    corner.arc.centre[u_] = last_.corner[0];
    corner.arc.centre[v_] = last_.corner[1];
  }
  corner_.push_back(std::move(corner));
}

/// Lets both end on the bisector of a corner so flat that rounding of the program may have made it.
void CutterCompensation::mitre(Element& next, double turn) {
  const Vec2 normal = left_of((last_.arrives + next.leaves).normalized());
  const Vec2 point = last_.corner + s_ / std::cos(0.5 * turn) * normal;
  const auto shorten = [&](Element& e, const Vec2& from, const Vec2& to) {
    const Vec2 a = from - e.centre, b = to - e.centre;
    const double sweep = e.sweep - std::atan2(cross(a, b), a.dot(b));
    if (sweep * e.sweep <= 0) gouge(e.move, "an arc is too short for the bend beside it");
    e.sweep = sweep;
  };
  if (last_.arc)
    shorten(last_, point, last_.to);
  else if (!last_.entry && (point - last_.from).dot(last_.arrives) < -kSlack)
    gouge(last_.move, "a move is too short for the inside corner behind it");
  if (next.arc)
    shorten(next, next.from, point);
  else if ((next.to - point).dot(next.leaves) < -kSlack)
    gouge(next.move, "a move is too short for the inside corner before it");
  last_.to = next.from = point;
}

/// Cuts both where they meet.
void CutterCompensation::cut(Element& next) {
  std::array<Vec2, 2> points;
  int count = 0;
  if (!last_.arc && !next.arc) {
    const double sine = cross(last_.arrives, next.leaves);
    points[0] = last_.to + last_.arrives * (cross(next.from - last_.to, next.leaves) / sine);
    count = 1;
  } else if (!last_.arc) {
    count = meet(last_.to, last_.arrives, next.centre, next.radius, points);
  } else if (!next.arc) {
    count = meet(next.from, next.leaves, last_.centre, last_.radius, points);
  } else {
    count = meet_circles(last_.centre, last_.radius, next.centre, next.radius, points);
  }
  if (count == 0) gouge(next.move, "the shifted moves of an inside corner do not meet");
  // Of two, that which takes less away from both.
  const auto lost = [&](const Vec2& p) {
    const double back =
        last_.arc ? last_.radius * turn_from(p - last_.centre, last_.to - last_.centre, last_.sweep)
                  : std::abs((last_.to - p).dot(last_.arrives));
    const double ahead =
        next.arc ? next.radius * turn_from(next.from - next.centre, p - next.centre, next.sweep)
                 : std::abs((p - next.from).dot(next.leaves));
    return back + ahead;
  };
  const Vec2 point = count == 2 && lost(points[1]) < lost(points[0]) ? points[1] : points[0];

  const auto runs_backwards = [](const Vec2& from, const Vec2& to, const Vec2& direction) {
    return (to - from).dot(direction) < -kSlack;
  };
  if (last_.arc) {
    const double sense = last_.sweep > 0 ? 1 : -1;
    const double whole = std::abs(last_.sweep);
    const double back = turn_from(point - last_.centre, last_.to - last_.centre, sense);
    if (back > whole + kSlack / last_.radius)
      gouge(last_.move, "an arc is too short for the inside corner behind it");
    last_.sweep = sense * (whole - back);
  } else if (!last_.entry && runs_backwards(last_.from, point, last_.arrives)) {
    gouge(last_.move, "a move is too short for the inside corner behind it");
  }
  last_.to = point;
  if (next.arc) {
    const double sense = next.sweep > 0 ? 1 : -1;
    const double whole = std::abs(next.sweep);
    const double skipped = turn_from(next.from - next.centre, point - next.centre, sense);
    if (skipped > whole + kSlack / next.radius)
      gouge(next.move, "an arc is too short for the inside corner before it");
    next.sweep = sense * (whole - skipped);
  } else if (runs_backwards(point, next.to, next.leaves)) {
    gouge(next.move, "a move is too short for the inside corner before it");
  }
  next.from = point;
}

/// Gives the move that waited, and what follows it without motion in the plane.
void CutterCompensation::release(std::vector<Block>& ready) {
  if (!held_) return;
  held_ = false;
  place(last_.move, last_.from, last_.to);
  if (last_.arc) last_.move.arc.sweep = last_.sweep;
  if (!last_.entry) watch(last_.move);
  ready.emplace_back(last_.move);
  for (Block& block : behind_) {
    if (Move* move = std::get_if<Move>(&block)) {
      place(*move, last_.to, last_.to);
      begin_anew();
    }
    ready.push_back(std::move(block));
  }
  behind_.clear();
}

void CutterCompensation::begin_anew() {
  walls_.clear();
  programmed_.clear();
  crossed_ = false;
}

CutterCompensation::Way CutterCompensation::way_of(const Move& move) const {
  Way way;
  way.arc = move.kind == Move::Kind::arc;
  way.from = planar(move.start);
  way.to = planar(move.end);
  way.line = move.line;
  if (way.arc) {
    way.centre = {move.arc.centre[u_], move.arc.centre[v_]};
    way.radius = (way.to - way.centre).norm();
    way.sweep = move.arc.sweep;
  }
  set_box(way);
  return way;
}

/// Whether the program crosses itself, before compensation.
void CutterCompensation::look_at_programmed(const Move& move) {
  if (crossed_) return;
  const Way way = way_of(move);
  for (const Way& before : programmed_) {
    if (!near(way, before)) continue;
    std::array<Vec2, 2> points;
    const auto end = points.begin() + crossings(way, before, points);
    const bool neighbours = &before == &programmed_.back();
    crossed_ = std::any_of(points.begin(), end, [&](const Vec2& p) {
      return !neighbours || (p - way.from).norm() > kDeep;
    });
    if (crossed_) return;
  }
  keep(programmed_, way);
}

/// Refuses a move whose way enters a wall, and makes it one.
void CutterCompensation::watch(const Move& move) {
  const auto w = static_cast<Eigen::Index>(normal_);
  if (move.kind == Move::Kind::rapid || move.start[w] != move.end[w]) {
    begin_anew();
    return;
  }
  if (crossed_ || std::abs(s_) <= 2 * kDeep) return;
  const Way way = way_of(move);
  if (way.arc && std::abs((way.from - way.centre).norm() - way.radius) > 0.5 * kDeep) {
    begin_anew();  // a spiral
    return;
  }
  for (const Way& wall : walls_)
    if (near(way, wall) && enters(way, wall))
      throw LineError(fmt::format("the tool would gouge: the move of line {} crosses what that of "
                                  "line {} leaves standing",
                                  way.line, wall.line),
                      0);
  keep(walls_, wall_of(way));
}

bool CutterCompensation::near(const Way& a, const Way& b) {
  return (a.least.array() <= b.most.array()).all() && (b.least.array() <= a.most.array()).all();
}

void CutterCompensation::keep(std::vector<Way>& ways, Way way) {
  if (ways.size() >= 2 * kWalls)
    ways.erase(ways.begin(), ways.begin() + static_cast<std::ptrdiff_t>(kWalls));
  ways.push_back(std::move(way));
}

void CutterCompensation::set_box(Way& way) {
  if (way.arc) {
    way.least = way.centre.array() - way.radius;
    way.most = way.centre.array() + way.radius;
  } else {
    way.least = way.from.cwiseMin(way.to);
    way.most = way.from.cwiseMax(way.to);
  }
}

/// The way moved by kDeep to the side of the piece.
CutterCompensation::Way CutterCompensation::wall_of(Way way) const {
  const double right = std::copysign(kDeep, s_);
  if (way.arc) {
    const double radius = way.radius + (way.sweep > 0 ? right : -right);
    way.from = way.centre + (way.from - way.centre) * (radius / way.radius);
    way.to = way.centre + (way.to - way.centre) * (radius / way.radius);
    way.radius = radius;
  } else {
    const Vec2 across = right * left_of((way.to - way.from).normalized());
    way.from -= across;
    way.to -= across;
  }
  set_box(way);
  return way;
}

Vec2 CutterCompensation::direction(const Way& way, const Vec2& p) {
  if (!way.arc) return (way.to - way.from).normalized();
  return (way.sweep > 0 ? 1 : -1) * left_of((p - way.centre).normalized());
}

/// Where two ways meet; those that lie on each other do not.
int CutterCompensation::crossings(const Way& way, const Way& other, std::array<Vec2, 2>& points) {
  const auto holds = [](const Way& on, const Vec2& p) {
    if (on.arc) {
      const double sense = on.sweep > 0 ? 1 : -1;
      return turn_from(on.from - on.centre, p - on.centre, sense) <= std::abs(on.sweep);
    }
    const Vec2 whole = on.to - on.from;
    const double along = (p - on.from).dot(whole);
    return along >= 0 && along <= whole.squaredNorm();
  };
  int count = 0;
  if (way.arc && other.arc) {
    count = meet_circles(way.centre, way.radius, other.centre, other.radius, points);
  } else if (way.arc || other.arc) {
    const Way& line = way.arc ? other : way;
    const Way& circle = way.arc ? way : other;
    count = meet(line.from, direction(line, line.from), circle.centre, circle.radius, points);
  } else {
    const Vec2 t = direction(way, way.from), along = direction(other, other.from);
    const double sine = cross(t, along);
    if (sine == 0) return 0;
    points[0] = way.from + t * (cross(other.from - way.from, along) / sine);
    count = 1;
  }
  const auto end = std::remove_if(points.begin(), points.begin() + count, [&](const Vec2& p) {
    return !holds(way, p) || !holds(other, p);
  });
  return static_cast<int>(end - points.begin());
}

/// Whether a way crosses a wall towards the piece.
bool CutterCompensation::enters(const Way& way, const Way& wall) const {
  std::array<Vec2, 2> points;
  const int count = crossings(way, wall, points);
  return std::any_of(points.begin(), points.begin() + count, [&](const Vec2& p) {
    return s_ * cross(direction(wall, p), direction(way, p)) < 0;
  });
}

void CutterCompensation::flush(std::vector<Block>& ready) { release(ready); }

}  // namespace vcnc
