#include "controller/fast_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bus/tick.hpp"

namespace vcnc {
namespace {

constexpr double kAllowed = 1.0 + 1e-6;  ///< share of a limit that the check lets pass
/// Share of acceleration and jerk of the fastest motion; the next one where repairs do not help.
constexpr std::array<double, 3> kMargins{0.985, 0.95, 0.9};
constexpr double kSpeedMargin = 1 - 5e-5;
constexpr double kRepairMargin = 0.985;       ///< and of the repaired one
constexpr double kAllowedAtAnyPhase = 0.999;  ///< the same at moments that may become cycles
constexpr std::size_t kPhases = 4;            ///< of a cycle that are looked at
constexpr int kMostRepairs = 40;
constexpr double kFirmer = 0.002;       ///< by which each repair lowers a limit more than the last
constexpr double kAroundExcess = 0.12;  ///< of an excess: the stretch that a repair may change [s]
constexpr double kTableStep = 0.25e-3;  ///< of the speed law [s]
constexpr double kSampleStep = 1e-3;    ///< of the differences that the warp is found from [s]
/// Samples in each of these, on grids no finer than kSampleStep: to see all phases.
constexpr double kBetween = 2;
struct Round {
  double step;      ///< of the grid [s]
  double accuracy;  ///< how close to the optimum
};
constexpr std::array<Round, 3> kRounds{{{4e-3, 1e-3}, {2e-3, 3e-4}, {1e-3, 1e-4}}};
constexpr Round kLastRound{0.5e-3, 1e-4};
constexpr int kMostLastRounds = 8;
constexpr double kLeastGain = 2e-3;  ///< in time; less ends the rounds
/// What a round leaves alone next to an end that is not at rest, more than the one before [s]: what
/// is not as it should be where the change begins, would grow from round to round.
constexpr double kInset = 0.012;
/// What nothing changes next to such an end: no difference of the third order sees two spans [s].
constexpr double kGap = 4 * kCycle;
constexpr double kRepairAccuracy = 1e-6;
constexpr std::size_t kFewestNodes = 48;
constexpr std::size_t kStretch = 400;  ///< grid points that are warped at once
constexpr double kFree = 1e8;          ///< c where nothing limits the speed
constexpr double kAtFeed = 2e-3;       ///< of c: there is nothing to gain
constexpr std::size_t kPlateau = 40;   ///< grid points at the feed that are left alone
constexpr double kNearFeed = 2e-3;     ///< of the feed: less is set right
constexpr double kConstant = 1e-5;     ///< what a constant feed may vary by
constexpr double kOntoFeed = 0.02;     ///< time in which the law goes over to the feed [s]

std::size_t steps_of(double duration, double step) {
  return std::max(kFewestNodes, static_cast<std::size_t>(std::ceil(duration / step)));
}

/// 10 u^3 - 15 u^4 + 6 u^5 and its slope.
std::pair<double, double> smooth_step(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return {u * u * u * (10 + u * (6 * u - 15)), 30 * u * u * (1 - u) * (1 - u)};
}

/// Where between two grid points the motion is furthest from its limits, for the end of a stretch.
std::size_t quietest(const std::vector<WarpNode>& nodes, std::size_t from, std::size_t to) {
  constexpr std::size_t kNear = 4;
  std::size_t best = from;
  double least = 1e300;
  for (std::size_t i = from; i < to; ++i) {
    double use = 0;
    for (std::size_t k = i - kNear; k <= i + kNear; ++k) use = std::max(use, nodes[k].use());
    if (use < least) {
      least = use;
      best = i;
    }
  }
  return best;
}

/// Grid points [begin, end] that are warped together.
struct Stretch {
  std::size_t begin, end;
};

/// Cuts what is warped into parts of bounded length.
void add_parts(const std::vector<WarpNode>& nodes, std::size_t begin, std::size_t end,
               std::vector<Stretch>& parts) {
  while (begin < end) {
    std::size_t cut = begin + kStretch;
    cut = cut + kStretch / 2 > end ? end : quietest(nodes, cut - kStretch / 4, cut + kStretch / 4);
    parts.push_back({begin, cut});
    begin = cut;
  }
}

/// All between two grid points but the places where the motion is as fast as it may be already.
std::vector<Stretch> stretches_of(const std::vector<WarpNode>& nodes, std::size_t first,
                                  std::size_t last) {
  constexpr std::size_t kShortest = 8;
  std::vector<Stretch> result;
  const auto done = [&](std::size_t i) {
    return nodes[i].c_max <= 1 + kAtFeed && nodes[i].use() <= 1;
  };
  std::size_t begin = first;
  for (std::size_t i = first; i <= last;) {
    std::size_t next = i;
    while (next <= last && done(next)) ++next;
    if (next - i >= kPlateau || next > last) {
      if (i >= begin + kShortest) add_parts(nodes, begin, std::min(i, last), result);
      begin = std::min(next - 1, last);
    }
    i = std::max(next, i + 1);
  }
  if (last >= begin + kShortest) add_parts(nodes, begin, last, result);
  return result;
}

}  // namespace

/// A limit exceeded by `ratio` between two instants; order 1 velocity or feed, 2, 3.
struct FastLaw::Excess {
  double t0, t1, ratio;
  int order;
};

/// A change of time d tau / dt = sqrt(c(tau)) in parts of the law; c = 1 elsewhere.
struct FastLaw::Warp {
  struct Rate {
    double c, dc;
  };
  struct Part {
    double from, to, step;
    std::vector<double> c;  ///< coefficients of a cubic B-spline; empty: onto a feed
    double feed = 0;

