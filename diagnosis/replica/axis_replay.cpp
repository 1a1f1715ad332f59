#include "diagnosis/replica/axis_replay.hpp"

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/effect_stage.hpp"
#include "diagnosis/replica/fingerprint.hpp"
#include "model/drive/axis_drive.hpp"
#include "model/probe/probe_sensor.hpp"

namespace vcnc {

static_assert(kTruthPerCycle == kDriveLoopSteps);

namespace {

constexpr std::uint64_t kSeed = 1;  // of noise that a replica does not have

/// An axis of which no command is known: it is where it was measured.
AxisReplay as_measured(const std::vector<double>& position, std::size_t cycles, double start) {
  AxisReplay replay;
  replay.measured = replay.twist = replay.force = std::vector<double>(cycles, kMissing);
  replay.truth.resize(cycles * kTruthPerCycle, start);
  if (position.empty()) return replay;
  for (std::size_t k = 0; k < cycles; ++k) {
    const double from = position[k > 0 ? k - 1 : 0], way = position[k] - from;
    for (std::size_t j = 0; j < kTruthPerCycle; ++j)
      replay.truth[k * kTruthPerCycle + j] =
          from + way * static_cast<double>(j + 1) / static_cast<double>(kTruthPerCycle);
  }
  return replay;
}

}  // namespace

AxisReplay replay_axis(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                       const CommandedMotion& motion) {
  const std::size_t cycles = motion.known.size();
  if (motion.told[axis] != CommandedMotion::Told::command)
    return as_measured(motion.position[axis], cycles, actual.axes[axis].limits.start);
  AxisReplay replay;
  std::vector<double> measured(cycles), twist(cycles), force(cycles);
  replay.truth.resize(cycles * kTruthPerCycle, start_position(actual, kSeed)[axis]);
  AxisDrive drive(hypothesis, axis, kSeed);
  const double full_force = hypothesis.axes[axis].mechanics.force_limit;
  const AxisVector start = motion.start([&] {
    AxisVector q;
    for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = actual.axes[i].limits.start;
    return q;
  }());
  measured[0] = start[axis];
  for (std::size_t k = 1; k < cycles; ++k) {
    AxisVector position = start, velocity{};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (motion.position[i].empty()) continue;
      position[i] = motion.position[i][k];
      velocity[i] = motion.velocity[i][k];
    }
    drive.tell_commands(position, velocity);
    const AxisCycle cycle = drive.follow({position[axis], velocity[axis]});
    measured[k] = cycle.measured;
    twist[k] = cycle.second;
    force[k] = cycle.force * full_force;
    std::copy(cycle.truth.begin(), cycle.truth.end(),
              replay.truth.begin() + static_cast<std::ptrdiff_t>(k * kTruthPerCycle));
  }
  replay.measured = std::move(measured);
  replay.twist = std::move(twist);
  replay.force = std::move(force);
  return replay;
}

std::string fingerprint_of_axis(const Machine& hypothesis, const Machine& actual,
                                std::size_t axis) {
  Fingerprint print;
  const bool rotary = is_rotary(axis);
  AxisParams::fields(hypothesis.axes[axis], print, rotary);
  AxisParams::fields(actual.axes[axis], print, rotary);
  for_each_effect_of(actual.effects, [&]<class Effect>(const Effect& effect, std::size_t of) {
    if (of != axis || stage_of<typename Effect::Port>() != EffectStage::drive || effect.null())
      return;
    for (const char c : Effect::text.name) print.add(c);
    if constexpr (Effect::place == Place::axis)
      Effect::fields(effect, print, rotary);
    else
      Effect::fields(effect, print);
  });
  for (const Law& law : actual.effects.laws)
    if (law.axis_index() == axis && law.point != Law::Point::reading) Law::fields(law, print);
  return print.bytes();
}

}  // namespace vcnc
