#include "controller/planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bus/tick.hpp"
#include "controller/fast_law.hpp"

namespace vcnc {
namespace {

constexpr double kPlanAllowed = 1.0005;  ///< share of a limit that the check lets pass
constexpr double kPlanRepairMargin = 0.98;
constexpr double kSpan = 10;    ///< of the fast law that is found at once [s]
constexpr int kMostWaits = 16;  ///< for batches without a path; then the run ends there
constexpr int kScalings = 50;   ///< a few suffice; more would chase the rounding of tiny limits

double rapid_share(const Path& path, const Machine& machine) {
  const bool rapid = path.segments().front().move.kind == Move::Kind::rapid;
  return rapid ? machine.nc.rapid_limit : 1.0;
}

/// A path as long as it has to be for planning to begin: of an open one something must be settled.
Path begun(Path path, const MoveSource& more) {
  for (int waits = 0; path.open() && path.settled() <= 0; ++waits) {
    MoveBatch batch;
    if (waits < kMostWaits) batch = more();
    path.extend(std::move(batch.moves), batch.open);
  }
  return path;
}

}  // namespace

/// A limit exceeded by `ratio` between two instants; order 1 velocity or feed, 2, 3.
struct Trajectory::Excess {
  double t0, t1, ratio;
  int order;
};

Trajectory::Trajectory(Path path, const Machine& machine, MoveSource more)
    : path_(begun(std::move(path), more)),
      more_(std::move(more)),
      dynamics_(path_.segments().front().move.dynamics),
      map_(machine.kinematics, path_.frame()),
      probing_(probing_limit(machine)),
      limits_(machine, rapid_share(path_, machine)),
      nodes_(limit_nodes(path_, map_, limits_, probing_)),
      law_(SpeedLaw::fastest(nodes_, limits_)) {
  plan_smooth();
  // Without a source the whole run is planned at once.
  plan(0, path_.open() || more_ ? 0 : std::numeric_limits<double>::infinity());
}

void Trajectory::plan(double from, double to) {
  while (!complete() && duration() <= to) {
    if (fast() && (!path_.open() || smooth_known_ >= warped_ + kSpan)) {
      plan_fast();
    } else if (path_.open()) {
      const double known = smooth_known_;
      forget(from);
      extend();
      // Moves that hardly get anywhere may be many.
      waits_ = smooth_known_ > known ? 0 : waits_ + 1;
    }
  }
}

/// The path goes on.
void Trajectory::extend() {
  MoveBatch batch;
  if (waits_ < kMostWaits) batch = more_();
  path_.extend(std::move(batch.moves), batch.open);
  nodes_.erase(nodes_.begin(), nodes_.begin() + static_cast<std::ptrdiff_t>(law_.settled()));
  extend_nodes(path_, map_, limits_, probing_, nodes_);
  law_ = SpeedLaw(nodes_, limits_, std::move(law_));
  plan_smooth();
}

void Trajectory::plan_smooth() {
  const bool whole = begun_ == 0 && !path_.open();
  std::vector<Excess> excess = verify();
  for (int i = 0; i < kRepairs && !excess.empty(); ++i) {
    lower(excess);
    law_.again(nodes_, limits_);
    ++repairs_;
    excess = verify();
  }
  for (int i = 0; i < kScalings && !excess.empty(); ++i) {
    if (whole) {
      double pace = 1;
      for (const Excess& e : excess) pace = std::min(pace, std::pow(e.ratio, -1.0 / e.order));
      law_.slow_down(0.999 * pace);
    } else {
      lower(excess);
      law_.again(nodes_, limits_);
    }
    excess = verify();
  }
  smooth_known_ = path_.open() ? law_.settled_time() : law_.duration();
  begun_ = smooth_known_;
  if (!path_.open()) nodes_ = {};
}

/// One more span of the fast law.
void Trajectory::plan_fast() {
  LawSpan span{.t0 = warped_,
               .t1 = smooth_known_,
               .start = fast_known_,
               .from_rest = warped_ == 0,
               .to_rest = true};
  const RunLimits run{path_, map_, limits_, probing_};
  const bool part = path_.open() || smooth_known_ > warped_ + 1.5 * kSpan;
  if (part) {
    span.t1 = quietest(warped_ + 0.75 * kSpan, warped_ + kSpan);
    span.to_rest = false;
  }
  FastLaw law(run, law_, span);
  if (law.given_up() && part) {  // perhaps because of where it ends
    LawSpan other = span;
    other.t1 = quietest(warped_ + 0.5 * kSpan, warped_ + 0.75 * kSpan);
    FastLaw second(run, law_, other);
    if (!second.given_up()) {
      span = other;
      law = std::move(second);
    }
  }
  fast_repairs_ += law.repairs();
  given_up_ += law.given_up();
  spans_.push_back({fast_known_, law.take()});
  fast_known_ += spans_.back().law.duration();
  warped_ = span.t1;
}

/// What share of its limits the smooth motion uses between two instants, at steps of `step`; a
/// little more where it is slower than the feed.
double Trajectory::use_between(double from, double to, double step) const {
  constexpr double kLag = 0.1;
  double use = 0;
  std::array<Coordinates, 4> q;  // newest first
  q.fill(Coordinates::Zero());
  const auto count = static_cast<int>(std::round((to - from) / step));
  for (int i = 0; i <= count; ++i) {
    const LawPoint law = law_.at(from + i * step);
    const PathPoint point = path_.eval(law.s);
    std::rotate(q.begin(), q.end() - 1, q.end());
    q[0] = map_.to_axes(point.x);
    if (i < 3) continue;
    const Coordinates second = (q[0] - 2 * q[1] + q[2]) / (step * step);
    const Coordinates third = (q[0] - 3 * q[1] + 3 * q[2] - q[3]) / (step * step * step);
    use = std::max({use, kLag * (1 - law.ds / feed_limit(path_, law.s, point.dx)),
                    second.cwiseAbs().cwiseQuotient(limits_.acceleration).maxCoeff(),
                    third.cwiseAbs().cwiseQuotient(limits_.jerk).maxCoeff()});
  }
  return use;
}

/// When the smooth motion is furthest from its limits.
double Trajectory::quietest(double from, double to) const {
  constexpr double kCoarse = 10 * kCycle, kAround = 25 * kCycle;
  constexpr std::size_t kCloser = 25;  // of the best ones are looked at cycle by cycle
  struct Candidate {
    double use, t;
  };
  std::vector<Candidate> candidates;
  for (double t = from; t < to; t += kCoarse)
    candidates.push_back({use_between(t - 2 * kCoarse, t + 2 * kCoarse, kCoarse), t});
  const auto less = [](const Candidate& a, const Candidate& b) { return a.use < b.use; };
  std::stable_sort(candidates.begin(), candidates.end(), less);
  candidates.resize(std::min(kCloser, candidates.size()));
  for (Candidate& c : candidates) c.use = use_between(c.t - kAround, c.t + kAround, kCycle);
  return std::min_element(candidates.begin(), candidates.end(), less)->t;
}

void Trajectory::forget(double from) {
  constexpr double kBehind = 1;  // for what looks back at cycles that were played
  if (fast()) {
    while (spans_.size() > 1 && spans_[1].start < from - kBehind) spans_.pop_front();
    from = warped_;
  }
  law_.forget(from - kBehind);
  if (from > kBehind) path_.forget(std::min(law_.at(from - kBehind).s, oldest_position()));
}

/// Where the first span begins: the path is needed from there on.
double Trajectory::oldest_position() const {
  return spans_.empty() ? path_.length() : spans_.front().law.at(0).s;
}

LawPoint Trajectory::law_at(double t) const {
  if (!fast()) return law_.at(t);
  const auto next = std::upper_bound(spans_.begin() + 1, spans_.end(), t,
                                     [](double a, const Span& b) { return a < b.start; });
  const Span& span = *(next - 1);
  return span.law.at(t - span.start);
}

MotionSample Trajectory::at(double t) const {
  const LawPoint law = law_at(t);
  const PathPoint point = path_.eval(law.s);
  const AxisPoint axes = axis_point(map_, point);
  MotionSample sample;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    sample.q[i] = axes.q[row];
    sample.dq[i] = axes.dq[row] * law.ds;
  }
  sample.tip = point.x.head<3>();
  sample.tip_speed = point.dx.head<3>().norm() * law.ds;
  const Move& block = path_.segment(law.s).move;
  sample.line = block.line;
  sample.panel = block.panel;
  return sample;
}