    /// c and its derivative in time.
    Rate at(double t, const LawPoint& law) const {
      if (c.empty()) {
        const auto [up, up1] = smooth_step((t - from) / kOntoFeed);
        const auto [down, down1] = smooth_step((to - t) / kOntoFeed);
        const double w = up * down, w1 = (up1 * down - up * down1) / kOntoFeed;
        const double share = feed / law.ds, rate = 1 + w * (share - 1);
        return {rate * rate, 2 * rate * (w1 * (share - 1) - w * share * law.dds / law.ds)};
      }
      const double place = (t - from) / step;
      const std::size_t cells = c.size() - 3;
      const std::size_t i = std::min(static_cast<std::size_t>(std::max(place, 0.0)), cells - 1);
      const double u = place - static_cast<double>(i), w = 1 - u;
      const double* p = &c[i];
      return {(w * w * w * p[0] + (3 * u * u * (u - 2) + 4) * p[1] +
               (3 * w * w * (w - 2) + 4) * p[2] + u * u * u * p[3]) /
                  6,
              0.5 / step *
                  (-w * w * p[0] + u * (3 * u - 4) * p[1] - w * (3 * w - 4) * p[2] + u * u * p[3])};
    }
  };
  std::vector<Part> parts;  ///< in order
};

double FastLaw::worst(const std::vector<Excess>& excess) {
  double ratio = 0;
  for (const Excess& e : excess) ratio = std::max(ratio, e.ratio);
  return ratio;
}

FastLaw::FastLaw(const RunLimits& run, const SpeedLaw& base, const LawSpan& span)
    : run_(&run), base_(&base), span_(span), law_(table_of_base()) {
  for (const double margin : kMargins) {
    warp_in_rounds(margin);
    keep_feed();
    if (repair()) return;
    law_ = table_of_base();
  }
  given_up_ = true;
  // The base law keeps the limits at cycles of its own; here it may not.
  if (!repair()) {
    const double left = worst(at_cycles());
    SpeedTable repaired = std::exchange(law_, table_of_base());
    if (left < worst(at_cycles())) law_ = std::move(repaired);
  }
}

void FastLaw::warp_in_rounds(double margin) {
  double inset = kGap;
  for (const Round& round : kRounds) {
    warp_fastest(round.step, round.accuracy, margin, inset);
    inset += kInset;
  }
  for (int i = 0; i < kMostLastRounds; ++i) {
    const double before = law_.duration();
    warp_fastest(kLastRound.step, kLastRound.accuracy, margin, inset);
    if (before - law_.duration() < kLeastGain * before) break;
    inset += kInset;
  }
}

SpeedTable FastLaw::table_of_base() const {
  const double duration = span_.t1 - span_.t0;
  const std::size_t steps = steps_of(duration, kTableStep);
  std::vector<LawPoint> points;
  points.reserve(steps + 1);
  for (std::size_t k = 0; k <= steps; ++k)
    points.push_back(
        base_->at(span_.t0 + duration * static_cast<double>(k) / static_cast<double>(steps)));
  if (span_.from_rest) points.front() = {points.front().s, 0, 0};
  if (span_.to_rest) points.back() = {points.back().s, 0, 0};
  return {std::move(points), duration};
}

/// Goes on as the base law beyond both ends.
LawPoint FastLaw::law_at(double t) const {
  if (t < 0) return base_->at(span_.t0 + t);
  if (t > law_.duration()) return base_->at(span_.t1 + t - law_.duration());
  return law_.at(t);
}

// ------------------------------------------------------------------------------------- warping

/// A part of the present law as samples in time. Derivatives are differences over `span` samples.
struct FastLaw::Motion {
  std::size_t samples;         ///< per step of the grid
  std::size_t span;            ///< samples in which differences are taken
  double h;                    ///< between samples [s]
  std::vector<Coordinates> q;  ///< axis positions, `more` samples beyond either end
  std::vector<double> speed;   ///< share of what feed and probe allow

