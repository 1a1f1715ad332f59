#include "controller/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcnc {
namespace {

constexpr double kExactTolerance = 5e-7;  ///< G61 at joints that are (nearly) tangent [m]
constexpr double kLargestArcStep = 0.5;   ///< angle integrated at once [rad]
constexpr double kKnotStep = 4;           ///< distance of the knots of h(s), in h
/// How far a width has an influence: the hat itself and the slope down from the widest.
constexpr double kReach = Path::kLargestWidth * (2 + 1 / Path::kWidthSlope);
constexpr double kCornerDetail = 4;  ///< of a corner's cut
constexpr double kRoom = 0.45;       ///< of a line, for the curve of a corner
constexpr double kWorth = 0.45;      ///< least share of the tolerance for which a corner swings out
constexpr double kSwingingJump = 0.1, kPlainJump = 0.5;  ///< least jump of the tangent
constexpr double kRunIn = 0.25;                          ///< of an arc, at most, next to a line
constexpr double kSmallestSine = 0.05;  ///< near the pole C does not turn the tool axis

/// Gauss-Legendre points on [-1, 1].
struct GaussPoint {
  double u, weight;
};
constexpr std::array<GaussPoint, 2> kGauss2{{{-0.57735026918962576, 1}, {0.57735026918962576, 1}}};
constexpr std::array<GaussPoint, 5> kGauss5{{{-0.90617984593866399, 0.23692688505618909},
                                             {-0.53846931010568309, 0.47862867049936647},
                                             {0, 0.56888888888888889},
                                             {0.53846931010568309, 0.47862867049936647},
                                             {0.90617984593866399, 0.23692688505618909}}};

struct PlaneAxes {
  Eigen::Index u, v;
};
PlaneAxes plane_axes(std::size_t normal) {
  return {static_cast<Eigen::Index>((normal + 1) % 3), static_cast<Eigen::Index>((normal + 2) % 3)};
}

PathPoint eval_arc(const PathSegment& segment, double share) {
  const Move& move = segment.move;
  const Coordinates d = move.end - move.start;
  PathPoint point{move.start + share * d, d / segment.length};
  const auto [u, v] = plane_axes(move.arc.normal);
  const double r = segment.radius0 + share * (segment.radius1 - segment.radius0);
  const double dr = (segment.radius1 - segment.radius0) / segment.length;
  const double angle = segment.angle0 + share * move.arc.sweep;
  const double dangle = move.arc.sweep / segment.length;
  const double c = std::cos(angle), s = std::sin(angle);
  point.x[u] = move.arc.centre[u] + r * c;
  point.x[v] = move.arc.centre[v] + r * s;
  point.dx[u] = dr * c - r * dangle * s;
  point.dx[v] = dr * s + r * dangle * c;
  return point;
}

/// Angle by which the tool (RTCP) or an axis is off.
double angle_deviation(const Coordinates& x, const Coordinates& r, bool rtcp) {
  const double da = x[kA] - r[kA];
  double dc = x[kC] - r[kC];
  if (rtcp) dc *= std::max(std::abs(std::sin(r[kA])), kSmallestSine);
  return std::hypot(da, dc);
}

struct Step {
  double value, slope;
};
/// 10 u^3 - 15 u^4 + 6 u^5: from 0 to 1 with zero first and second derivative at both ends.
Step smooth_blend(double u) {
  return {u * u * u * (10 + u * (6 * u - 15)), 30 * u * u * (1 - u) * (1 - u)};
}

}  // namespace

PathSegment make_segment(Move move, double s0) {
  PathSegment segment;
  segment.s0 = s0;
  const Coordinates d = move.end - move.start;
  double tip = d.head<3>().norm();
  if (move.kind == Move::Kind::arc) {
    const auto [u, v] = plane_axes(move.arc.normal);
    const Vec3 from = move.start.head<3>() - move.arc.centre;
    const Vec3 to = move.end.head<3>() - move.arc.centre;
    segment.radius0 = std::hypot(from[u], from[v]);
    segment.radius1 = std::hypot(to[u], to[v]);
    segment.angle0 = std::atan2(from[v], from[u]);
    const double round = 0.5 * (segment.radius0 + segment.radius1) * std::abs(move.arc.sweep);
    tip = std::hypot(round, d[static_cast<Eigen::Index>(move.arc.normal)]);
  }
  segment.length = std::max(tip, Path::kRotaryLength * d.tail<2>().norm());
  segment.move = std::move(move);
  return segment;
}

