// A short run of the whole machine as a record: for tests of what is predicted from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/experiments.hpp"
#include "configs/config.hpp"
#include "diagnosis/records/record_from_recording.hpp"
#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {

struct RecordedRun {
  Record record;
  Machine declared;  ///< what the diagnosis knows
  Machine true_machine;
  std::optional<PieceParams> piece;

  MachineReplica replica() const { return MachineReplica(record, declared, piece); }
};

/// The experiment on its machine with `effects`.
inline RecordedRun recorded_run(Experiment e, const Effects& effects) {
  RecordedRun run{{}, e.machine, e.machine, e.piece};
  run.true_machine.effects = e.machine.effects = effects;
  const Observation seen = observe(e);
  RunBegin begin;
  begin.run_id = "test";
  begin.declared_toml = to_toml(run.declared);
  if (e.piece) begin.piece_toml = to_toml(*e.piece);
  run.record = record_from(begin, seen.rows, seen.alarms);
  return run;
}
inline RecordedRun recorded_run(Showing showing, std::size_t axis, const Effects& effects,
                                const ExperimentOptions& options = {}) {
  return recorded_run(experiment(showing, axis, ideal_machine(), options), effects);
}

/// Difference of a prediction from what was recorded, over the channels of one kind.
struct Misfit {
  double rms = 0, largest = 0;
};
inline Misfit misfit(const RecordedRun& run, const MachineReplica& replica,
                     const Prediction& prediction, SignalKind kind, bool rotary = false) {
  Misfit result;
  double sum = 0, count = 0;
  for (std::size_t c = 0; c < prediction.size(); ++c) {
    const ComparedChannel& channel = replica.channels()[c];
    if (channel.kind != kind || is_rotary(channel.axis) != rotary) continue;
    const std::vector<double>& seen = run.record.find(kind, channel.axis)->value;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const double d = std::abs(prediction[c][k] - seen[k]);
      result.largest = std::max(result.largest, d);
      sum += d * d;
      ++count;
    }
  }
  if (count > 0) result.rms = std::sqrt(sum / count);
  return result;
}

}  // namespace vcnc
