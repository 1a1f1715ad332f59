#include "tests/bench/jerk_bound.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "controller/path.hpp"

namespace vcnc {
namespace {

constexpr double kNone = 1e9;
constexpr double kThinned = 1e-3;       ///< joints that limit nothing are cuts at this distance [m]
constexpr int kPasses = 4;              ///< ends limit times and these the ends
constexpr std::size_t kMostMoves = 64;  ///< in the tube before or behind a joint
constexpr std::size_t kSpaceAxes = 3;

struct Ramp {
  double time, distance;
};

/// From an end up to the speed w.
Ramp ramp(double w, double acceleration, double jerk, const PieceEnd& end) {
  const double rise = w - end.velocity;
  const double start = std::min({end.acceleration, acceleration, std::sqrt(2 * jerk * rise)});
  const double peak = std::min(acceleration, std::sqrt(jerk * rise + 0.5 * start * start));
  const double up = (peak - start) / jerk, down = peak / jerk;
  const double by_ramps = (peak * peak - 0.5 * start * start) / jerk;
  const double held = peak > 0 ? std::max(0.0, (rise - by_ramps) / peak) : 0;
  const double v1 = end.velocity + up * (start + 0.5 * jerk * up);
  return {up + held + down, up * (end.velocity + up * (0.5 * start + jerk * up / 6)) +
                                held * (v1 + 0.5 * peak * held) +
                                down * (w - jerk * down * down / 6)};
}

}  // namespace

double shortest_travel(double distance, double velocity, double acceleration, double jerk,
                       const PieceEnd& from, const PieceEnd& to) {
  if (distance <= 0) return 0;
  const PieceEnd start{std::min(from.velocity, velocity), from.acceleration};
  const PieceEnd end{std::min(to.velocity, velocity), to.acceleration};
  const auto both = [&](double w) {
    const Ramp up = ramp(w, acceleration, jerk, start), down = ramp(w, acceleration, jerk, end);
    return Ramp{up.time + down.time, up.distance + down.distance};
  };
  const Ramp full = both(velocity);
  if (full.distance <= distance) return full.time + (distance - full.distance) / velocity;
  double low = std::max(start.velocity, end.velocity), high = velocity;
  if (both(low).distance >= distance) return distance / velocity;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (both(middle).distance < distance ? low : high) = middle;
  }
  return both(low).time;
}

PieceEnd within_tube(double radius, double jerk, double duration) {
  if (!(duration > 0)) return {kNone, kNone};
  const double h = std::min(std::cbrt(3 * radius / jerk), duration / 3);
  return {3 * radius / h + 0.5 * jerk * h * h, 2 * radius / (h * h) + 4.0 / 3 * jerk * h};
}

namespace {

using Axes = std::array<PieceEnd, kSpaceAxes>;

/// A place of the path where it may be cut: a joint, or where an arc turns round along an axis.
struct Joint {
  Vec3 r;
  double s;
  std::optional<Vec3> before, behind;  ///< directions of the lines that meet here
  Axes ends;                           ///< at the instant when it is passed
};

/// What lies between two neighbours.
struct Gap {
  bool line;
  double feed;   ///< most speed, of the tool
  double least;  ///< time
};

class Chain {
 public:
  Chain(const std::vector<Move>& moves, const Machine& machine);
  double longest();

 private:
  enum class Kind { end, passed, reversed };
  struct Cut {
    std::size_t joint;
    Kind kind;
    std::size_t axis = 0;
    double sign = 0;  ///< of the extreme: +1 largest
    double best = 0;  ///< of all chains up to here
  };

  void add(const Move& move);
  double share(const Vec3& n, const std::array<double, kSpaceAxes>& limits) const;
  PieceEnd through_tube(std::size_t joint, const Vec3& p, bool before) const;
  void tighten(std::size_t joint);
  double least(const Vec3& n, double feed, const Vec3& way, const PieceEnd& a,
               const PieceEnd& b) const;
  PieceEnd end_along(const Joint& joint, const Vec3& n) const;
  double least_between(const Cut& a, const Cut& b, double feed) const;
  std::vector<Cut> cuts() const;

