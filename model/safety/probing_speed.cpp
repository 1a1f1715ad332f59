#include "model/safety/probing_speed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/probe/contact.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {
namespace {

constexpr double kSampleStep = 100e-6;
constexpr int kInstants = 16;  ///< of the braking that are looked at, besides the ends of the axes

/// Bounds of a deflection by the way w: laterally and axially.
struct Reach {
  double lateral, axial;
};
Reach reach(const Vec3& w) {
  const double all = w.norm();
  return {0.5 * (all + w.head<2>().norm()), 0.5 * (all + std::abs(w.z()))};
}

/// Largest f with a f + b f^2 <= r.
double largest(double a, double b, double r) {
  if (!(r > 0)) return 0;
  return 2 * r / (a + std::sqrt(a * a + 4 * b * r));
}

}  // namespace

double stopping_distance(double speed, double reaction_time, double deceleration) {
  return speed * reaction_time + speed * speed / (2 * deceleration);
}

ProbingLimit::ProbingLimit(const Machine& machine, double reaction_time)
    : kinematics_(machine.kinematics, machine.probe.length, Vec3::Zero()),
      reaction_time_(reaction_time),
      countable_(machine.probe.signal_period / (2 * kSampleStep)) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    deceleration_[i] = machine.axes[i].limits.acceleration;
  const ProbeParams& probe = machine.probe;
  const UsableRange range = usable_range(probe);
  const Vec3 end = Protection::kRunawayShare * range.positive.cwiseMax(range.negative);
  const double k = probe.spring_rate;
  lateral_reserve_ =
      std::min(probe.overtravel_lateral, probe.overtravel_force_lateral / k) - end.head<2>().norm();
  axial_reserve_ = std::min(probe.overtravel_axial, probe.overtravel_force_axial / k) - end.z();
}

ProbingBound ProbingLimit::at(const AxisVector& q, const AxisVector& dq) const {
  const Eigen::Matrix<double, 3, 5> J =
      kinematics_.forward(q).R_WT.transpose() * kinematics_.jacobian(q);
  std::array<Vec3, kAxisCount> part;
  AxisVector stop{};
  Vec3 v = Vec3::Zero();
  ProbingBound bound;
  double most = -1;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const auto column = J.col(static_cast<Eigen::Index>(i));
    part[i] = column * dq[i];
    stop[i] = std::abs(dq[i]) / deceleration_[i];
    v += part[i];
    if (part[i].norm() > most) {
      most = part[i].norm();
      bound.axis = i;
      bound.lever = is_rotary(i) ? column.norm() : 0;
    }
  }
  Reach braking{0, 0};
  const auto look = [&](double t) {
    Vec3 way = Vec3::Zero();
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (!(stop[i] > 0)) continue;
      const double u = std::min(t, stop[i]);
      way += part[i] * (u - u * u / (2 * stop[i]));
    }
    const Reach r = reach(way);
    braking = {std::max(braking.lateral, r.lateral), std::max(braking.axial, r.axial)};
  };
  const double last = *std::max_element(stop.begin(), stop.end());
  for (int i = 1; i <= kInstants; ++i) look(last * i / kInstants);
  for (const double t : stop) look(t);

  bound.speed = v.norm();
  bound.factor =
      bound.speed > 0 ? countable_ / bound.speed : std::numeric_limits<double>::infinity();
  if (!(most > 0)) return bound;
  const Reach reacting = reach(reaction_time_ * v);
  const double lateral = largest(reacting.lateral, braking.lateral, lateral_reserve_);
  const double axial = largest(reacting.axial, braking.axial, axial_reserve_);
  if (lateral < bound.factor)
    bound = {lateral, ProbingBound::By::lateral, bound.speed, bound.axis, bound.lever};
  if (axial < bound.factor)
    bound = {axial, ProbingBound::By::axial, bound.speed, bound.axis, bound.lever};
  return bound;
}

}  // namespace vcnc
