#include "diagnosis/records/any_record.hpp"

#include <filesystem>

#include "analysis/hdf5_columns.hpp"
#include "analysis/recording.hpp"
#include "configs/config.hpp"
#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/import_table.hpp"
#include "diagnosis/records/record_check.hpp"
#include "diagnosis/records/record_file.hpp"
#include "diagnosis/records/record_from_recording.hpp"
#include "model/axes.hpp"
#include "model/fingerprint.hpp"

namespace vcnc {

namespace {

/// Of two encoders that of the loop became the position when the table was imported.
void check_loops(const Record& record, const Machine& machine) {
  if (record.machine_toml.empty()) return;
  const Machine imported = parse_machine(record.machine_toml, record.source);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (imported.axes[axis].servo.feedback == machine.axes[axis].servo.feedback ||
        !record.find(SignalKind::position, axis) || !record.find(SignalKind::twist, axis) ||
        is_followed(record, axis))
      continue;
    throw MeasurementError(
        record.source + ": was imported for a machine whose loop of " +
        std::string(kAxisNames[axis]) +
        " is closed with the other side of its transmission (axes." +
        std::string(kAxisNames[axis]) +
        ".feedback) than that of this model; import it again with a map that names this one");
  }
}

/// An import may have known no machine, or another one.
Record checked_record(const std::string& path, const std::string& model) {
  Record record = read_record(path);
  if (model.empty()) return record;
  const Machine machine = load_machine(model);
  check_loops(record, machine);
  check_against(record, machine);
  return record;
}

}  // namespace

Record load_record(const std::string& path, const std::string& map, const std::string& model) {
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(path, ignored);
  if (!map.empty() && !folder && !is_record_file(path)) return import_files(path, map, model);
  if (!folder && !std::filesystem::exists(path, ignored))
    throw MeasurementError(path + ": no such file or folder");
  if (!folder && !looks_like_hdf5(path))
    throw MeasurementError(path +
                           ": is neither a run's folder, a recording nor an imported record; a "
                           "table needs --map MAP.toml, which says what its columns are");
  if (!folder && is_record_file(path)) return checked_record(path, model);
  try {
    return record_from(RecordingReader(path));
  } catch (const RecordingError& e) {
    throw MeasurementError(e.what());
  }
}

Machine declared_machine(const std::string& model, const Record& record) {
  if (!model.empty()) {
    const Machine machine = load_machine(model);
    if (!record.machine_toml.empty() &&
        parse_machine(record.machine_toml, record.source).kinematics.type !=
            machine.kinematics.type)
      throw MeasurementError(record.source + ": was measured on a machine of another type than " +
                             model +
                             " (kinematics.type); if that is wrong, import the table with a map "
                             "whose `machine` is of this type");
    return machine;
  }
  if (record.machine_toml.empty())
    throw MeasurementError(record.source +
                           ": does not say on which machine it was measured; --model MACHINE.toml "
                           "is needed");
  return parse_machine(record.machine_toml, record.source);
}

void check_same_kinematics(const Record& run, const Record& other) {
  if (run.machine_toml.empty() || other.machine_toml.empty()) return;
  const auto kinematics = [](const Record& record) {
    Fingerprint print;
    Machine machine = parse_machine(record.machine_toml, record.source);
    KinematicsParams::fields(machine.kinematics, print);
    return print.bytes();
  };
  if (kinematics(run) != kinematics(other))
    throw MeasurementError(other.source + ": was measured on a machine of other kinematics than " +
                           run.source);
}

std::optional<PieceParams> piece_of(const Machine& machine, const Record& record) {
  if (!record.piece_toml.empty()) return parse_piece(record.piece_toml, record.source);
  if (machine.setup.piece.empty()) return std::nullopt;
  return load_piece(machine.setup.piece);
}

}  // namespace vcnc