  std::array<double, kSpaceAxes> velocity_, acceleration_, jerk_;
  double tolerance_ = 0;
  std::vector<Joint> joints_;
  std::vector<Gap> gaps_;
};

Vec3 unit_of(std::size_t axis) { return Vec3::Unit(static_cast<Eigen::Index>(axis)); }

Chain::Chain(const std::vector<Move>& moves, const Machine& machine) {
  for (std::size_t i = 0; i < kSpaceAxes; ++i) {
    const AxisLimits& limits = machine.axes[i].limits;
    velocity_[i] = limits.velocity;
    acceleration_[i] = limits.acceleration;
    jerk_[i] = limits.jerk;
  }
  for (const Move& move : moves) {
    tolerance_ = std::max(tolerance_, move.tolerance);
    add(move);
  }
  for (Joint& joint : joints_)
    for (std::size_t i = 0; i < kSpaceAxes; ++i) joint.ends[i] = {velocity_[i], acceleration_[i]};
  joints_.front().ends = joints_.back().ends = {};
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t k = 0; k < gaps_.size(); ++k)
      gaps_[k].least = least_between({k, Kind::passed}, {k + 1, Kind::passed}, gaps_[k].feed);
    for (std::size_t k = 1; k < gaps_.size(); ++k) tighten(k);
  }
}

void Chain::add(const Move& move) {
  const PathSegment segment = make_segment(move, 0);
  if (segment.length < 1e-12) return;
  const bool line = move.kind != Move::Kind::arc;
  const double feed = move.feed_mode == Move::Feed::tip ? move.feed : kNone;
  if (joints_.empty()) joints_.push_back({move.start.head<3>(), 0, {}, {}, {}});
  std::vector<double> places{segment.length};
  if (!line) {
    const double turn = std::abs(move.arc.sweep), sign = move.arc.sweep > 0 ? 1 : -1;
    for (double angle = std::ceil(sign * segment.angle0 / (kPi / 2) + 1e-9) * (kPi / 2) -
                        sign * segment.angle0;
         angle < turn - 1e-9; angle += kPi / 2)
      places.insert(places.end() - 1, segment.length * angle / turn);
  }
  const double begin = joints_.back().s;
  for (const double place : places) {
    const Vec3 r = programmed_point(segment, place).x.head<3>();
    std::optional<Vec3> direction;
    if (line) direction = (r - joints_.back().r).normalized();
    joints_.back().behind = direction;
    joints_.push_back({r, begin + place, direction, {}, {}});
    gaps_.push_back({line, feed, 0});
  }
}

double Chain::share(const Vec3& n, const std::array<double, kSpaceAxes>& limits) const {
  double sum = 0;
  for (std::size_t i = 0; i < kSpaceAxes; ++i)
    sum += std::abs(n[static_cast<Eigen::Index>(i)]) * limits[i];
  return sum;
}

/// Of p x at the instant when a joint is passed, from the lines before or behind it.
PieceEnd Chain::through_tube(std::size_t joint, const Vec3& p, bool before) const {
  const double size = p.norm();
  if (size < 1e-12) return {0, 0};
  const double jerk = share(p, jerk_);
  PieceEnd best{kNone, kNone};
  double low = p.dot(joints_[joint].r), high = low, duration = 0;
  for (std::size_t n = 1; n <= kMostMoves; ++n) {
    if (before ? joint < n : joint + n > gaps_.size()) break;
    const Gap& gap = gaps_[before ? joint - n : joint + n - 1];
    const Joint& far = joints_[before ? joint - n : joint + n];
    if (!gap.line) break;
    const double f = p.dot(far.r);
    low = std::min(low, f);
    high = std::max(high, f);
    const double speed = std::min(gap.feed, share(Vec3::Ones(), velocity_));
    const double way = (far.r - joints_[joint].r).norm() - 2 * tolerance_;
    duration = std::max(duration + gap.least, way / speed);
    const double radius = 0.5 * (high - low) + size * tolerance_;
    const PieceEnd end = within_tube(radius, jerk, duration);
    best.velocity = std::min(best.velocity, end.velocity);
    best.acceleration = std::min(best.acceleration, end.acceleration);
    if (radius > 20 * size * tolerance_) break;
  }
  return best;
}

/// Every axis as the sum of a direction across the line before and one across the line behind.
void Chain::tighten(std::size_t index) {
  Joint& joint = joints_[index];
  const auto take = [&](std::size_t axis, const Vec3& p, const Vec3& q) {
    const PieceEnd a = through_tube(index, p, true), b = through_tube(index, q, false);
    PieceEnd& end = joint.ends[axis];
    end.velocity = std::min(end.velocity, a.velocity + b.velocity);
    end.acceleration = std::min(end.acceleration, a.acceleration + b.acceleration);
  };
  for (std::size_t i = 0; i < kSpaceAxes; ++i) {
    const Vec3 e = unit_of(i), none = Vec3::Zero();
    if (joint.before && std::abs(joint.before->dot(e)) < 0.1) take(i, e, none);
    if (joint.behind && std::abs(joint.behind->dot(e)) < 0.1) take(i, none, e);
    if (!joint.before || !joint.behind) continue;
    const Vec3 &u1 = *joint.before, &u2 = *joint.behind;
    const double cosine = u1.dot(u2);
    const Vec3 n1 = u2 - cosine * u1, n2 = u1 - cosine * u2;  // across u1, across u2
    const double sine2 = n1.squaredNorm();
    if (sine2 < 1e-6) continue;
    const Vec3 q = e.dot(u1) / sine2 * n2, p = e.dot(u2) / sine2 * n1;
    take(i, e - q, q);
    take(i, p, e - p);
  }
}

