#include "model/probe/contact.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vcnc {
namespace {

constexpr double kStep = 100e-6;        // [s]
constexpr double kGravity = 9.80665;    // [m/s^2]
constexpr double kRadiusChange = 1e-3;  // [m] effects change the radius by less than this
constexpr double kRise = 20e-3;         // [s] in which the surface comes back after lifting

}  // namespace

double UsableRange::share(const Vec3& deflection) const {
  double worst = 0;
  for (int i = 0; i < 3; ++i)
    worst = std::max(worst, deflection[i] / (deflection[i] < 0 ? -negative[i] : positive[i]));
  return worst;
}

UsableRange usable_range(const ProbeParams& probe) {
  UsableRange range{Vec3::Constant(probe.range), Vec3::Constant(probe.range)};
  const bool vertical = probe.mounting == ProbeParams::Mounting::vertical;
  const double mass = probe.stylus_mass + (vertical ? 0 : probe.moving_mass);
  const double shift = std::min(mass * kGravity / probe.spring_rate, 0.99 * probe.range);
  // Vertical: the stylus hangs towards -z. Horizontal: +y of the probe is down.
  const int axis = vertical ? 2 : 1;
  range.positive[axis] += vertical ? shift : -shift;
  range.negative[axis] += vertical ? -shift : shift;
  return range;
}

ProbeContact::ProbeContact(const ProbeParams& probe, Chain<TouchPort> effects, const Piece* piece)
    : probe_(probe),
      effects_(std::move(effects)),
      ball_{.radius = probe.ball_radius},
      piece_(piece),
      mass_(probe.moving_mass + probe.stylus_mass),
      damping_(2 * probe.damping_ratio * std::sqrt(probe.spring_rate * mass_)) {}

void ProbeContact::place(const ToolPose& pose) {
  p_ = p_tool_ = pose.p_WT;
  placed_ = true;
  if (piece_ == nullptr) return;
  surface_ = piece_->nearest(p_, surface_);
  if (surface_.valid && surface_.distance < ball_.radius)
    p_ += (ball_.radius - surface_.distance) * surface_.n;
}

/// What the ball and its contact are like at this step.
void ProbeContact::feel(const ToolPose& pose) {
  ball_ = {.radius = probe_.ball_radius};
  TouchPort::Context<double> context{
      .moment = {static_cast<double>(steps_) * kStep, kStep, steps_}};
  if (surface_.valid) {
    context.normal_W = surface_.n;
    context.normal_T = pose.R_WT.transpose() * surface_.n;
  }
  effects_.step(ball_, context);
  if (lifted_ || sunk_ > 0) put_back();
  lifted_ = ball_.lifted > 0.5;
}

/// After lifting: brings the surface back, as a ball that is too small by sunk_.
void ProbeContact::put_back() {
  if (ball_.lifted > 0.5) {
    sunk_ = 0;
    return;
  }
  if (lifted_ && piece_ != nullptr) {
    surface_ = piece_->nearest(p_, surface_);
    sunk_ = surface_.valid ? std::max(0.0, ball_.radius - surface_.distance) : 0;
  }
  clearance_ = 0;  // the radius grows by more than kRadiusChange
  sunk_ = sunk_ > 1e-9 ? sunk_ * std::exp(-kStep / kRise) : 0;
  ball_.radius -= sunk_;
}

Vec3 ProbeContact::step(const ToolPose& pose) {
  if (!effects_.empty()) feel(pose);
  ++steps_;
  if (!placed_) place(pose);
  const Vec3 v_tool = (pose.p_WT - p_tool_) / kStep;
  const double inertia = mass_ + kStep * damping_;  // with the implicit damper
  const Vec3 spring = probe_.spring_rate * (p_ - p_tool_);
  Vec3 v = (mass_ * v_ - kStep * spring + kStep * damping_ * v_tool) / inertia;

  if (ball_.return_to_zero > 0) {
    // The guides rub on the housing: a friction impulse that can at most stop the sliding in them.
    const Vec3 sliding = v - v_tool;
    const double speed = sliding.norm();
    const double most = kStep * probe_.spring_rate * ball_.return_to_zero / inertia;
    if (speed > 0) v -= sliding * std::min(1.0, most / speed);
  }

  touching_ = false;
  force_ = Vec3::Zero();
  if (piece_ != nullptr && !(ball_.lifted > 0.5)) touch(inertia, v);
  p_ += kStep * v;
  v_ = v;
  p_tool_ = pose.p_WT;
  return pose.R_WT.transpose() * (p_ - pose.p_WT);
}

void ProbeContact::touch(double inertia, Vec3& v) {
  const Vec3 end = p_ + kStep * v;
  // The distance from a solid changes by no more than the way travelled, so far away need not be
  // searched.
  if ((end - searched_).norm() < clearance_) return;
  surface_ = piece_->nearest(end, surface_);
  const double gap = surface_.distance - ball_.radius;
  searched_ = end;
  clearance_ = surface_.valid ? gap - (effects_.empty() ? 0 : kRadiusChange) : 0;
  if (!surface_.valid || gap >= 0) return;
  touching_ = true;
  const Vec3& n = surface_.n;
  const double push = -gap / kStep;  // change of velocity that ends the step on the surface
  v += push * n;
  force_ = n * (push * inertia / kStep);
  if (ball_.friction > 0) {
    const Vec3 sliding = v - n * n.dot(v);
    const double speed = sliding.norm();
    if (speed > 0) {
      const Vec3 change = sliding * -std::min(1.0, ball_.friction * push / speed);
      v += change;
      force_ += change * (inertia / kStep);
    }
  }
}

}  // namespace vcnc
