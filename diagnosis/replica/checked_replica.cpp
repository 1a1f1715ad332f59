#include "diagnosis/replica/checked_replica.hpp"

#include <optional>
#include <stdexcept>

#include "diagnosis/records/any_record.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/replica/readings_check.hpp"
#include "diagnosis/replica/readings_time.hpp"

namespace vcnc {

std::unique_ptr<MachineReplica> checked_replica(const Record& record, const Machine& declared,
                                                std::vector<std::string>& warnings) {
  const std::optional<PieceParams> piece = piece_of(declared, record);
  std::unique_ptr<MachineReplica> replica;
  try {
    replica = std::make_unique<MachineReplica>(record, declared, piece);
  } catch (const std::invalid_argument& e) {
    throw MeasurementError(record.source + ": " + e.what());
  }
  if (replica->channels().empty())
    throw MeasurementError(
        record.source +
        ": holds nothing that can be predicted: a position needs the command of its axis, a twist "
        "or force its command or position, a deflection those of all axes");
  check_readings(record, replica->channels(), replica->predict(declared));
  const std::vector<std::string> of_times = check_reading_times(record, declared, piece);
  warnings.insert(warnings.end(), of_times.begin(), of_times.end());
  return replica;
}

}  // namespace vcnc
