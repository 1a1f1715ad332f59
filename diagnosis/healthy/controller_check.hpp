// What the controller of an axis says of its own gains, whatever friction is like.
//
// Of command x_c, position x, motor side x_m and force F a cascade makes
//
//   F = Kp (1 + 1 / (Ti s)) (Kv (x_c - x) + kff s x_c - s x_m)
//
// and so does a model of it. Of what the signals are off a model, e_x, e_m and e_F, a force on the
// axis that the model lacks makes nothing of
//
//   r = (Kv e_x + s e_m + s / (s + 1 / Ti) e_F / Kp) / (s + Kv)          [m or rad]
//
// but a gain does, or a delay of the command. Where an effect of a drive is true, what it makes of
// r is in the record: of r that is left with it, regressed on what it makes,
//
//   b = 1 + <r, d> / <d, d>
//
// is one; it is nought where it stands for a force whose law is another one than declared. The
// error of b is what stretches of the record differ by.
//
// Gains are the declared ones: that they are off by some percent is of second order. The sampled
// controller is the same with an endless Ti. Not valid for axes whose position, force or command
// is not recorded, and none is checked there; of an axis without twist e_m is e_x.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// b and its standard deviation.
struct Confirmation {
  double share = 1, deviation = 0;

  /// Whether the controller's own signals say that at least half of an effect is not there.
  bool contradicts() const { return share + 2 * deviation < 0.5; }
};

class ControllerCheck {
 public:
  ControllerCheck(const Record& record, const std::vector<ComparedChannel>& channels,
                  const Machine& declared);

  /// Of an effect on an axis: what the machine predicts without and with it. Nothing where the
  /// signals do not tell, or where what it makes of r is little beside what it makes of the
  /// position, as of every force.
  std::optional<Confirmation> of(std::size_t axis, const Prediction& without,
                                 const Prediction& with) const;

  /// r of a change of the channels, stretch by stretch; NaN where something is missing. Empty where
  /// the axis does not tell.
  std::vector<double> equation(std::size_t axis, const SeriesOfChannels& change) const;

 private:
  std::optional<std::size_t> channel(SignalKind kind, std::size_t axis) const;

  const Record& record_;
  std::vector<ComparedChannel> channels_;
  PerAxis<AxisParams> declared_;
};

}  // namespace vcnc
