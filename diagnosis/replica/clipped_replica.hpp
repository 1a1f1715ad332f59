// A probe that clips hides what the model gets wrong, too.
//
// In a difference (healthy/differential.hpp) what the healthy run is off its machine, e, is taken
// off every reading. It acts before the end of the scale, L, does: of a hypothesis that reads u
// without an end of the scale the difference is
//
//   clip(u + e, L) - e      not  clip(u, L)
//
// Valid where the healthy machine has no end of the scale, and what follows it in the probe
// (latency, offsets) is small.
#pragma once

#include <mutex>
#include <vector>

#include "diagnosis/replica/replica.hpp"

namespace vcnc {

class ClippedReplica final : public Replica {
 public:
  /// `replica` must outlive this. `taken_off`: e of every channel; empty, or NaN: nothing.
  ClippedReplica(Replica& replica, SeriesOfChannels taken_off)
      : replica_(replica), taken_off_(std::move(taken_off)) {}

  const std::vector<ComparedChannel>& channels() const override { return replica_.channels(); }
  Prediction predict(const Machine& hypothesis) const override;
  std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses) const override;
  std::vector<std::vector<double>> rounding(const Machine& machine) const override {
    return replica_.rounding(machine);
  }
  std::vector<SeriesOfChannels> of_unknown_forces() const override {
    return replica_.of_unknown_forces();
  }
  bool anchor(const Machine& machine) override { return replica_.anchor(machine); }

 private:
  /// What a reading became, so that predictions that share one still do afterwards.
  struct Clipped {
    SharedSeries with, without;
    double limit;
    SharedSeries result;
  };

  SharedSeries clipped(const SharedSeries& with, const SharedSeries& without, std::size_t channel,
                       double limit) const;

  Replica& replica_;
  SeriesOfChannels taken_off_;
  mutable std::mutex guard_;
  mutable std::vector<Clipped> latest_;
};

}  // namespace vcnc
