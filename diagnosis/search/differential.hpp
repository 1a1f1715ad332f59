// A record less what a healthy run of the same program has besides its declared machine.
//
//   y := y_now - mean over laps of (y_ref - yhat_ref(declared))
//
// so that what the model gets wrong about the healthy machine cancels to first order. Laps are
// matched by condition; samples without a partner become missing. The noise of the reference stays
// in: variances grow by 1 + 1/n for n laps.
#pragma once

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

struct DifferentialRecord {
  Record record;
  double noise_scale = 1;  ///< of the standard deviation
};

DifferentialRecord less_healthy(const Record& now, const Record& healthy, const Replica& of_healthy,
                                const Machine& declared);

}  // namespace vcnc