  std::size_t more() const { return 3 * std::max(span, samples); }
  std::size_t count() const { return (q.size() - 1 - 2 * more()) / samples; }
  double step() const { return h * static_cast<double>(samples); }
  /// Differences between k - span / 2 .. k + span / 2 and so on, as derivatives.
  Coordinates second(std::size_t k) const {
    const double d = h * static_cast<double>(span);
    return (q[k + span] - 2 * q[k] + q[k - span]) / (d * d);
  }
  /// The last one from k back.
  Coordinates third(std::size_t k) const {
    const double d = h * static_cast<double>(span);
    return (q[k] - 3 * q[k - span] + 3 * q[k - 2 * span] - q[k - 3 * span]) / (d * d * d);
  }
};

FastLaw::Motion FastLaw::motion(double from, double cell, std::size_t count, std::size_t samples,
                                std::size_t span) const {
  Motion motion{samples, span, cell / static_cast<double>(samples), {}, {}};
  const std::size_t last = count * samples + 2 * motion.more();
  motion.q.reserve(last + 1);
  motion.speed.reserve(last + 1);
  for (std::size_t k = 0; k <= last; ++k) {
    const LawPoint law =
        law_at(from + motion.h * (static_cast<double>(k) - static_cast<double>(motion.more())));
    const PathPoint point = run_->path.eval(law.s);
    AxisPoint axes;
    if (run_->probing)
      axes = axis_point(run_->map, point);
    else
      axes.q = run_->map.to_axes(point.x);
    motion.q.push_back(axes.q);
    motion.speed.push_back(law.ds / speed_limit(run_->path, law.s, point.dx, axes, run_->probing));
  }
  return motion;
}

/// What limits the warp at each grid point, from all samples around it.
std::vector<WarpNode> FastLaw::warp_nodes(const Motion& motion, double margin) const {
  const double step = motion.step(), d = motion.h * static_cast<double>(motion.span);
  const Coordinates a = run_->limits.acceleration * margin, j = run_->limits.jerk * margin;
  const std::size_t span = motion.span, around = (motion.samples + 1) / 2;
  std::vector<WarpNode> nodes(motion.count() + 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::size_t k = i * motion.samples + motion.more();
    const Coordinates d1 = (motion.q[k + span] - motion.q[k - span]) / (2 * d);
    const Coordinates d2 = motion.second(k);
    Coordinates low2 = d2, high2 = d2, low3, high3, fastest = d1.cwiseAbs();
    low3.setConstant(1e300);
    high3.setConstant(-1e300);
    double speed = 0;
    for (std::size_t m = k - around; m <= k + around; ++m) {
      const Coordinates second = motion.second(m);
      speed = std::max(speed, motion.speed[m]);
      low2 = low2.cwiseMin(second);
      high2 = high2.cwiseMax(second);
      fastest =
          fastest.cwiseMax((motion.q[m + span / 2] - motion.q[m + span / 2 - span]).cwiseAbs() / d);
    }
    // Centred on the grid point, and half a span to either side.
    for (std::size_t m = k + span + (span + 1) / 2 - around; m <= k + span + span / 2 + around;
         ++m) {
      const Coordinates third = motion.third(m);
      low3 = low3.cwiseMin(third);
      high3 = high3.cwiseMax(third);
    }
    WarpNode& node = nodes[i];
    speed = std::max(speed, fastest.cwiseQuotient(run_->limits.velocity).maxCoeff());
    node.c_max = 1 / std::max(speed * speed, 1 / kFree);
    node.a0_low = low2.cwiseQuotient(a);
    node.a0_high = high2.cwiseQuotient(a);
    node.a1 = d1.cwiseQuotient(2 * step * a);
    node.j0_low = low3.cwiseQuotient(j);
    node.j0_high = high3.cwiseQuotient(j);
    node.j1 = 1.5 / step * d2.cwiseQuotient(j);
    node.j2 = 0.5 / (step * step) * d1.cwiseQuotient(j);
  }
  return nodes;
}

void FastLaw::warp_fastest(double step, double accuracy, double margin, double inset) {
  const double duration = law_.duration();
  const std::size_t count = steps_of(duration, step);
  const double span = kBetween * std::max(1.0, kSampleStep / step);
  const Motion now = motion(0, duration / static_cast<double>(count), count,
                            static_cast<std::size_t>(std::lround(span * step / kSampleStep)),
                            static_cast<std::size_t>(std::lround(span)));
  const std::vector<WarpNode> nodes = warp_nodes(now, margin);
  const auto held = static_cast<std::size_t>(std::ceil(inset / now.step()));
  // The finest grid would put a jerk into the last cycle that only the rest after it hides.
  const std::size_t at_rest = step < kSampleStep ? static_cast<std::size_t>(kInset / step) : 0;
  const std::size_t first = span_.from_rest ? at_rest : held,
                    behind = span_.to_rest ? at_rest : held;
  if (first + behind >= count) return;
  Warp warp;
  for (const auto& [begin, end] : stretches_of(nodes, first, count - behind)) {
    const bool hold_start = begin > 0 || !span_.from_rest;
    const bool hold_end = end < count || !span_.to_rest;
    const std::vector<WarpNode> stretch(nodes.begin() + static_cast<std::ptrdiff_t>(begin),
                                        nodes.begin() + static_cast<std::ptrdiff_t>(end) + 1);
    warp.parts.push_back({now.step() * static_cast<double>(begin),
                          now.step() * static_cast<double>(end), now.step(),
                          time_warp(stretch, WarpAim::fastest, accuracy, hold_start, hold_end)});
  }
  follow(warp);
}

/// Where the law is at a constant feed but for what the optimisation leaves, it gets exactly that.
void FastLaw::keep_feed() {
  Warp warp;
  double from = -1, feed = 0, last = 0;
  const auto finish = [&] {
    if (from >= 0 && last - from > 4 * kOntoFeed) warp.parts.push_back({from, last, 0, {}, feed});
    from = -1;
  };
  for (double t = 0; t <= law_.duration(); t += kSampleStep) {
    const LawPoint law = law_.at(t);
    const PathPoint point = run_->path.eval(law.s);
    const double limit = feed_limit(run_->path, law.s, point.dx);
    const bool near = law.ds > (1 - kNearFeed) * limit;
    if (from >= 0 && (!near || std::abs(limit - feed) > kConstant * feed)) finish();
    if (near && from < 0) {
      from = t;
      feed = limit;
    }
    if (near) {
      feed = std::min(feed, limit);
      last = t;
    }
  }
  finish();
  if (!warp.parts.empty()) follow(warp);
}

/// The law that runs through the present one as the warp says.
/// Gives when its parts begin and end then.
std::vector<double> FastLaw::follow(const Warp& warp) {
  constexpr std::array<double, 3> kPlace{0.11270166537925831, 0.5, 0.88729833462074169};
  constexpr std::array<double, 3> kWeight{5.0 / 18, 8.0 / 18, 5.0 / 18};
  constexpr double kCell = 1e-3;
  std::vector<double> moved;
  if (warp.parts.empty()) return moved;
  const double end = law_.duration();
  double gain = 0;
  for (const Warp::Part& part : warp.parts) {
    const double to = std::min(part.to, end);
    const auto cells = static_cast<int>(std::ceil((to - part.from) / kCell));
    const double cell = (to - part.from) / cells;
    moved.push_back(part.from - gain);
    double time = 0;
    for (int i = 0; i < cells; ++i)
      for (std::size_t g = 0; g < 3; ++g) {
        const double t = part.from + (i + kPlace[g]) * cell;
        time += cell * kWeight[g] / std::sqrt(part.at(t, law_.at(t)).c);
      }
    gain += to - part.from - time;
    moved.push_back(to - gain);
  }
  const double time = end - gain;
  if (!std::isfinite(time)) return moved;

  const std::size_t steps = steps_of(time, kTableStep);
  const double dt = time / static_cast<double>(steps);
  auto part = warp.parts.begin();
  const auto rate_at = [&](double t, const LawPoint& law) -> Warp::Rate {
    while (part != warp.parts.end() && t > part->to) ++part;
    if (part == warp.parts.end() || t < part->from) return {1, 0};
    return part->at(t, law);
  };
  const auto rate = [&](double t) {
    return std::sqrt(
        rate_at(t, part != warp.parts.end() && part->c.empty() ? law_.at(t) : LawPoint{}).c);
  };
  std::vector<LawPoint> points;
  points.reserve(steps + 1);
  double t = 0;
  for (std::size_t k = 0; k <= steps; ++k) {
    const LawPoint law = law_.at(t);
    const Warp::Rate now = rate_at(t, law);
    points.push_back({law.s, law.ds * std::sqrt(now.c), law.dds * now.c + 0.5 * law.ds * now.dc});
    const double k1 = std::sqrt(now.c), k2 = rate(t + 0.5 * dt * k1), k3 = rate(t + 0.5 * dt * k2),
                 k4 = rate(t + dt * k3);
    t = std::min(t + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), end);
  }
  points.front() = law_.at(0);
  points.back() = law_.at(end);
  law_ = SpeedTable(std::move(points), time);
  return moved;
}

