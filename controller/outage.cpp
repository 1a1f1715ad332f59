#include "controller/outage.hpp"

namespace vcnc {

namespace {

constexpr Tick kOutageSettleCycles = 100;

}  // namespace

Outage::Outage(const Machine& machine, Player& player) : machine_(machine), player_(player) {}

void Outage::enter(Phase phase) {
  phase_ = phase;
  cycles_ = 0;
}

void Outage::begin() {
  player_.hold();
  enter(Phase::holding);
}

void Outage::go_on_from(const AxisVector& position) {
  held_ = player_.step();
  place_ = position;
  enter(Phase::spindle);
}

bool Outage::touches(const Vec3& deflection) const {
  return machine_.probe.in_spindle && deflection.norm() >= machine_.probe.min_deflection;
}

double Outage::spindle_seconds() const {
  switch (held_.spindle) {
    case PlayerStep::Spindle::off:
      return 0;
    case PlayerStep::Spindle::orient:
      return kOrientSeconds;
    default:
      return held_.spindle_speed / machine_.spindle.acceleration;
  }
}

PlayerStep Outage::step(const Situation& now) {
  ++cycles_;
  const double t = seconds(cycles_);
  if (phase_ == Phase::holding) {
    held_ = player_.step();
    place_ = held_.position;
    if (player_.held()) enter(Phase::settling);
    return held_;
  }
  if (phase_ == Phase::rising) {
    const PlayerStep step = player_.step();
    if (player_.at_full_rate()) enter(Phase::none);
    return step;
  }

  PlayerStep step = held_;
  step.feed = 0;
  step.velocity = {};
  const bool stopped = phase_ <= Phase::waiting;
  switch (phase_) {
    case Phase::settling:
      if (cycles_ < kOutageSettleCycles) break;
      if (touches(now.deflection)) {
        retract_.emplace(machine_, place_, now.deflection);
        enter(Phase::retracting);
      } else {
        enter(Phase::waiting);
      }
      break;
    case Phase::retracting:
      place_ = retract_->position(t);
      step.velocity = retract_->velocity(t);
      if (t >= retract_->duration()) enter(Phase::waiting);
      break;
    case Phase::waiting:
      if (now.go_on) enter(Phase::spindle);
      break;
    case Phase::spindle:
      if (now.failing) {
        enter(Phase::waiting);
      } else if (t >= spindle_seconds()) {
        return_.emplace(machine_, place_, held_.position);
        enter(Phase::returning);
      }
      break;
    case Phase::returning:
      place_ = return_->position(t);
      step.velocity = return_->velocity(t);
      if (t < return_->duration()) break;
      if (now.failing) {
        enter(Phase::settling);
      } else {
        player_.go_on();
        enter(Phase::rising);
      }
      break;
    default:
      break;
  }
  step.position = place_;
  if (stopped) step.spindle = PlayerStep::Spindle::off;
  return step;
}

}  // namespace vcnc
