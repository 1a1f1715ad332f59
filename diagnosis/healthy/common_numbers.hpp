// Numbers of the declared machine that are the same in a run and in the healthy run it is held
// against, and known in neither.
//
// What they do to both runs cancels as long as nothing has changed. What they make of a change does
// not: a suspension that lags by 0.5 ms lags what a fault moves the ball by, too. To first order a
// hypothesis m says of the run, once the healthy run is accounted for (differential.hpp),
//
//   yhat(m, theta) = yhat(m) + sum_j theta_j (d yhat/d theta_j (m) - d yhat/d theta_j (h))
//
// theta: less what is declared, h: the healthy machine. Such a number does nothing at h, and the
// more the further a hypothesis is from it. Derivatives are taken where the replica is exact
// (Replica::anchor()); numbers are never moved in a simulation, since where they belong may be out
// of what the model can do (a suspension without damping rings), and since the same number may have
// changed between the runs, too.
//
//   damping of the probe's suspension          50 %
//   lag of the current loop                    30 %
//   lag of the position loop                   0.5 ms, half a cycle of 1 ms
//   lag of the measured velocity               0.5 ms
//   stiffness of pre-sliding                   50 %: other laws than one bristle turn over slower
//   compliance of a transmission               10 %, as a builder reckons it
//   all, where the machine was commissioned    a fifth of that
#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// With their tolerances; those that are zero are not among them.
std::vector<FreedNumber> common_numbers(const Machine& healthy);
/// Whether the number of a machine file with this key is among them.
bool is_common(const std::vector<FreedNumber>& common, const std::string& key);
/// The machine itself, without what goes along with it.
Machine without_common(Machine hypothesis);

class ReplicaOfChange final : public Replica {
 public:
  /// `replica` must outlive this; it is exact at the healthy machine from now on.
  ReplicaOfChange(Replica& replica, const Machine& healthy, std::vector<FreedNumber> common);

  const std::vector<ComparedChannel>& channels() const override { return replica_.channels(); }
  Prediction predict(const Machine& hypothesis) const override;
  std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses) const override;
  std::vector<std::vector<double>> rounding(const Machine& machine) const override {
    return replica_.rounding(without_common(machine));
  }
  std::vector<SeriesOfChannels> of_unknown_forces() const override {
    return replica_.of_unknown_forces();
  }
  bool anchor(const Machine& machine) override;

 private:
  /// What a prediction became, so that those that share a series still do afterwards.
  struct Corrected {
    SharedSeries from;
    std::vector<double> off;
    SharedSeries to;
  };

  std::vector<double> off_healthy(const Machine& hypothesis) const;
  /// Changes of the predictions per unit of some numbers, about a machine.
  std::vector<SeriesOfChannels> derivatives(const Machine& about,
                                            const std::vector<std::size_t>& numbers) const;
  void derive(const std::vector<double>& off) const;
  SharedSeries corrected(const SharedSeries& series, std::size_t channel,
                         const std::vector<double>& off) const;

  Replica& replica_;
  std::vector<FreedNumber> common_;
  Machine anchor_;
  std::vector<SeriesOfChannels> at_healthy_;  ///< d yhat / d theta_j
  mutable std::mutex guard_;
  mutable std::vector<SeriesOfChannels>
      of_change_;  ///< there less here; no channels: not yet known
  mutable std::vector<Corrected> latest_;
};

}  // namespace vcnc
