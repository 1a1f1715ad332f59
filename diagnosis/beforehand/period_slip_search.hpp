// Finds a slip of the period counter, which is a whole number and so no matter of a fit: from one
// sample to the next a reading is off by n signal periods, and stays so.
//
// Sought in what is measured less what the declared machine predicts, in all samples, those between
// laps included. A step counts if it is within 15 % of a whole number of periods, over one sample
// and between the means of five before and after it, if these hardly move among themselves (a ball
// that rings or turns over does), if no other channel takes part, if what follows is nearer to
// nothing without it, and laps after it to those of the same condition before, and if it is the
// only one: slips that come and go are no slips.
#pragma once

#include <optional>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/effects/period_slip.hpp"

namespace vcnc {

/// `period`: of the signal [m]; `predicted`: by the declared machine.
std::optional<PeriodSlip> find_period_slip(const Record& record,
                                           const std::vector<ComparedChannel>& channels,
                                           const Prediction& predicted, double period);

}  // namespace vcnc
