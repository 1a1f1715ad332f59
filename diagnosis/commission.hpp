// Fits a declared machine to a run of the machine when it was healthy.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// A declared machine fitted to a healthy run.
struct Commissioning {
  Machine machine;
  std::vector<FittedNumber> numbers;  ///< friction and what else was fitted
  std::vector<std::string> notes;     ///< which friction law each axis got, and why
  std::vector<SignalFigure> figures;
  std::vector<std::string> warnings;
};

/// Fits the lags of the loops by what the controllers make of their own signals
/// (controller_lags.hpp), declared numbers within their tolerances and, axis by axis, the simplest
/// friction law that does best on held-out data: none, dry and viscous, with break-away, with
/// pre-sliding, with both; then gains of its loops, feed-forwards and lags, the best first, where
/// held-out data ask for them and the controller's signals do not contradict, with another law of
/// friction where the first one imitates a gain so well that no way leads to that; then what hangs
/// on where the axis is (ripple and cogging, uneven screws and encoders, weight, springs, uneven
/// friction), the best first, what is a twentieth of what is left, after which friction and gains
/// are chosen anew; and of an axis whose transmission is elastic what part of its friction is
/// before that and what law the load has beside, where it is a fiftieth of what is left, all
/// numbers fitted at the same time; then all axes together, and what of the probe and the geometry
/// (friction of the ball, damping, gains, cross-talk, latency, squareness, where the rotary axes
/// lie) explains a twentieth of what is left; at last everything together. Where no motion is
/// repeated, all of it again with what that leaves as noise. Empty where it was stopped before the
/// end, which it is at any prediction. Throws MeasurementError where no axis moves.
Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options = {},
                         const KeepGoing& keep_going = {});

}  // namespace vcnc
