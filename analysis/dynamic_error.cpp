#include "analysis/dynamic_error.hpp"

#include "bus/messages.hpp"

namespace vcnc {
namespace {

constexpr double kReach = 5e-3;  ///< beyond ball radius + reach there is nothing to evaluate [m]
constexpr double kRetryTravel = 2e-3;  ///< travel after which a failed search is tried again [m]
constexpr double kStandStill = 1e-9;   ///< travel per cycle that has no direction [m]

bool has(const TelemetryRow& row, ProbeSample::Flag flag) {
  return (static_cast<unsigned>(row.probe_flags) & flag) != 0;
}

/// What flags and states say; depth is the deflection along the normal.
Contact contact_of(const TelemetryRow& row, double depth, double min_deflection) {
  if (has(row, ProbeSample::kSlip) || has(row, ProbeSample::kSignalFault) ||
      has(row, ProbeSample::kOvertravel) ||
      static_cast<int>(row.overtravel) >= static_cast<int>(OvertravelState::State::soft_stop) ||
      static_cast<int>(row.state) == static_cast<int>(NcState::alarm) ||
      static_cast<int>(row.state) == static_cast<int>(NcState::hold))
    return Contact::invalid;
  if (has(row, ProbeSample::kOutOfRange)) return Contact::out_of_range;
  return depth < min_deflection ? Contact::no_contact : Contact::ok;
}

}  // namespace

DynamicError::DynamicError(const Machine& declared, const Piece* piece)
    : kinematics_(declared.kinematics, declared.tool_length(1), declared.setup.work_offset[0]),
      piece_(piece),
      ball_radius_(declared.probe.ball_radius),
      predeflection_(declared.setup.predeflection),
      min_deflection_(declared.probe.min_deflection) {}

ErrorSample DynamicError::evaluate(const TelemetryRow& row) {
  const ToolPose cmd = kinematics_.forward(row.q_cmd);
  const ToolPose act = kinematics_.forward(row.q_act);
  ErrorSample sample;
  sample.tick = static_cast<Tick>(row.tick);
  sample.theoretical = cmd.p_WT;
  sample.actual =
      cmd.p_WT + act.R_WT * Vec3(row.deflection[0], row.deflection[1], row.deflection[2]);
  for (std::size_t j = 0; j < kAxisCount; ++j) sample.following[j] = row.q_act[j] - row.q_cmd[j];

  if (!first_) {
    const Vec3 step = cmd.p_WT - previous_;
    sample.travel = step.norm();
    if (sample.travel > kStandStill) tangent_ = step / sample.travel;
  }
  first_ = false;
  previous_ = cmd.p_WT;
  const Vec3 e_t = act.p_WT - cmd.p_WT;
  sample.lag = e_t.dot(tangent_);
  sample.cross = (e_t - sample.lag * tangent_).norm();

  if (piece_ != nullptr && may_touch(cmd.p_WT)) evaluate_contact(row, cmd, act, sample);
  return sample;
}

// The distance changes by no more than the travel, so most rows of a run far from the piece need
// no search.
bool DynamicError::may_touch(const Vec3& p) {
  return clearance_ < 0 || (p - probed_).norm() >= clearance_;
}

void DynamicError::evaluate_contact(const TelemetryRow& row, const ToolPose& cmd,
                                    const ToolPose& act, ErrorSample& sample) {
  hint_cmd_ = piece_->nearest(cmd.p_WT, hint_cmd_);
  probed_ = cmd.p_WT;
  if (!hint_cmd_.valid) {
    hint_cmd_ = SurfacePoint();
    clearance_ = kRetryTravel;
    return;
  }
  clearance_ = hint_cmd_.distance - ball_radius_ - kReach;
  if (clearance_ >= 0) return;

  // A hint from before an interruption may lie on the other face; the commanded point's foot is
  // then the better start.
  if (!hint_act_.valid) hint_act_ = hint_cmd_;
  if (!hint_ball_.valid) hint_ball_ = hint_cmd_;
  const Vec3 R_delta = sample.actual - sample.theoretical;
  hint_act_ = piece_->nearest(act.p_WT, hint_act_);
  hint_ball_ = piece_->nearest(act.p_WT + R_delta, hint_ball_);
  sample.near_piece = true;
  sample.distance = hint_cmd_.distance;
  sample.foot = hint_ball_;
  sample.n = hint_ball_.n;

  const double depth = sample.n.dot(R_delta);
  const double scan_distance = ball_radius_ - predeflection_;
  sample.e_n = predeflection_ - depth;
  sample.e_plan = hint_cmd_.distance - scan_distance;
  sample.e_servo = hint_act_.distance - hint_cmd_.distance;
  sample.e_rest = sample.e_n - sample.e_plan - sample.e_servo;
  const auto J = kinematics_.jacobian(row.q_act);
  for (std::size_t j = 0; j < kAxisCount; ++j)
    sample.share[j] = sample.n.dot(J.col(static_cast<Eigen::Index>(j))) * sample.following[j];
  sample.contact = hint_act_.valid && hint_ball_.valid ? contact_of(row, depth, min_deflection_)
                                                       : Contact::invalid;
}

}  // namespace vcnc