PathPoint programmed_point(const PathSegment& segment, double s) {
  const double share = std::clamp((s - segment.s0) / segment.length, 0.0, 1.0);
  if (segment.move.kind == Move::Kind::arc) return eval_arc(segment, share);
  const Coordinates d = segment.move.end - segment.move.start;
  return {segment.move.start + share * d, d / segment.length};
}

Path::Path(std::vector<Move> moves, double angle_tolerance, bool open)
    : angle_tolerance_(angle_tolerance), open_(open) {
  append(std::move(moves));
}

void Path::extend(std::vector<Move> moves, bool open) {
  open_ = open;
  append(std::move(moves));
}

void Path::forget(double s) {
  const double from = std::min(s, settled_) - kReach;
  const auto before = [from](const Bound& b) { return b.s < from; };
  segments_.erase(segments_.begin(), segments_.begin() + static_cast<std::ptrdiff_t>(index(from)));
  std::erase_if(corners_, [from](const Corner& corner) { return corner.s < from; });
  // One of each stays before the place.
  for (std::vector<Bound>* list : {&bounds_, &knots_}) {
    const auto keep = std::partition_point(list->begin(), list->end(), before);
    if (keep - list->begin() > 1) list->erase(list->begin(), keep - 1);
  }
}

void Path::append(std::vector<Move> moves) {
  segments_.reserve(segments_.size() + moves.size());
  for (Move& move : moves) {
    PathSegment segment = make_segment(std::move(move), length_);
    if (segment.length < 1e-12) {
      // A rounding remnant: the neighbours absorb it.
      if (!segments_.empty()) segments_.back().move.end = segment.move.end;
      continue;
    }
    length_ += segment.length;
    segments_.push_back(std::move(segment));
  }
  if (segments_.empty()) return;
  const double settled = settled_;
  bound_width();
  build_width();
  find_corners(settled);
}

std::size_t Path::index(double s) const {
  const auto next = std::upper_bound(segments_.begin() + 1, segments_.end(), s,
                                     [](double a, const PathSegment& b) { return a < b.s0; });
  return static_cast<std::size_t>(next - segments_.begin()) - 1;
}

PathPoint Path::programmed(double s) const {
  return programmed_point(segments_[index(s)], std::clamp(s, 0.0, length_));
}

PathPoint Path::eval(double s) const {
  s = std::clamp(s, 0.0, length_);
  if (const Corner* corner = corner_at(s)) {
    PathPoint point = programmed(s);
    const PathCorner::Share share = corner->curve.at(s - corner->s);
    point.x += share.value * corner->jump;
    point.dx += share.slope * corner->jump;
    return point;
  }
  return smooth(s, width(s));
}

double Path::detail(double s) const {
  const Corner* corner = corner_at(s);
  return corner ? kCornerDetail * corner->curve.cut() : width(s).h;
}

// --------------------------------------------------------------------------------- the average

/// Sums the average and its derivative about a reference point:
///   x - ref = int (r - ref) k du,   x' = int r' (1 + h' u) k du.
struct Path::Kernel {
  double s;
  Width w;
  const Coordinates& reference;
  PathPoint sum{Coordinates::Zero(), Coordinates::Zero()};

  /// Adds [a, b] of a segment, on one side of s. For the continuation beyond an end at `mirror`
  /// the segment is run through at 2 mirror - sigma and reflected about `pivot`.
  void add(const PathSegment& segment, double a, double b, bool reflected, double mirror,
           const Coordinates& pivot) {
    if (!(b > a)) return;
    if (segment.move.kind != Move::Kind::arc) {
      add_points(segment, a, b, kGauss2, reflected, mirror, pivot);
      return;
    }
    const double angle = std::abs(segment.move.arc.sweep) / segment.length * (b - a);
    const int parts = 1 + static_cast<int>(angle / kLargestArcStep);
    for (int i = 0; i < parts; ++i)
      add_points(segment, a + (b - a) * i / parts, a + (b - a) * (i + 1) / parts, kGauss5,
                 reflected, mirror, pivot);
  }

