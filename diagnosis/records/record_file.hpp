// Records as files: HDF5, sealed like recordings (analysis/seal.hpp), readable by h5py as they are.
//
//   /signal_0, /signal_1, ...   double[samples], SI, NaN where a sample is missing; attributes kind
//                               ("position"), axis (0 .. 4), source, resolution
//   / attributes                format "vcnc-record", format_version, signals, source, period_s,
//                               begin_s, machine_toml, piece_toml; stretches (a line each: begin
//                               end condition repetition label), warnings (a line each); of what is
//                               on the table bar_length_m (0: a sensor), zero_x_m, zero_y_m,
//                               zero_z_m
#pragma once

#include <filesystem>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// The file appears complete or not at all. Throws MeasurementError.
void write_record(const Record& record, const std::filesystem::path& path);

/// Throws MeasurementError.
Record read_record(const std::filesystem::path& path);

/// Whether the file says it is a record, damaged or not.
bool is_record_file(const std::filesystem::path& path);

}  // namespace vcnc