// ------------------------------------------------------------------------------------ checking

/// What a controller that begins its cycles at any moment would find between two instants.
std::vector<FastLaw::Excess> FastLaw::at_any_phase(double from, double to) const {
  const auto count = static_cast<std::size_t>(std::ceil((to - from) / kCycle));
  const Motion now = motion(from, kCycle, count, kPhases, kPhases);
  std::vector<Excess> excess;
  for (std::size_t k = now.more(); k < now.q.size() - kPhases; ++k) {
    const double t = from + now.h * (static_cast<double>(k) - static_cast<double>(now.more()));
    const Coordinates velocity = (now.q[k] - now.q[k - kPhases]).cwiseAbs() / kCycle;
    const std::array<double, 3> ratios{
        std::max(now.speed[k], velocity.cwiseQuotient(run_->limits.velocity).maxCoeff()),
        now.second(k - kPhases).cwiseAbs().cwiseQuotient(run_->limits.acceleration).maxCoeff(),
        now.third(k).cwiseAbs().cwiseQuotient(run_->limits.jerk).maxCoeff()};
    for (int order = 1; order <= 3; ++order) {
      const double ratio = ratios[static_cast<std::size_t>(order - 1)];
      if (ratio > (order == 1 ? kAllowed : kAllowedAtAnyPhase))
        excess.push_back({t - order * kCycle, t, ratio, order});
    }
  }
  return excess;
}