  template <std::size_t N>
  void add_points(const PathSegment& segment, double a, double b,
                  const std::array<GaussPoint, N>& rule, bool reflected, double mirror,
                  const Coordinates& pivot) {
    for (const GaussPoint& g : rule) {
      const double sigma = 0.5 * (a + b) + 0.5 * (b - a) * g.u;
      const double u = (sigma - s) / w.h;
      const double weight = 0.5 * (b - a) * g.weight * (1 - std::abs(u)) / w.h;
      const PathPoint r = programmed_point(segment, reflected ? 2 * mirror - sigma : sigma);
      sum.x += weight * ((reflected ? Coordinates(2 * pivot - r.x) : r.x) - reference);
      sum.dx += weight * (1 + w.dh * u) * r.dx;
    }
  }
};

PathPoint Path::smooth(double s, Width w) const {
  const PathPoint here = programmed(s);
  if (w.h < 1e-12) return here;
  const double lo = s - w.h, hi = s + w.h;
  Kernel kernel{s, w, here.x};
  const Coordinates none = Coordinates::Zero();
  const double first = std::max(lo, 0.0), last = std::min(hi, length_);
  for (std::size_t i = index(first); i < segments_.size() && segments_[i].s0 < last; ++i) {
    const double a = std::max(first, segments_[i].s0);
    const double b = std::min(last, segments_[i].s0 + segments_[i].length);
    kernel.add(segments_[i], a, std::min(b, s), false, 0, none);
    kernel.add(segments_[i], std::max(a, s), b, false, 0, none);
  }
  if (lo < 0) {
    const Coordinates& pivot = segments_.front().move.start;
    for (std::size_t i = 0; i < segments_.size() && segments_[i].s0 < -lo; ++i)
      kernel.add(segments_[i], std::max(lo, -segments_[i].s0 - segments_[i].length),
                 -segments_[i].s0, true, 0, pivot);
  }
  if (hi > length_) {
    const Coordinates& pivot = segments_.back().move.end;
    for (std::size_t i = segments_.size(); i-- > 0;) {
      const double from = 2 * length_ - segments_[i].s0 - segments_[i].length;
      if (from >= hi) break;
      kernel.add(segments_[i], from, std::min(hi, 2 * length_ - segments_[i].s0), true, length_,
                 pivot);
    }
  }
  return {here.x + kernel.sum.x, kernel.sum.dx};
}

// ----------------------------------------------------------------------------- width of the hat

double Path::tolerance_at(double s) const {
  // At a joint the stricter of both neighbours holds.
  const std::size_t i = index(s);
  const auto tolerance = [](const Move& m) { return m.exact ? kExactTolerance : m.tolerance; };
  double result = tolerance(segments_[i].move);
  if (i > 0 && s - segments_[i].s0 < 1e-12)
    result = std::min(result, tolerance(segments_[i - 1].move));
  return result;
}

bool Path::within_tolerance(double s, double h, double tip_tolerance) const {
  const Coordinates x = smooth(s, {h, 0}).x, r = programmed(s).x;
  return (x - r).head<3>().norm() <= tip_tolerance &&
         angle_deviation(x, r, frame().rtcp) <= angle_tolerance_;
}

/// The widest hat up to `cap` that keeps the tolerance at s, searched near `from`.
double Path::largest_width(double s, double from, double cap) const {
  const double tolerance = tolerance_at(s);
  // Any hat this narrow keeps both tolerances: the tangent changes by at most 2 (tip) or 2/w.
  const double lowest =
      std::min({cap, length_, 3 * tolerance, 3 * kRotaryLength * angle_tolerance_});
  const double highest = std::min(cap, length_);
  // Neighbours are alike, and narrow hats are cheap to try: grow or shrink from there.
  double good = lowest, bad = std::numeric_limits<double>::infinity();
  const double start = std::clamp(from, lowest, highest);
  if (within_tolerance(s, start, tolerance)) {
    good = start;
    for (double factor = 1.2; good < highest && bad > highest; factor *= factor) {
      const double wider = std::min(factor * good, highest);
      (within_tolerance(s, wider, tolerance) ? good : bad) = wider;
    }
    if (good >= highest) return highest;
  } else {
    bad = start;
    const double narrower = start / 1.2;
    if (narrower > lowest) (within_tolerance(s, narrower, tolerance) ? good : bad) = narrower;
  }
  while (bad > 1.05 * good) {
    const double middle = std::sqrt(good * bad);
    (within_tolerance(s, middle, tolerance) ? good : bad) = middle;
  }
  return good;
}

