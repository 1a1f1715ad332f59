#include "controller/planner_law.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace vcnc {
namespace {

/// The averaged position is ahead of or behind the middle of the window where the speed changes.
constexpr double kWindowReach = 1.1;
constexpr std::size_t kLastNodes = 8;

/// Each limit v spread over +- v T/2: the least of all that reach a node.
std::vector<double> spread_limits(const std::vector<LimitNode>& nodes, double window) {
  const std::size_t n = nodes.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return nodes[a].v_max < nodes[b].v_max; });
  // From the slowest on, paint what is not painted yet; next_free skips what is.
  std::vector<double> v(n, 0);
  std::vector<std::size_t> next_free(n + 1);
  std::iota(next_free.begin(), next_free.end(), std::size_t{0});
  const auto find_free = [&](std::size_t i) {
    std::size_t root = i;
    while (next_free[root] != root) root = next_free[root];
    while (next_free[i] != root) i = std::exchange(next_free[i], root);
    return root;
  };
  for (const std::size_t j : order) {
    const double limit = nodes[j].v_max, reach = kWindowReach * 0.5 * limit * window;
    const auto below = [](const LimitNode& node, double s) { return node.s < s; };
    const auto first = std::lower_bound(nodes.begin(), nodes.end(), nodes[j].s - reach, below);
    const auto last = std::lower_bound(first, nodes.end(), nodes[j].s + reach, below);
    // One node more at each end: from there on the speed rises.
    const auto begin = static_cast<std::size_t>(first - nodes.begin());
    const auto end = std::min(n, static_cast<std::size_t>(last - nodes.begin()) + 1);
    for (std::size_t i = find_free(begin > 0 ? begin - 1 : 0); i < end; i = find_free(i)) {
      v[i] = limit;
      next_free[i] = i + 1;
    }
  }
  return v;
}

/// Largest v at one node that is reached from the speed `from` at the other.
double reachable(const LimitNode& a, const LimitNode& b, double from, double window,
                 const MotionLimits& limits) {
  const double acceleration =
      std::min(a.acceleration(from, window, limits), b.acceleration(from, window, limits));
  return std::sqrt(from * from + 2 * acceleration * std::abs(b.s - a.s));
}

}  // namespace

SpeedLaw::SpeedLaw(const std::vector<LimitNode>& nodes, const MotionLimits& limits, double window)
    : window_(window) {
  knots_.reserve(nodes.size());
  knots_.push_back({0, nodes.front().s, 0});
  find(nodes, limits);
}

SpeedLaw::SpeedLaw(const std::vector<LimitNode>& nodes, const MotionLimits& limits, SpeedLaw before)
    : knots_(std::move(before.knots_)),
      first_(before.first_ + before.settled_),
      window_(before.window_),
      pace_(before.pace_) {
  again(nodes, limits);
}

void SpeedLaw::again(const std::vector<LimitNode>& nodes, const MotionLimits& limits) {
  knots_.resize(first_ + 1, Knot{});
  find(nodes, limits);
}

/// Appends the knots of all nodes to that of the first one.
void SpeedLaw::find(const std::vector<LimitNode>& nodes, const MotionLimits& limits) {
  std::vector<double> v = spread_limits(nodes, window_);
  const std::size_t n = nodes.size();
  v.front() = knots_.back().v;
  v.back() = 0;
  for (std::size_t j = 1; j < n; ++j)
    v[j] = std::min(v[j], reachable(nodes[j - 1], nodes[j], v[j - 1], window_, limits));
  // What lies before a node that does not brake for the end, does not either. The last nodes may
  // change, and limits behind the end reach back.
  const double fastest = *std::max_element(v.begin(), v.end());
  const double known = nodes.back().s - kWindowReach * 0.5 * fastest * window_;
  settled_ = n;
  for (std::size_t j = n - 1; j-- > 0;) {
    const double least = reachable(nodes[j + 1], nodes[j], v[j + 1], window_, limits);
    if (settled_ == n && least >= v[j] && nodes[j].s <= known && j + kLastNodes < n) settled_ = j;
    v[j] = std::min(v[j], least);
  }
  if (settled_ == n) settled_ = 0;
  v.front() = knots_.back().v;
  knots_.reserve(knots_.size() + n);
  double t = knots_.back().t;
  for (std::size_t j = 1; j < n; ++j) {
    t += 2 * (nodes[j].s - nodes[j - 1].s) / (v[j] + v[j - 1]);
    knots_.push_back({t, nodes[j].s, v[j]});
  }
}

void SpeedLaw::forget(double t) {
  const std::size_t old = std::min(index(pace_ * t - window_), first_);
  if (old == 0) return;
  knots_.erase(knots_.begin(), knots_.begin() + static_cast<std::ptrdiff_t>(old));
  first_ -= old;
}

SpeedLaw SpeedLaw::fastest(const std::vector<LimitNode>& nodes, const MotionLimits& limits) {
  constexpr double kShortest = 4e-3, kRatio = 0.7;
  double window = 2 * (limits.acceleration.cwiseQuotient(limits.jerk)).maxCoeff();
  SpeedLaw best(nodes, limits, std::max(window, kShortest));
  while ((window *= kRatio) > kShortest) {
    SpeedLaw law(nodes, limits, window);
    if (law.duration() < best.duration()) best = std::move(law);
  }
  return best;
}

std::size_t SpeedLaw::index(double t) const {
  const auto next = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, t,
                                     [](double a, const Knot& b) { return a < b.t; });
  return static_cast<std::size_t>(next - knots_.begin()) - 1;
}

LawPoint SpeedLaw::raw_in(std::size_t cell, double t) const {
  const Knot &from = knots_[cell], &to = knots_[cell + 1];
  const double a = (to.v - from.v) / (to.t - from.t), dt = t - from.t;
  return {from.s + dt * (from.v + 0.5 * a * dt), from.v + a * dt, a};
}

LawPoint SpeedLaw::raw(double t) const {
  if (t <= 0) return {};
  if (t >= knots_.back().t) return {knots_.back().s, 0, 0};
  return raw_in(index(t), t);
}

LawPoint SpeedLaw::at(double t) const {
  t *= pace_;
  const double from = t - window_, end = knots_.back().t, last = knots_.back().s;
  if (t <= 0) return {};
  if (from >= end) return {last, 0, 0};
  // Integral of s - reference over the window; Simpson's rule is exact in each cell.
  const LawPoint now = raw(t), before = raw(from);
  const double reference = now.s;
  double sum = from < 0 ? from * reference : 0;  // before the start s = 0
  if (t > end) sum += (t - end) * (last - reference);
  const double lo = std::max(from, 0.0), hi = std::min(t, end);
  for (std::size_t cell = index(lo); cell + 1 < knots_.size() && knots_[cell].t < hi; ++cell) {
    const double a = std::max(lo, knots_[cell].t), b = std::min(hi, knots_[cell + 1].t);
    sum +=
        (b - a) / 6 *
        (raw_in(cell, a).s + 4 * raw_in(cell, 0.5 * (a + b)).s + raw_in(cell, b).s - 6 * reference);
  }
  return {reference + sum / window_, pace_ * (reference - before.s) / window_,
          pace_ * pace_ * (now.ds - before.ds) / window_};
}

}  // namespace vcnc
