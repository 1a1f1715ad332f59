#include "diagnosis/replica/axis_replay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/effect_stage.hpp"
#include "model/effects/numbers.hpp"

namespace vcnc::axis_replay_test {
namespace {

constexpr std::size_t kMove = 400, kStand = 2500;  // cycles

/// To and fro with long rests, in samples of 1 ms; all other axes go on meanwhile.
CommandedMotion to_and_fro(std::size_t axis, double way) {
  CommandedMotion motion;
  for (std::size_t i = 0; i < kAxisCount; ++i) motion.told[i] = CommandedMotion::Told::command;
  const std::size_t cycles = 4 * (kMove + kStand);
  motion.known.assign(cycles, 1);
  for (std::size_t k = 0; k < cycles; ++k) {
    const std::size_t part = k / (kMove + kStand);
    const double s =
        std::min(1.0, static_cast<double>(k % (kMove + kStand)) / static_cast<double>(kMove));
    const double share = (1 - std::cos(kPi * s)) / 2, speed = kPi * std::sin(kPi * s) / 2 / 0.4;
    const bool back = part % 2 == 1;
    motion.position[axis].push_back(way * (back ? 1 - share : share));
    motion.velocity[axis].push_back(s < 1 ? way * (back ? -speed : speed) : 0);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (i == axis) continue;
      const double angle = 2 * kPi * static_cast<double>(k) * 1e-3;
      motion.position[i].push_back(0.01 * std::sin(angle));
      motion.velocity[i].push_back(0.01 * 2 * kPi * std::cos(angle));
    }
  }
  return motion;
}

/// An axis that never rests, against one that is not simulated while it does.
void expect_same(const Effects& effects, std::size_t axis, const std::string& name) {
  Machine declared;
  declared.effects = effects;
  declared.effects.axis[axis].get<Coulomb>() = Coulomb::nominal(is_rotary(axis));
  const Machine machine = as_hypothesis(declared, declared), bodies = actual(machine);
  const CommandedMotion motion = to_and_fro(axis, is_rotary(axis) ? 0.3 : 0.02);
  const AxisReplay replay = replay_axis(machine, bodies, axis, motion);
  AxisDrive drive(machine, axis, 1);
  double off = 0, off_force = 0;
  for (std::size_t k = 1; k < motion.known.size(); ++k) {
    AxisVector position, velocity;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      position[i] = motion.position[i][k];
      velocity[i] = motion.velocity[i][k];
    }
    drive.tell_commands(position, velocity);
    const AxisCycle cycle = drive.follow({position[axis], velocity[axis]});
    off = std::max({off, std::abs(cycle.measured - replay.measured[k]),
                    std::abs(cycle.second - replay.twist[k]),
                    std::abs(cycle.truth.back() - *replay.end_of(k))});
    off_force = std::max(
        off_force,
        std::abs(cycle.force - replay.force[k] / machine.axes[axis].mechanics.force_limit));
  }
  // Rounding says in which direction an axis rests, and so with which dry friction it sets off.
  const bool by_direction = name.ends_with("friction_asymmetry");
  EXPECT_LT(off, by_direction ? 1e-7 : 1e-10) << name;  // [m or rad]
  EXPECT_LT(off_force, by_direction ? 1e-3 : 1e-6) << name;
}

TEST(AxisReplay, AnAxisAtRestStaysThereWithEveryEffect) {
  for (const std::size_t axis : {kX, kC})
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      if constexpr (of_axis(Effect::place)) {
        if (!fits(Effect::place, is_rotary(axis)) || is_chance<Effect>()) return;
        Effects effects;
        effects.axis[axis].get<Effect>() = nominal_of<Effect>(is_rotary(axis));
        expect_same(effects, axis,
                    std::string(kAxisNames[axis]) + "." + std::string(Effect::text.name));
      }
    });
}

TEST(AxisReplay, ALawOverTimeOrAnotherAxisActsWhileItStands) {
  Law law;
  law.axis = Law::OfAxis::X;
  law.point = Law::Point::table_force;
  law.value = {0, 0, 50, 50};  // [N], long the same, then at once another
  law.at = {0, 6, 6.01, 20};
  Effects of_time, of_y;
  of_time.laws.push_back(law);
  expect_same(of_time, kX, "time");
  law.over = Covariate::position;
  law.over_axis = Law::OfAxis::Y;
  law.at = {-0.02, 9e-3, 9.1e-3, 0.02};
  of_y.laws.push_back(law);
  expect_same(of_y, kX, "position of Y");
}

}  // namespace
}  // namespace vcnc::axis_replay_test