void Path::bound_width() {
  // Bounds that moves which follow could change are found anew.
  std::size_t first = 0;
  if (settled_ == 0) {
    knots_.clear();
    bounds_ = {{0, std::min(kLargestWidth, length_)}};
  } else {
    first = index(settled_);
    const double from = segments_[first].s0;
    std::erase_if(bounds_, [&](const Bound& b) { return b.s > 0 && b.s >= from; });
  }
  double last = bounds_.back().h;
  for (std::size_t k = first; k < segments_.size(); ++k) {
    const PathSegment& segment = segments_[k];
    if (segment.s0 > 0) bounds_.push_back({segment.s0, last = largest_width(segment.s0, last)});
    if (segment.move.kind != Move::Kind::arc) {
      const double s = segment.s0 + 0.5 * segment.length;
      bounds_.push_back({s, last = largest_width(s, last)});
      continue;
    }
    // Arcs have their own cap, everywhere: samples no further apart than the envelope can climb.
    const double curvature = std::abs(segment.move.arc.sweep) / segment.length;
    const auto cap_for = [&](double tolerance) {
      return std::min(kLargestWidth, std::sqrt(12 * tolerance / curvature));
    };
    const double programmed = tolerance_at(segment.s0);
    const double narrow = cap_for(std::min(kArcTolerance, programmed)), wide = cap_for(programmed);
    const double run_in =
        fast() ? std::min(kRunIn * segment.length, (wide - narrow) / kWidthSlope) : 0;
    const auto line = [&](std::size_t i) {
      return i < segments_.size() && segments_[i].move.kind != Move::Kind::arc;
    };
    const double begin = k > 0 && line(k - 1) ? run_in : 0, end = line(k + 1) ? run_in : 0;
    const auto samples = static_cast<int>(std::ceil(segment.length / narrow));
    for (int i = 0; i < samples; ++i) {
      const double way = segment.length * (i + 0.5) / samples, s = segment.s0 + way;
      const double cap = way < begin || segment.length - way < end ? wide : narrow;
      bounds_.push_back({s, last = largest_width(s, cap, cap)});
    }
  }
  bounds_.push_back({length_, std::min(kLargestWidth, length_)});
}

