#include "controller/planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bus/tick.hpp"

namespace vcnc {
namespace {

constexpr double kAllowed = 1.0005;  ///< share of a limit that the check lets pass
constexpr double kRepairMargin = 0.98;
constexpr int kScalings = 50;  ///< a few suffice; more would chase the rounding of tiny limits

double rapid_share(const Path& path, const Machine& machine) {
  const bool rapid = path.segments().front().move.kind == Move::Kind::rapid;
  return rapid ? machine.nc.rapid_limit : 1.0;
}

}  // namespace

/// A limit exceeded by `ratio` between two instants; order 1 velocity or feed, 2, 3.
struct Trajectory::Excess {
  double t0, t1, ratio;
  int order;
};

Trajectory::Trajectory(Path path, const Machine& machine)
    : path_(std::move(path)),
      map_(machine.kinematics, path_.frame()),
      limits_(machine, rapid_share(path_, machine)),
      nodes_(limit_nodes(path_, map_, limits_, probing_limit(machine))),
      law_(SpeedLaw::fastest(nodes_, limits_)) {
  std::vector<Excess> excess = verify();
  while (!excess.empty() && repairs_ < kRepairs) {
    lower(excess);
    law_ = SpeedLaw(nodes_, limits_, law_.window());
    ++repairs_;
    excess = verify();
  }
  for (int i = 0; i < kScalings && !excess.empty(); ++i) {
    double pace = 1;
    for (const Excess& e : excess) pace = std::min(pace, std::pow(e.ratio, -1.0 / e.order));
    law_.slow_down(0.999 * pace);
    excess = verify();
  }
  nodes_ = {};
}

MotionSample Trajectory::at(double t) const {
  const LawPoint law = law_.at(t);
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
  sample.line = path_.segment(law.s).move.line;
  return sample;
}

std::vector<Trajectory::Excess> Trajectory::verify() const {
  std::vector<Excess> excess;
  const auto cycles = static_cast<Tick>(std::ceil(duration() / kCycle));
  // The axes rest before and after: three equal positions at both ends.
  std::array<Coordinates, 4> q;  // newest first
  q.fill(axis_point(map_, path_.eval(0)).q);
  for (Tick k = 1; k <= cycles + 3; ++k) {
    const double t = std::min(static_cast<double>(k) * kCycle, duration());
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
      if (ratio > kAllowed) excess.push_back({t - order * kCycle, t, ratio, order});
    }
  }
  return excess;
}

void Trajectory::lower(const std::vector<Excess>& excess) {
  std::vector<double> v(nodes_.size(), 1), a(nodes_.size(), 1);
  for (const Excess& e : excess) {
    const double ratio = e.ratio / kRepairMargin;
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
