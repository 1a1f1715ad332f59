// Strokes of one axis, at different speeds and with rests, in four laps.
#pragma once

#include <array>
#include <random>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "model/machine.hpp"

namespace vcnc::stroke_run {

inline constexpr std::size_t kLaps = 4, kLapCycles = 3000;

/// Where X is told to be within a lap [m]: four strokes at different speeds with rests.
inline double commanded(std::size_t k) {
  struct Stroke {
    double to;
    std::size_t cycles;
  };
  static constexpr std::array<Stroke, 4> strokes{
      {{0.05, 700}, {-0.03, 900}, {-0.02, 500}, {0, 400}}};
  constexpr std::size_t kRest = 120;
  double from = 0;
  for (const Stroke& s : strokes) {
    if (k < s.cycles) {
      const double u = static_cast<double>(k) / static_cast<double>(s.cycles);
      return from + (s.to - from) * u * u * u * (10 + u * (6 * u - 15));
    }
    from = s.to;
    if (k < s.cycles + kRest) return from;
    k -= s.cycles + kRest;
  }
  return from;
}

inline Machine declared() {
  Machine machine;
  machine.effects.axis[kX].get<Coulomb>().level = 100;
  return machine;
}

inline MeasuredSignal signal_of_x(SignalKind kind, std::vector<double> value) {
  MeasuredSignal signal;
  signal.kind = kind;
  signal.axis = kX;
  signal.value = std::move(value);
  return signal;
}

/// What X of a machine records in some laps.
inline Record recorded(const Machine& machine, unsigned seed, bool with_force = true) {
  Record record;
  record.source = "record";
  MeasuredSignal command = signal_of_x(SignalKind::command, {});
  for (std::size_t lap = 0; lap < kLaps; ++lap) {
    const std::size_t begin = command.value.size();
    for (std::size_t k = 0; k < kLapCycles; ++k) command.value.push_back(commanded(k));
    record.stretches.push_back(
        {begin, command.value.size(), 0, static_cast<int>(lap), "to and fro"});
  }
  const std::vector<double> nothing(command.value.size(), 0.0);
  record.signals = {command, signal_of_x(SignalKind::position, nothing)};
  if (with_force) record.signals.push_back(signal_of_x(SignalKind::force, nothing));
  const MachineReplica replica(record, machine, std::nullopt);
  const Prediction truth = replica.predict(machine);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> unit;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const ComparedChannel& of = replica.channels()[c];
    const double noise = of.kind == SignalKind::position ? 20e-9 : 5;  // [m], [N]
    for (MeasuredSignal& s : record.signals)
      if (s.kind == of.kind)
        for (std::size_t k = 0; k < s.value.size(); ++k)
          s.value[k] = truth[c][k] + noise * unit(random);
  }
  return record;
}

}  // namespace vcnc::stroke_run
