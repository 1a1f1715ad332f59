// The scanning probe as a whole: from where the axes truly are to what its acquisition module
// counts.
//
// Every 100 us: the tool's pose follows from the axes and the errors of the machine's bodies
// (PosePort), the stylus ball is moved on the piece (ProbeContact), the sensor feels its deflection
// (DeflectionPort), three channels are digitised (SignalChannel) and counted (ReadingPort).
//
// Shared by the simulated probe and by whoever asks what a probe would have said.
#pragma once

#include <array>
#include <cstdint>

#include "model/effects/chain.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"
#include "model/probe/contact.hpp"
#include "model/probe/signals.hpp"

namespace vcnc {

inline constexpr double kProbeSampleTime = 100e-6;  ///< [s]

class ProbeSensor {
 public:
  /// `actual` as it is, deviations applied; `piece` may be null (nothing to touch) and must outlive
  /// the sensor; `seed` of all noise.
  ProbeSensor(const Machine& actual, const Piece* piece, std::uint64_t seed);

  /// The next sample, 100 us after the last, with the axes truly at q.
  void sample(const AxisVector& q);

  /// What the three channels say of the last sample.
  const std::array<ChannelSample, 3>& channels() const { return last_; }
  /// The true deflection of the last sample, probe frame [m].
  const Vec3& deflection() const { return felt_; }
  /// The probe's own protection, a mechanical switch: it feels the true travel and force, whatever
  /// the scales count.
  bool overtravelled() const;

  void suffer(std::size_t channel, ChannelFault fault) { channels_[channel].suffer(fault); }
  void miscount(std::size_t channel, int periods) { channels_[channel].miscount(periods); }

 private:
  ToolPose pose(const AxisVector& q);
  void follow_motion(const AxisVector& q);

  ProbeParams probe_;
  Kinematics kinematics_;
  ProbeContact contact_;
  std::array<SignalChannel, 3> channels_;
  Chain<PosePort> errors_;
  Chain<DeflectionPort> feeling_;
  Chain<ReadingPort> counting_;
  std::array<ChannelSample, 3> last_;
  Vec3 felt_ = Vec3::Zero();
  std::int64_t samples_ = 0;
  PosePort::Context<double> motion_;  ///< of all axes, where an effect needs it
};

/// Where the axes of `actual` truly stand at switch-on: off their scales by what the drives will
/// say from the first cycle on, so that the probe does not see a jump.
AxisVector start_position(const Machine& actual, std::uint64_t seed);

}  // namespace vcnc