/// What really happens.
std::vector<FastLaw::Excess> FastLaw::at_cycles() const {
  const double end = law_.duration() + (span_.to_rest ? 3 * kCycle : 0);
  const auto first = static_cast<Tick>(std::ceil(span_.start / kCycle));
  const auto last = static_cast<Tick>(std::ceil((span_.start + end) / kCycle));
  std::vector<Excess> excess;
  std::array<Coordinates, 4> q;  // newest first
  q.fill(Coordinates::Zero());
  for (Tick k = first - 3; k <= last; ++k) {
    const double t = static_cast<double>(k) * kCycle - span_.start;
    const LawPoint law = law_at(t);
    const PathPoint point = run_->path.eval(law.s);
    std::rotate(q.begin(), q.end() - 1, q.end());
    const AxisPoint axes = axis_point(run_->map, point);
    q[0] = axes.q;
    if (k < first) continue;
    const Coordinates velocity = (q[0] - q[1]) / kCycle;
    const Coordinates second = (q[0] - 2 * q[1] + q[2]) / (kCycle * kCycle);
    const Coordinates third = (q[0] - 3 * q[1] + 3 * q[2] - q[3]) / (kCycle * kCycle * kCycle);
    const Coordinates instant = (axes.dq * law.ds).cwiseAbs().cwiseMax(velocity.cwiseAbs());
    const double speed = law.ds / speed_limit(run_->path, law.s, point.dx, axes, run_->probing);
    const std::array<double, 3> ratios{
        std::max(speed, instant.cwiseQuotient(run_->limits.velocity).maxCoeff()),
        second.cwiseAbs().cwiseQuotient(run_->limits.acceleration).maxCoeff(),
        third.cwiseAbs().cwiseQuotient(run_->limits.jerk).maxCoeff()};
    for (int order = 1; order <= 3; ++order) {
      const double ratio = ratios[static_cast<std::size_t>(order - 1)];
      if (ratio > kAllowed) excess.push_back({t - order * kCycle, t, ratio, order});
    }
  }
  return excess;
}

