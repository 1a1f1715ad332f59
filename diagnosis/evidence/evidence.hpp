// Residuals and sensitivities of hypotheses in whitened form, and what sums of squares they have.
//
//   z(theta) = W (y - yhat(theta)),   J = W d yhat / d theta
//
// with W the whitening of every channel (noise_audit.hpp). All that fitting, choosing and judging
// needs are products of such columns, kept per block of the partition: from them come chi-square on
// fitted and held-out laps, normal equations, gains per condition and resampled laps.
// Shifts of the piece from lap to lap, as large as the rounding of encoders makes them, are
// whitened in addition (lap_shifts.hpp), and so is what forces do that only a healthy run tells of.
//
// Only samples that can be compared count (comparable.hpp), none outside every stretch, not what an
// axis does in one lap and not in another (lap_events.hpp), and not moments at which the rounding
// of an encoder decides what an axis does (whether friction holds it here or a little further).
// Where no signal of a drive is recorded, readings weigh little where their deviation goes over
// from one state to another (turning_weight.hpp).
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "diagnosis/evidence/column.hpp"
#include "diagnosis/evidence/gathering.hpp"
#include "diagnosis/evidence/lap_events.hpp"
#include "diagnosis/evidence/lap_shifts.hpp"
#include "diagnosis/evidence/noise_audit.hpp"
#include "diagnosis/evidence/partition.hpp"
#include "diagnosis/evidence/recent_products.hpp"
#include "diagnosis/evidence/role_grams.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

/// Products of columns, one matrix per block.
using BlockGrams = std::vector<Eigen::MatrixXd>;

enum class Role { fitted, held_out, both };

/// Thrown by a prediction that nobody waits for any more.
struct Stopped {};

/// Times that all is sought once more with less noise, what was found being none, where no laps
/// tell the noise.
inline constexpr int kNoiseRounds = 4;

class Evidence {
 public:
  /// `declared` says which samples can be compared at all, and gives the residual whose repetitions
  /// tell the noise; `noise_scale` is what its standard deviation grows by beyond what laps tell,
  /// `form` the RMS per channel that the model is known to leave [SI] and that counts as noise,
  /// too. Commands that are missing are bridged. `replica` must outlive this.
  Evidence(const Record& record, Replica& replica, const Machine& declared,
           std::vector<double> noise_scale = {}, const std::vector<double>& form = {});

  const Record& record() const { return record_; }
  const Replica& replica() const { return replica_; }
  const Partition& partition() const { return partition_; }
  const NoiseAudit& noise() const { return noise_; }
  /// RMS of the noise of a sample with that of the healthy run that was taken off [SI].
  double noise_left(std::size_t channel) const {
    return noise_scale(channel) * noise_.channels[channel].rms;
  }
  /// The same with what the model is known to leave and what its encoder rounds off.
  double reckoned_with(std::size_t channel) const {
    return std::hypot(noise_left(channel), channel < form_.size() ? form_[channel] : 0.0,
                      channel < rms_of_rounding_.size() ? rms_of_rounding_[channel] : 0.0);
  }
  /// What the declared machine would have measured.
  const Prediction& declared() const { return declared_; }
  /// What was left out for it: of the axis' own channels, and of the readings.
  const std::vector<LapEvent>& events() const { return events_; }

  /// Asked before every prediction from now on, by any thread; where it says yes, predictions throw
  /// Stopped. Nothing: none does. Not while others predict.
  void stop_when(std::function<bool()> stop) { stop_ = std::move(stop); }

