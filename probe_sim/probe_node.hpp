// The scanning probe on the bus: contact physics, sin/cos signals, acquisition module.
//
// Cycle k: the true axis motion of cycle k-1 comes through the truth channel, ten samples of 100
// us, each of which the probe (model/probe/probe_sensor.hpp) turns into what its module counts. The
// last sample is the deflection at t_k and goes out as ProbeSample.
//
// An axis whose simulator is gone, motion and status alike, stays where it was last.
#pragma once

#include <array>
#include <memory>

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/truth.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"
#include "model/probe/contact.hpp"
#include "model/probe/probe_sensor.hpp"

namespace vcnc {

class ProbeNode : public Node {
 public:
  /// `piece` may be null: nothing to touch. `truth` outlives the node.
  ProbeNode(const Machine& machine, std::unique_ptr<Piece> piece, std::uint64_t seed,
            TruthPort& truth);

  int id() const override { return kProbeNode; }
  std::string_view name() const override { return "probe"; }
  /// The status of the drives, only to tell a drive that is gone from a failure of the host.
  bool accepts(std::uint16_t cob_id) const override {
    return cob_id > kStatusBase && cob_id <= kStatusBase + kAxisCount;
  }
  /// Throws TruthError when the simulators' own channel failed.
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  DeviceProfile profile() const override { return profile_; }
  void declare(ObjectDictionary& objects) override;
  /// wire_break, stuck_adc, saturated, slip
  void suffer(const BusFault& fault) override;

  /// For observers of a simulation, never for a part of the machine: the true deflections (probe
  /// frame) of the last cycle; number j belongs to t_k - (9 - j) 100 us.
  const std::array<Vec3, kLoopStepsPerCycle>& true_deflections() const { return felt_; }
  /// The same of the axes: where they truly are at t_k.
  const AxisVector& true_axes() const { return last_known_; }

 private:
  ProbeNode(const Machine& actual, std::unique_ptr<Piece> piece, std::uint64_t seed,
            TruthPort& truth, const ProbeParams& declared);
  void sample(std::size_t j, const AxisVector& q);
  ProbeSample reading(Tick k) const;
  void hold_missing(Tick k, std::span<const Frame> inputs,
                    std::array<TruthCycle, kTruthAxes>& truth) const;

  ProbeParams probe_;
  DeviceProfile profile_;
  UsableRange range_;
  std::unique_ptr<Piece> piece_;
  ProbeSensor sensor_;
  std::array<Vec3, kLoopStepsPerCycle> felt_;
  ProbeSample told_;  ///< last reading
  TruthPort& truth_;
  AxisVector start_, last_known_;
  std::array<ChannelFault, 3> broken_{};  ///< in this cycle
  std::array<int, 3> miscounted_{};       ///< periods, in this cycle
};

}  // namespace vcnc
