#include "model/drive/spindle.hpp"

#include <algorithm>
#include <cmath>

#include "model/drive/axis_drive.hpp"

namespace vcnc {
namespace {

constexpr double kOrientShare = 0.8;  // of the acceleration, so that the ramp can be followed
constexpr double kReachShare = 0.9;   // an occurrence that needs more than this is too near
constexpr double kManyTurns = 1000;   // are not counted one by one
constexpr double kOrientGain = 60;    // [1/s]
constexpr double kOrientedAngle = 1e-4, kOrientedSpeed = 1e-2;

double wrapped_turn(double angle) {
  angle = std::fmod(angle, 2 * kPi);
  return angle < 0 ? angle + 2 * kPi : angle;
}

}  // namespace

SpindleDrive::SpindleDrive(const SpindleParams& params) : params_(params) {}

// Speed that brings the spindle to the orientation angle.
double SpindleDrive::toward_angle() const {
  const double brake = kOrientShare * params_.acceleration;
  double ahead = wrapped_turn(params_.orient_angle - angle_);  // distance in positive direction
  const double stopping = speed_ * speed_ / (2 * kReachShare * params_.acceleration);
  const bool slow = std::abs(speed_) < kOrientGain * kPi / 4;
  if (slow ? ahead > kPi : speed_ < 0) ahead -= 2 * kPi;
  // Too near to stop at this occurrence: take a later one.
  if (const double turns = std::floor((stopping - std::abs(ahead)) / (2 * kPi));
      !slow && turns > kManyTurns)
    ahead += std::copysign(2 * kPi * (turns - 1), speed_);
  if (!slow)
    while (std::abs(ahead) < stopping) ahead += std::copysign(2 * kPi, speed_);
  const double distance = std::abs(ahead);
  // Square-root ramp far away; the line that touches it smoothly from there on.
  const double change = brake / (kOrientGain * kOrientGain);
  const double speed =
      distance > change ? std::sqrt(2 * brake * (distance - 0.5 * change)) : kOrientGain * distance;
  return std::copysign(std::min(speed, params_.max_speed), ahead);
}

SpindleCycle SpindleDrive::step(SpindleMode mode, double speed) {
  SpindleCycle cycle;
  cycle.limited = std::abs(speed) > params_.max_speed &&
                  (mode == SpindleMode::clockwise || mode == SpindleMode::counter_clockwise);
  const double magnitude = std::min(std::abs(speed), params_.max_speed);
  double target = 0;
  for (int i = 0; i < kDriveLoopSteps; ++i) {
    switch (mode) {
      case SpindleMode::off:
        target = 0;
        break;
      case SpindleMode::clockwise:
        target = magnitude;
        break;
      case SpindleMode::counter_clockwise:
        target = -magnitude;
        break;
      case SpindleMode::orient:
        target = toward_angle();
        break;
    }
    const double most = params_.acceleration * kDriveLoopTime;
    const double before = speed_;
    speed_ += std::clamp(target - speed_, -most, most);
    angle_ = wrapped_turn(angle_ + 0.5 * (before + speed_) * kDriveLoopTime);
  }
  if (mode == SpindleMode::orient) {
    const double off = wrapped_turn(params_.orient_angle - angle_ + kPi) - kPi;
    if (std::abs(off) < kOrientedAngle && std::abs(speed_) < kOrientedSpeed) {
      angle_ = wrapped_turn(params_.orient_angle);
      speed_ = 0;
      cycle.oriented = true;
    }
  }
  cycle.angle = angle_;
  cycle.speed = speed_;
  cycle.at_speed = mode == SpindleMode::orient ? cycle.oriented : speed_ == target;
  return cycle;
}

}  // namespace vcnc