std::vector<Trajectory::Excess> Trajectory::verify() const {
  std::vector<Excess> excess;
  const double end = path_.open() ? law_.settled_time() : law_.duration();
  const auto before = static_cast<Tick>(std::floor(begun_ / kCycle));
  const auto last = path_.open() ? static_cast<Tick>(std::floor(end / kCycle))
                                 : static_cast<Tick>(std::ceil(end / kCycle)) + 3;
  // The axes rest before and after: three equal positions at both ends.
  std::array<Coordinates, 4> q;  // newest first
  for (std::size_t i = 0; i < q.size(); ++i)
    q[i] = axis_point(
               map_,
               path_.eval(law_.at(static_cast<double>(before - static_cast<Tick>(i)) * kCycle).s))
               .q;
  for (Tick k = before + 1; k <= last; ++k) {
    const double t = std::min(static_cast<double>(k) * kCycle, end);
    const LawPoint law = law_.at(t);
    const PathPoint point = path_.eval(law.s);
    const AxisPoint axes = axis_point(map_, point);
    std::rotate(q.begin(), q.end() - 1, q.end());
    q[0] = axes.q;
    const Coordinates first = (q[0] - q[1]) / kCycle;
    const Coordinates second = (q[0] - 2 * q[1] + q[2]) / (kCycle * kCycle);
    const Coordinates third = (q[0] - 3 * q[1] + 3 * q[2] - q[3]) / (kCycle * kCycle * kCycle);
    const Coordinates instant = (axes.dq * law.ds).cwiseAbs().cwiseMax(first.cwiseAbs());
    const double feed = law.ds / feed_limit(path_, law.s, point.dx);
    const std::array<double, 3> ratios{
        std::max(feed, instant.cwiseQuotient(limits_.velocity).maxCoeff()),
        second.cwiseAbs().cwiseQuotient(limits_.acceleration).maxCoeff(),
        third.cwiseAbs().cwiseQuotient(limits_.jerk).maxCoeff()};
    for (int order = 1; order <= 3; ++order) {
      const double ratio = ratios[static_cast<std::size_t>(order - 1)];
      if (ratio > kPlanAllowed) excess.push_back({t - order * kCycle, t, ratio, order});
    }
  }
  return excess;
}

void Trajectory::lower(const std::vector<Excess>& excess) {
  std::vector<double> v(nodes_.size(), 1), a(nodes_.size(), 1);
  for (const Excess& e : excess) {
    const double ratio = e.ratio / kPlanRepairMargin;
    const double v_factor = std::pow(ratio, -1.0 / e.order);
    const double a_factor = e.order == 1 ? 1 : 1 / ratio;
    const double from = law_.raw_position(e.t0 - law_.window()), to = law_.raw_position(e.t1);
    auto node = std::lower_bound(nodes_.begin(), nodes_.end(), from,
                                 [](const LimitNode& n, double s) { return n.s < s; });
    if (node != nodes_.begin()) --node;
    for (; node != nodes_.end(); ++node) {
      const auto j = static_cast<std::size_t>(node - nodes_.begin());
      v[j] = std::min(v[j], v_factor);
      a[j] = std::min(a[j], a_factor);
      if (node->s > to) break;
    }
  }
  for (std::size_t j = 0; j < nodes_.size(); ++j) {
    nodes_[j].v_max *= v[j];
    nodes_[j].a_scale *= a[j];
  }
}

}  // namespace vcnc
