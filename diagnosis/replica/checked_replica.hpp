// The replica of a record that can be what its map says, by all that the declared machine predicts.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {

/// With the piece that the record, else the machine, names. Throws MeasurementError where nothing
/// of the record can be predicted, or its readings cannot be those of this machine
/// (readings_check.hpp) or of their time (readings_time.hpp); what is only suspicious of the times
/// is added to `warnings`.
std::unique_ptr<MachineReplica> checked_replica(const Record& record, const Machine& declared,
                                                std::vector<std::string>& warnings);

}  // namespace vcnc