  Prediction predict(const Machine& hypothesis) const;
  /// As many at a time as are worth it.
  static constexpr std::size_t kTogether = 32;
  std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses) const;
  /// Calls f(0) ... f(n - 1) at the same time; what they ask to be predicted is predicted together.
  template <class F>
  void each_together(std::size_t n, F&& f) const {
    gathering_.each(n, std::forward<F>(f));
  }
  /// See Replica::anchor().
  void anchor(const Machine& machine) { replica_.anchor(machine); }
  /// From now on what the drive of an axis records counts for nothing. Not after columns were made.
  void leave_out_drive(std::size_t axis);
  /// Whether encoders make more of the readings in this machine than of samples' noise, and clearly
  /// more than was reckoned with: a compliance shows with which force friction holds an axis that
  /// rests anywhere within a step of its encoder, another one in every lap.
  bool underrates_rounding(const Machine& machine) const;
  /// From now on noise is what encoders make of it in this machine; all drives count again. Not
  /// with columns made before.
  void reckon_with_rounding(const Machine& machine);
  /// From now on noise is what this machine leaves, where laps do not tell it. As above.
  void take_noise_from(const Machine& machine);
  /// Whether some signal clearly has another noise then.
  bool noise_is_another_with(const Machine& machine) const;
  /// W (y - yhat).
  Column residual(const Prediction& prediction) const;
  /// W (changed - base) / step.
  Column sensitivity(const Prediction& base, const Prediction& changed, double step) const;
  /// W d for a change of the prediction given as such; an empty channel does not change.
  Column whiten(const SeriesOfChannels& change) const;

  /// Part of the samples of a channel that say little, since something turns over there.
  double share_of_turning(std::size_t channel) const;
  /// Samples of a channel that count.
  double count(std::size_t channel, Role role) const;
  double count(Role role) const;
  /// Chi-square of a channel that laps of one condition differ by; none where nothing is repeated.
  double scatter(std::size_t channel, Role role) const;
  /// chi-square of one channel of a column.
  double chi2(const Column& column, std::size_t channel, Role role) const;
  double chi2(const Column& column, Role role) const;
  /// Of every channel.
  std::vector<double> chi2_of(const Column& column, Role role) const;
  /// Held-out chi-square of every channel that encoders make in a machine beyond what was reckoned
  /// with; empty where nothing is rounded.
  std::vector<double> rounding_beyond_reckoned(const Machine& machine) const;
  /// The same of what is reckoned with, and what the steps of the signals as recorded make.
  std::vector<double> rounding_reckoned() const;
  /// Held-out chi-square of every channel that the steps of its signal may make at most, where
  /// nothing but they can be told from a prediction: every sample is within half a step of it.
  std::vector<double> made_by_steps(const Prediction& prediction) const;
  /// The step of the signal as recorded [m, rad, N, N m]; 0: none is known.
  double step_of(std::size_t channel) const;
  /// RMS of y - yhat in SI over the samples that count.
  double rms(const Prediction& prediction, std::size_t channel, Role role) const;

  /// Of every channel, as samples weigh, less what shifts of the piece, other ones in every lap,
  /// make of the readings; where motions were repeated, of those alone.
  std::vector<double> rms_within_laps(const Prediction& prediction, Role role) const;
  /// The same of what was run once beside motions that were repeated, shifts included; nought where
  /// nothing was.
  std::vector<double> rms_run_once(const Prediction& prediction) const;

  /// Products of all pairs of the columns, per block.
  BlockGrams grams(const std::vector<const Column*>& columns) const;
  Eigen::MatrixXd sum(const BlockGrams& grams, Role role) const;
  /// The same, summed over the blocks of each role.
  RoleGrams products(const std::vector<const Column*>& columns) const;
  /// Products of every `a` with every `b`, summed over the blocks of each role.
  RoleGrams cross(const std::vector<const Column*>& a, const std::vector<const Column*>& b) const;

 private:
  double noise_scale(std::size_t channel) const {
    return channel < noise_scale_.size() ? noise_scale_[channel] : 1;
  }
  bool takes(const RecordBlock& block, Role role) const {
    return role == Role::both || block.held_out == (role == Role::held_out);
  }
  std::vector<float> whiten(std::size_t channel, const std::vector<double>& series) const;
  /// Sample by sample, whatever laps are shifted by.
  Column::Channels whitened(const SeriesOfChannels& change) const;
  /// Of what can be compared of a channel.
  /// What is measured less a prediction, in the blocks of motions that were run once, or in others.
  SeriesOfChannels off_in_blocks(const Prediction& prediction, bool once) const;
  double rms_of(const std::vector<double>& series, std::size_t channel, Role role,
                const std::vector<float>& weight = {}) const;
  /// Of the variance of a channel's noise: what the steps of the signal as recorded make, 0 .. 1.
  double share_of_steps(std::size_t channel) const;
  bool is_within_steps(const Prediction& prediction, std::size_t channel) const;
  bool keep_comparable(std::size_t channel, std::vector<double>& change) const;
  /// What these machines make of the readings of the probe, of what each is shifted by [m]; empty
  /// where there are none.
  std::vector<SeriesOfChannels> readings_per_shift(const std::vector<Machine>& shifted) const;
  SeriesOfChannels rounding_of(const Machine& machine) const;
  /// y - yhat where it can be compared.
  SeriesOfChannels left_by(const Machine& machine) const;
  void leave_out(const std::vector<LapEvent>& events);
  void leave_out_undecided(const SeriesOfChannels& rounding);
  void count_valid();
  /// False: the signals of drives tell how axes turn (turning_weight.hpp).
  bool weigh_turning();
  /// What of a series is noise where nothing turns over.
  NoiseAudit audited(SeriesOfChannels series, const SeriesOfChannels& rounding,
                     Coloured coloured) const;
  /// Of a standard deviation of each shift of the piece.
  std::vector<Column::Channels> whitened_shifts(const Eigen::Vector3d& shift) const;
  /// Says nothing of samples that cannot be compared.
  void mask(SeriesOfChannels& series) const;
  template <class Add>
  RoleGrams summed(const std::vector<const Column*>& a, const std::vector<const Column*>& b,
                   const Add& add) const;

  const Record record_;
  Replica& replica_;
  mutable Gathering gathering_;
  std::function<bool()> stop_;
  mutable RecentProducts recent_;
  Partition partition_;
  SeriesOfChannels measured_;
  Prediction declared_;
  std::vector<std::vector<char>> raw_valid_, valid_;
  std::vector<std::vector<float>> weight_;             ///< of every sample; a channel without: 1
  std::vector<double> fitted_count_, held_out_count_;  ///< of valid_ as they weigh, per channel
  std::vector<LapEvent> events_;
  SeriesOfChannels difference_;              ///< from the declared machine, without drifts
  std::vector<SeriesOfChannels> per_shift_;  ///< of the piece; empty without a probe
  std::vector<SeriesOfChannels> of_forces_;  ///< Replica::of_unknown_forces()
  /// Of standard deviations, per channel; empty: 1.
  std::vector<double> noise_scale_;
  std::vector<double> form_;
  Coloured coloured_ = Coloured::deviation;
  NoiseAudit noise_;
  std::vector<Column::Channels> shifts_;  ///< whitened, of what laps are shifted by
  ShiftWhitening of_shifts_;              ///< by these
  /// What is reckoned with of the rounding of each channel: RMS, and held-out chi-square.
  std::vector<double> rms_of_rounding_, chi2_of_rounding_;
};

}  // namespace vcnc
