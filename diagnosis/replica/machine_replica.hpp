// The replica of a whole machine: every axis by its drive, the probe by its sensor, on the commands
// of a record.
//
// A hypothesis may say what is otherwise than declared in both ways: as a deviation, or by another
// number outside [effects], which then is what the bodies are like and not what the controllers
// know (as_hypothesis).
//
// An axis that the record has no command of is taken to be where it was measured, or to stand where
// the declared machine starts. Where its twist or force was recorded (and no reading of a probe),
// an ideal drive moves it to where it was measured (CommandedMotion::followed): what its loops are
// like is not seen then, and no position is compared. Records at another rate than the bus cycle
// are brought to 1 ms by the spline of the commands and back by straight lines.
//
// Of a twist that is counted from anywhere the mean is taken from the record.
//
// The velocity of a motor is the slope of its position over two cycles, as late as the record has
// it (late_velocity.hpp). It is compared where no position tells of the motor: that of the loop is
// the load's, or there is none; else it would be the same encoder twice.
//
// What has been computed is kept and found again by what it depends on: changing something of X
// does not simulate Y, changing the probe simulates no axis, and what only displaces the tool
// centre does not simulate the drive. The results are the same as without. Several machines at a
// time have the variants of their axes stepped side by side, to the same bits.
//
// Axes are always simulated in full. The probe is, for one machine, the anchor: the declared one
// until another is chosen. Of any other machine only the difference from the anchor is computed, in
// steps of 1 ms (probe_replay.hpp): first of the true deflection, then of what is read of it,
// value = full(anchor) + quick(machine) - quick(anchor). Poses are those on the anchor's axes,
// moved along with the axes to first order. So it is exact at the anchor, and the nearer the
// better. What cannot be had quickly is computed in full.
//
// A bar that stays in a plane is held to be set up in it, and so is a sensor that does not tell
// what is across (a grid): what shifts or tilts them out of that, they show by its square alone,
// and a fit by sensitivities would go astray.
//
// Errors of the signals repeat with every few micrometres of deflection, and where the ball is, the
// model may not know to one. They are therefore taken where the record says it was: moved by what
// the record is off the anchor's reading, as a mean over 10 ms before and after.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/axis_replay.hpp"
#include "diagnosis/replica/probe_replay.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc {

class MachineReplica : public Replica {
 public:
  /// Predicts the channels that `record` has and that its commands say something of. Throws
  /// std::invalid_argument where the piece cannot be built or nothing moves: less than two samples.
  MachineReplica(const Record& record, const Machine& declared,
                 const std::optional<PieceParams>& piece);
  ~MachineReplica() override;

  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& hypothesis) const override;
  /// Axes of several machines are stepped side by side.
  std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses) const override;
  /// The same with the probe in full, too, and without the memory of earlier predictions.
  Prediction predict_in_full(const Machine& hypothesis) const;

  std::vector<std::vector<double>> rounding(const Machine& machine) const override;

  std::vector<SeriesOfChannels> of_unknown_forces() const override;

  /// What follows is asked about machines near this one. Not while others predict.
  bool anchor(const Machine& machine) override;

  /// Every machine has these forces on the loads of its axes besides, one per sample of the record
  /// [N or N m]; empty: none. They are known to 5 %, as the friction of another day is. Not while
  /// others predict.
  void apply(const PerAxis<std::vector<double>>& unknown);

 private:
  /// Results by fingerprint, the least recently used ones forgotten.
  template <class T>
  class Memory;

  struct Hypothesis;
  struct Anchor;
  enum class Encoders { exact, rounding };
  Hypothesis hypothesis_of(const Machine& machine, Encoders encoders = Encoders::exact) const;
  AxisReplays axes_of(const Hypothesis& hypothesis) const;
  std::shared_ptr<const Poses> poses_of(const Hypothesis& hypothesis) const;
  std::shared_ptr<const Deflections> ball_of(const Hypothesis& hypothesis,
                                             const AxisReplays& axes) const;
  Deflections reading_of(const Hypothesis& hypothesis, const AxisReplays& axes) const;
  AxisReplay replayed(const Hypothesis& hypothesis, std::size_t axis) const;
  void sample_as_recorded(AxisReplay& replay, std::size_t axis) const;
  Prediction predict(const Hypothesis& hypothesis, const AxisReplays& axes) const;
  void hold_against(const OnTable& it, const Record& record);
  void forget_loops_of_followed(Machine& machine) const;
  bool knows_forces() const;  ///< of some axis, by apply()
  Prediction assembled(const AxisReplays& axes, const Deflections& reading) const;
  Deflections off_record(const Deflections& reading) const;
  std::vector<double> motor_velocity(const AxisReplay& replay, std::size_t axis) const;
  std::vector<double> as_recorded(const std::vector<double>& per_cycle, double late = 0) const;

  Machine declared_;
  double period_;
  std::size_t samples_;
  std::vector<ComparedChannel> channels_;
  PerAxis<std::optional<double>> late_velocity_;  ///< of those compared, after the position [s]
  PerAxis<std::optional<std::vector<double>>> relative_twist_;  ///< as measured
  bool probes_ = false;                                         ///< some channel is a reading
  CommandedMotion motion_;                                      ///< at 1 ms
  std::vector<char> known_;                                     ///< at the record's rate
  Deflections measured_;  ///< at 1 ms; empty where not recorded
  std::unique_ptr<Piece> piece_;
  Counterpart against_;
  Vec3 across_ = Vec3::Zero();  ///< unit normal of the plane that is not left; zero: none
  PerAxis<std::unique_ptr<Memory<AxisReplay>>> axis_memory_;
  PerAxis<std::unique_ptr<Memory<WatchedReplay>>> watched_;
  std::unique_ptr<Memory<Poses>> pose_memory_;  ///< on the anchor's axes
  std::unique_ptr<Memory<Deflections>> ball_memory_;
  std::string anchored_;                  ///< fingerprint of the machine of the anchor
  std::unique_ptr<const Anchor> anchor_;  ///< null where nothing is probed
};

}  // namespace vcnc
