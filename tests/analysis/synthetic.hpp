// Telemetry of an imagined run, made from the declared kinematics and piece and known errors.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "bus/messages.hpp"
#include "bus/telemetry.hpp"
#include "configs/config.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc::synthetic {

inline PieceParams piece_params(const std::string& name) {
  return load_piece(std::string(VCNC_SOURCE_DIR) + "/configs/pieces/" + name + ".toml");
}

inline Machine machine() {
  Machine m;
  m.kinematics.type = KinematicsParams::Type::head;
  return m;
}

inline RunBegin begin(const Machine& m, const PieceParams& p) {
  return {"run-1", "test.nc", to_toml(m), to_toml(p), 7};
}

inline RunEnd end(std::int64_t cycles) {
  RunEnd e;
  e.complete = true;
  e.reason = "program end";
  e.cycles = cycles;
  e.trace_hash = "0123456789abcdef0123456789abcdef";
  e.wall_seconds = 0.5;
  e.bus_load_worst = 0.75;
  return e;
}

/// Measured = commanded, and the true tip stands where `true_tip` puts the commanded one.
class SyntheticRun {
 public:
  using TipError = std::function<Vec3(const Station&)>;

  SyntheticRun(Machine m, const PieceParams& p)
      : machine_(std::move(m)),
        piece_(make_piece(p)),
        kinematics_(machine_.kinematics, machine_.tool_length(1), machine_.setup.work_offset[0]) {}

  const Machine& machine() const { return machine_; }
  const Piece& piece() const { return *piece_; }
  const Kinematics& kinematics() const { return kinematics_; }
  const std::vector<TelemetryRow>& rows() const { return rows_; }

  AxisVector axes(const Vec3& p, const Vec3& tool) {
    const RotaryPair r = rotary_from_axis(tool, rotary_);
    rotary_ = r;
    return kinematics_.inverse(p, r.a, r.c);
  }

  /// Adds one row; the deflection is that of frictionless contact at the true tip.
  TelemetryRow& add(const AxisVector& q_cmd, const AxisVector& q_act, const Vec3& tip_error) {
    TelemetryRow row;
    row.tick = static_cast<double>(next_tick_++);
    row.state = static_cast<double>(NcState::running);
    row.line = 10;
    row.q_cmd = q_cmd;
    row.q_act = q_act;
    const ToolPose pose = kinematics_.forward(q_act);
    hint_ = piece_->nearest(pose.p_WT + tip_error, hint_);
    const double depth = machine_.probe.ball_radius - hint_.distance;
    const Vec3 delta = depth > 0 ? Vec3(pose.R_WT.transpose() * (depth * hint_.n)) : Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i) row.deflection[i] = delta[static_cast<Eigen::Index>(i)];
    if (depth > 0) row.probe_flags = ProbeSample::kContact;
    rows_.push_back(row);
    return rows_.back();
  }

  /// Approach along the normal, one closed lap with `overlap` more, retreat. Perfect axes.
  void lap(double z, double step, const TipError& tip_error, double overlap = 3e-3,
           double interference = -1) {
    if (interference < 0) interference = machine_.setup.predeflection;
    auto path = piece_->scan_path(machine_.probe.ball_radius, interference, z, step);
    const Station first = path.front();
    const double length = path.back().s;
    for (int i = 50; i > 0; --i) normal_offset(first, i * 100e-6, tip_error);
    for (const Station& station : path) normal_offset(station, 0, tip_error);
    for (const Station& station : path)
      if (station.s > 0 && station.s <= overlap && length > overlap)
        normal_offset(station, 0, tip_error);
    const Station& last = path[static_cast<std::size_t>(overlap / step) + 1];
    for (int i = 1; i < 50; ++i) normal_offset(last, i * 100e-6, tip_error);
  }

  void normal_offset(const Station& station, double offset, const TipError& tip_error) {
    const AxisVector q = axes(station.centre + offset * station.n, station.tool_axis);
    add(q, q, tip_error(station));
  }

 private:
  Machine machine_;
  std::unique_ptr<Piece> piece_;
  Kinematics kinematics_;
  RotaryPair rotary_;
  SurfacePoint hint_;
  Tick next_tick_ = 0;
  std::vector<TelemetryRow> rows_;
};

inline Vec3 no_error(const Station&) { return Vec3::Zero(); }

}  // namespace vcnc::synthetic