double Chain::least(const Vec3& n, double feed, const Vec3& way, const PieceEnd& a,
                    const PieceEnd& b) const {
  return shortest_travel(std::abs(n.dot(way)) - 2 * tolerance_, std::min(feed, share(n, velocity_)),
                         share(n, acceleration_), share(n, jerk_), a, b);
}

PieceEnd Chain::end_along(const Joint& joint, const Vec3& n) const {
  PieceEnd end;
  for (std::size_t i = 0; i < kSpaceAxes; ++i) {
    const double part = std::abs(n[static_cast<Eigen::Index>(i)]);
    end.velocity += part * joint.ends[i].velocity;
    end.acceleration += part * joint.ends[i].acceleration;
  }
  return end;
}

/// No less than this passes between two cuts; below 0: they do not follow each other.
double Chain::least_between(const Cut& a, const Cut& b, double feed) const {
  const Joint &from = joints_[a.joint], &to = joints_[b.joint];
  const Vec3 way = to.r - from.r;
  const bool turns = a.kind == Kind::reversed || b.kind == Kind::reversed;
  if (a.kind == Kind::reversed && b.kind == Kind::reversed && a.axis != b.axis) return -1;
  double most = -1;
  const auto try_along = [&](const Vec3& n, std::size_t axis) {
    const auto end = [&](const Cut& cut, const Joint& joint) {
      return cut.kind == Kind::reversed ? PieceEnd{0, acceleration_[axis]} : end_along(joint, n);
    };
    most = std::max(most, least(n, feed, way, end(a, from), end(b, to)));
  };
  for (std::size_t i = 0; i < kSpaceAxes; ++i) {
    if ((a.kind == Kind::reversed && a.axis != i) || (b.kind == Kind::reversed && b.axis != i))
      continue;
    const double along = way[static_cast<Eigen::Index>(i)];
    if (a.kind == Kind::reversed && -a.sign * along <= 2 * tolerance_) continue;
    if (b.kind == Kind::reversed && b.sign * along <= 2 * tolerance_) continue;
    try_along(unit_of(i), i);
  }
  if (!turns && way.norm() > 0) try_along(way.normalized(), 0);
  return most;
}

std::vector<Chain::Cut> Chain::cuts() const {
  std::vector<Cut> cuts{{0, Kind::end}};
  double last = 0;
  for (std::size_t k = 1; k + 1 < joints_.size(); ++k) {
    const Joint &joint = joints_[k], &left = joints_[k - 1], &right = joints_[k + 1];
    bool limits = false;
    for (std::size_t i = 0; i < kSpaceAxes; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      limits = limits || joint.ends[i].acceleration < 0.99 * acceleration_[i];
      const double up = joint.r[row] - left.r[row], down = joint.r[row] - right.r[row];
      if (up * down >= 0 && (up != 0 || down != 0))
        cuts.push_back({k, Kind::reversed, i, up + down > 0 ? 1.0 : -1.0});
    }
    if (!limits && joint.s < last + kThinned) continue;
    cuts.push_back({k, Kind::passed});
    last = joint.s;
  }
  cuts.push_back({joints_.size() - 1, Kind::end});
  return cuts;
}

double Chain::longest() {
  std::vector<Cut> all = cuts();
  for (std::size_t i = 1; i < all.size(); ++i) all[i].best = -1;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].best < 0) continue;
    double feed = 0;
    std::size_t joint = all[i].joint;
    for (std::size_t k = i + 1; k < all.size(); ++k) {
      for (; joint < all[k].joint; ++joint) feed = std::max(feed, gaps_[joint].feed);
      if (all[k].joint == all[i].joint) continue;
      const double time = least_between(all[i], all[k], feed);
      if (time >= 0) all[k].best = std::max(all[k].best, all[i].best + time);
    }
  }
  return all.back().best;
}

}  // namespace

double jerk_bound(const std::vector<Move>& moves, const Machine& machine) {
  return Chain(moves, machine).longest();
}

}  // namespace vcnc