/// Warps the motion around each excess; the parts are held at both ends where it goes on.
FastLaw::Warp FastLaw::warp_nearest(const std::vector<Excess>& excess, int firmness) {
  const double earliest = span_.from_rest ? 0 : kGap;
  const double end = law_.duration() - (span_.to_rest ? 0 : kGap);
  std::vector<std::pair<double, double>> windows;  // a whole number of cycles long
  for (const Excess& e : excess) {
    const double from = std::max(earliest, e.t0 - kAroundExcess),
                 to = std::min(end, e.t1 + kAroundExcess);
    if (from >= to) continue;
    if (!windows.empty() && from <= windows.back().second)
      windows.back().second = std::max(windows.back().second, to);
    else
      windows.push_back({from, to});
  }
  Warp warp;
  for (const auto& [from, to] : windows) {
    const std::size_t count =
        std::max(kFewestNodes, static_cast<std::size_t>(std::ceil((to - from) / kCycle)));
    const double h = kCycle;
    std::vector<WarpNode> nodes =
        warp_nodes(motion(from, kCycle, count, kPhases, kPhases), kRepairMargin);
    std::vector<std::array<double, 3>> found(nodes.size(), {1, 1, 1});
    for (const Excess& e : excess) {
      if (e.t1 < from || e.t0 > to) continue;
      const auto place = [&, start = from](double t) {
        return std::clamp((t - start) / h, 0.0, static_cast<double>(count));
      };
      const auto until = static_cast<std::size_t>(std::ceil(place(e.t1)));
      for (auto i = static_cast<std::size_t>(std::floor(place(e.t0))); i <= until; ++i) {
        double& ratio = found[i][static_cast<std::size_t>(e.order - 1)];
        ratio = std::max(ratio, e.ratio * (1 + kFirmer * firmness));
      }
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      nodes[i].exceeded(found[i]);
      if (found[i][0] > 1) nodes[i].c_max *= kSpeedMargin;
    }
    std::vector<Stretch> parts;
    add_parts(nodes, 0, count, parts);
    for (const auto& [begin, finish] : parts) {
      const double first = from + h * static_cast<double>(begin);
      const double last = from + h * static_cast<double>(finish);
      const std::vector<WarpNode> stretch(nodes.begin() + static_cast<std::ptrdiff_t>(begin),
                                          nodes.begin() + static_cast<std::ptrdiff_t>(finish) + 1);
      const bool within = std::all_of(stretch.begin(), stretch.end(),
                                      [](const WarpNode& node) { return node.use() <= 1; });
      if (within) continue;
      const bool hold_start = first > 0 || !span_.from_rest,
                 hold_end = last < end || !span_.to_rest;
      warp.parts.push_back(
          {first, last, h,
           time_warp(stretch, WarpAim::nearest, kRepairAccuracy, hold_start, hold_end)});
    }
  }
  return warp;
}

/// False: there is still something outside the limits.
bool FastLaw::repair() {
  std::vector<Excess> excess = at_any_phase(0, law_.duration());
  for (int round = 0; round < kMostRepairs; ++round) {
    if (excess.empty()) excess = at_cycles();
    if (excess.empty()) return true;
    const Warp warp = warp_nearest(excess, round);
    const std::vector<double> moved = follow(warp);
    ++repairs_;
    excess.clear();
    for (std::size_t i = 0; i < warp.parts.size(); ++i) {
      const std::vector<Excess> here = at_any_phase(moved[2 * i], moved[2 * i + 1]);
      excess.insert(excess.end(), here.begin(), here.end());
    }
  }
  return false;
}

}  // namespace vcnc