/// Lower envelope with slope kWidthSlope, then knots at distances of kKnotStep h.
void Path::build_width() {
  std::vector<Bound> envelope = bounds_;
  for (std::size_t i = 1; i < envelope.size(); ++i)
    envelope[i].h = std::min(envelope[i].h,
                             envelope[i - 1].h + kWidthSlope * (envelope[i].s - envelope[i - 1].s));
  for (std::size_t i = envelope.size() - 1; i-- > 0;)
    envelope[i].h = std::min(envelope[i].h,
                             envelope[i + 1].h + kWidthSlope * (envelope[i + 1].s - envelope[i].s));

  const auto envelope_at = [&](double s) {
    const auto next = std::upper_bound(envelope.begin() + 1, envelope.end() - 1, s,
                                       [](double a, const Bound& b) { return a < b.s; });
    const Bound& right = *next;
    const Bound& left = *(next - 1);
    return std::min(left.h + kWidthSlope * (s - left.s), right.h + kWidthSlope * (right.s - s));
  };
  // Of an open path the knots up to the settled one stay.
  const std::size_t kept = static_cast<std::size_t>(
      std::partition_point(knots_.begin(), knots_.end(),
                           [&](const Bound& b) { return b.s <= settled_; }) -
      knots_.begin());
  knots_.resize(kept, Bound{});
  std::vector<double> at;
  for (std::size_t k = kept - std::min<std::size_t>(kept, 2); k < kept; ++k)
    at.push_back(knots_[k].s);
  if (at.empty()) at.push_back(0);
  const std::size_t known = kept > 0 ? at.size() : 0;
  while (at.back() < length_) {
    const double s = at.back();
    at.push_back(std::min(length_, s + kKnotStep * envelope_at(s)));
  }
  // Each knot takes the least bound between its neighbours, so the steps between them stay below.
  std::size_t first = 0;
  for (std::size_t k = known; k < at.size(); ++k) {
    const double from = at[k > 0 ? k - 1 : 0], to = at[std::min(k + 1, at.size() - 1)];
    double h = std::min(envelope_at(from), envelope_at(to));
    while (first < envelope.size() && envelope[first].s < from) ++first;
    for (std::size_t i = first; i < envelope.size() && envelope[i].s <= to; ++i)
      h = std::min(h, envelope[i].h);
    knots_.push_back({at[k], h});
  }
  settled_ = length_;
  if (!open_) return;
  const auto end = std::partition_point(knots_.begin(), knots_.end(),
                                        [&](const Bound& b) { return b.s <= length_ - kReach; });
  settled_ = end - knots_.begin() > 2 ? (end - 2)->s : 0;
}

Path::Width Path::width(double s) const {
  const auto next = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, s,
                                     [](double a, const Bound& b) { return a < b.s; });
  const Bound& right = *next;
  const Bound& left = *(next - 1);
  const double span = right.s - left.s, rise = right.h - left.h;
  const Step step = smooth_blend(std::clamp((s - left.s) / span, 0.0, 1.0));
  return {left.h + rise * step.value, rise * step.slope / span};
}

// ------------------------------------------------------------------------------------- corners

/// Outside of a corner's curve the average sees lines, so one continues the other.
void Path::find_corners(double from) {
  if (!fast()) return;
  std::erase_if(corners_, [from](const Corner& corner) { return corner.s > from; });
  for (std::size_t k = std::max<std::size_t>(index(from), 1); k < segments_.size(); ++k) {
    if (segments_[k].s0 <= from) continue;
    if (const auto corner = corner_between(segments_[k - 1], segments_[k]))
      corners_.push_back(*corner);
  }
}

std::optional<Path::Corner> Path::corner_between(const PathSegment& before,
                                                 const PathSegment& behind) const {
  const auto straight = [](const PathSegment& s) { return s.move.kind != Move::Kind::arc; };
  if (!straight(before) || !straight(behind)) return std::nullopt;
  const Coordinates t1 = (before.move.end - before.move.start) / before.length;
  const Coordinates t2 = (behind.move.end - behind.move.start) / behind.length;
  const Coordinates jump = t2 - t1;
  const double tip = jump.head<3>().norm(), turn = jump.tail<2>().norm();
  if (tip < kSwingingJump || turn > 0) return std::nullopt;
  const double wanted = tolerance_at(behind.s0) / tip, h = width(behind.s0).h;
  const double room = kRoom * std::min(before.length, behind.length);
  for (const auto shape : {PathCorner::Shape::swinging, PathCorner::Shape::plain}) {
    const double cut = std::min(wanted, room / PathCorner::reach_per_cut(shape));
    const PathCorner curve(shape, cut);
    const bool worth =
        shape == PathCorner::Shape::swinging ? cut >= kWorth * wanted : tip >= kPlainJump;
    if (worth && curve.reach() * (1 - kWidthSlope) > h) return Corner{behind.s0, curve, jump};
  }
  return std::nullopt;
}

const Path::Corner* Path::corner_at(double s) const {
  const auto next = std::lower_bound(corners_.begin(), corners_.end(), s,
                                     [](const Corner& corner, double at) { return corner.s < at; });
  if (next != corners_.end() && next->s - s < next->curve.reach()) return &*next;
  if (next != corners_.begin() && s - (next - 1)->s < (next - 1)->curve.reach())
    return &*(next - 1);
  return nullptr;
}

}  // namespace vcnc
