// Plays a program on the whole machine in this process and keeps every row.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/evaluation.hpp"
#include "apps/nc_run.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/inproc.hpp"
#include "bus/messages.hpp"
#include "configs/config.hpp"
#include "model/geometry/piece.hpp"
#include "tests/sanitized.hpp"
#include "tests/scratch.hpp"

namespace vcnc {

struct Outcome {
  NcRunResult nc;
  Summary summary;
  std::vector<TelemetryRow> rows;
  std::vector<ErrorSample> errors;  ///< one per row
};

/// Evaluates rows as they come and keeps them.
class Keeper : public TelemetrySink {
 public:
  void begin(const RunBegin& begin) override { evaluation_.emplace(begin); }
  void row(const TelemetryRow& row) override {
    outcome.rows.push_back(row);
    outcome.errors.push_back(evaluation_->row(row).error);
  }
  void alarm(const Alarm& alarm) override { evaluation_->alarm(alarm); }
  void end(const RunEnd& end) override { outcome.summary = evaluation_->finish(end); }

  Outcome outcome;

 private:
  std::optional<Evaluation> evaluation_;
};

inline std::string configs(const std::string& file) {
  return std::string(VCNC_SOURCE_DIR) + "/configs/" + file;
}

inline std::unique_ptr<PieceParams> piece_params(const Machine& machine) {
  return machine.setup.piece.empty()
             ? nullptr
             : std::make_unique<PieceParams>(load_piece(machine.setup.piece));
}

inline Outcome play(const Machine& machine, const std::string& program, std::uint64_t seed = 1) {
  const TemporaryFile file("program.ngc", program);
  const auto piece = piece_params(machine);
  VirtualMachine modules(machine, piece.get(), seed);
  InprocTransport transport(modules.nodes());
  Keeper keeper;
  NcRunOptions options;
  options.program = file.path();
  options.seed = seed;
  options.piece_toml = piece ? to_toml(*piece) : "";
  keeper.outcome.nc = run_nc(machine, options, transport, keeper);
  return std::move(keeper.outcome);
}

}  // namespace vcnc
