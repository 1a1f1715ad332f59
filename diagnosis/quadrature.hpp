// A bare encoder or probe channel: what is wrong with its sine and cosine, without anything to
// compare its reading with.
//
// A sound pair of signals draws a circle. The library's effects on the signals make of it
//   u = R (f(phi) + p),   w = R ((1 + g)(cos a f(phi - pi/2) - sin a f(phi)) + q)
//   f = cos phi + h2 cos 2phi + h3 cos 3phi
// (signal_offset p, q; signal_gain g; signal_phase a; signal_harmonics h2, h3). The phase of a
// sample is unknown, so its distance to the curve along the normal is what is fitted
// (Gauss-Newton; orthogonal distance regression, Boggs and Rogers, Contemp. Math. 112 (1990) 183).
//
// The record is cut in 40 blocks. Effects are added one after the other while the held-out half of
// the blocks gains more than 25 in chi-square, corrected for the residual's correlation in time.
// The intervals of 95 % come from the scatter of the blocks' gradients (sandwich covariance), not
// from the number of samples. Then the mean residual over the phase, learnt on one half, must
// explain nothing of the other: otherwise something repeats that these effects are not.
//
// Before that, a few samples far off all others are left out, and an amplitude that changes slowly
// along the record is taken out: by straight lines between the means of the distance over parts of
// eight periods and more.
//
// A channel whose sine and cosine were sampled at different times (quadrature_lag.hpp) is told and
// left out.
//
// What moves samples along the curve only cannot be seen: a fifth harmonic (cos 5phi, sin 5phi) has
// the distance cos 4phi of a third one.
#pragma once

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/records/record.hpp"
#include "model/probe/heydemann.hpp"

namespace vcnc {

/// The curve of one channel.
struct SignalCurve {
  double amplitude = 0.5;  ///< R, in the unit of the signals
  double cosine_offset = 0, sine_offset = 0, gain = 0, angle = 0, second = 0, third = 0;

  /// Cosine and sine at phase phi.
  SinCos at(double phi) const;
};

/// Whether the record has a channel of sine and cosine and nothing that needs a machine to drive.
bool is_bare_encoder(const Record& record);

/// The signals of all channels of the record that have a sine and a cosine. `declared` gives the
/// signal period.
Diagnosis diagnose_quadrature(const Record& record, const Machine& declared);

}  // namespace vcnc
