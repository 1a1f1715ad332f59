#include "controller/nc_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bus/cia402.hpp"

namespace vcnc {

namespace {

constexpr std::uint64_t kNoSeed = 0;  ///< no effect of the NC unit draws random numbers
constexpr Tick kStartUpCycles = 200;  ///< the drives must be enabled by then
constexpr Tick kSettleCycles = 100;   ///< after the last set-point, before the run ends
constexpr Tick kStopCycles = 5000;    ///< at most this long for a stop in an alarm

cia402::State drive_state(const DriveStatus& status) { return cia402::state_of(status.statusword); }

/// Controlword that brings the slowest drive one state nearer to operation.
std::uint16_t bring_up(std::span<const DriveStatus> drives) {
  const auto any = [&](cia402::State s) {
    return std::any_of(drives.begin(), drives.end(),
                       [&](const DriveStatus& d) { return drive_state(d) == s; });
  };
  if (any(cia402::State::not_ready) || any(cia402::State::switch_on_disabled))
    return cia402::kShutdown;
  if (any(cia402::State::ready)) return cia402::kSwitchOn;
  return cia402::kEnable;
}

const char* cause_text(OvertravelState::Cause cause) {
  switch (cause) {
    case OvertravelState::Cause::range:
      return "deflection out of the usable range";
    case OvertravelState::Cause::overtravel:
      return "the probe's overtravel limit is reached";
    case OvertravelState::Cause::signal:
      return "the probe's signals are faulty";
    case OvertravelState::Cause::silent:
      return "the probe has fallen silent";
    case OvertravelState::Cause::slip:
      return "the probe moved too fast to be counted, its reading is lost";
    case OvertravelState::Cause::none:
      break;
  }
  return "no cause given";
}

std::string module_name(int node) {
  if (node >= 1 && node <= static_cast<int>(kAxisCount))
    return fmt::format("drive {}", kAxisNames[static_cast<std::size_t>(node - 1)]);
  switch (node) {
    case kSpindleNode:
      return "drive spindle";
    case kProbeNode:
      return "probe";
    case kOvertravelNode:
      return "overtravel";
    default:
      return fmt::format("node {}", node);
  }
}

const char* emergency_text(std::uint16_t code) {
  switch (code) {
    case 0x8100:
      return "communication disturbed";
    case 0x8110:
      return "frames lost";
    case 0x8130:
      return "the overtravel module has fallen silent";
    case 0x8250:
      return "no command from the NC unit";
    case 0xff10:
      return "the overtravel protection has tripped";
    default:
      return "a fault of the module";
  }
}

}  // namespace

NcUnit::NcUnit(const Machine& machine, const std::string& program, TelemetrySink& sink)
    : machine_(machine),
      probe_range_(usable_range(machine.probe)),
      player_(program, machine),
      shaping_(machine_chain<InterpolationPort>(machine.effects, kNoSeed)),
      sink_(sink) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    planned_.step.position[i] = machine.axes[i].limits.start;
    measured_[i].position = measured_next_[i].position = machine.axes[i].limits.start;
  }
  earlier_.fill(planned_);
}

bool NcUnit::step(Tick k, std::span<const Frame> answers, Frames& out) {
  latch(k, answers);
  supervise(k);
  advance(k);
  command(k, out);
  sample(k);
  if (ending_since_ < 0) return true;
  const Tick ended = k - ending_since_;
  return alarmed_ ? !(ended > kSettleCycles && standing()) && ended < kStopCycles
                  : ended < kSettleCycles;
}

void NcUnit::latch(Tick k, std::span<const Frame> answers) {
  measured_ = measured_next_;
  for (const Frame& frame : answers) {
    if (const auto status = decode_drive_status(frame)) {
      measured_next_[static_cast<std::size_t>(status->node - 1)] = *status;
    } else if (const auto sample = decode_probe_sample(frame)) {
      probe_ = *sample;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      overtravel_ = *overtravel;
    } else if (const auto emergency = decode_emergency(frame); emergency && emergency->code != 0) {
      sink_.alarm({k, static_cast<int>(Code::node), module_name(emergency->node),
                   fmt::format("{} (emergency message {:04X}h)", emergency_text(emergency->code),
                               emergency->code)});
    }
  }
}

void NcUnit::raise(Tick k, Code code, std::string source, std::string text) {
  if (planned_.step.line > 0) text += fmt::format(" (program line {})", planned_.step.line);
  if (!alarmed_) reason_ = fmt::format("alarm {}: {}", static_cast<int>(code), text);
  alarmed_ = true;
  state_ = NcState::alarm;
  if (ending_since_ < 0) ending_since_ = k;
  sink_.alarm({k, static_cast<int>(code), std::move(source), std::move(text)});
}

void NcUnit::supervise(Tick k) {
  if (alarmed_) return;
  if (overtravel_.state == OvertravelState::State::tripped) {
    raise(k, Code::overtravel, "overtravel",
          fmt::format("overtravel: {}, {:.3f} mm; spindle locked", cause_text(overtravel_.cause),
                      overtravel_.deflection * 1e3));
    return;
  }
  if (machine_.probe.in_spindle && !probe_range_.contains(Vec3(probe_.deflection.data()))) {
    raise(k, Code::probe_range, "NC unit",
          fmt::format(
              "probe deflection ({:.3f}, {:.3f}, {:.3f}) mm is out of range; spindle locked",
              probe_.deflection[0] * 1e3, probe_.deflection[1] * 1e3, probe_.deflection[2] * 1e3));
    return;
  }
  if (machine_.probe.in_spindle &&
      (probe_.flags & (ProbeSample::kSlip | ProbeSample::kSignalFault))) {
    raise(k, Code::probe_signal, "NC unit",
          "the probe's reading cannot be trusted any more; spindle locked");
    return;
  }
  if (state_ == NcState::starting) {
    if (k > kStartUpCycles) raise(k, Code::start_up, "NC unit", "the drives could not be enabled");
    return;
  }
  for (std::size_t i = 0; i <= kAxisCount; ++i) {
    if (drive_state(measured_next_[i]) == cia402::State::operation_enabled) continue;
    raise(k, Code::drive, i < kAxisCount ? fmt::format("drive {}", kAxisNames[i]) : "drive spindle",
          fmt::format("{} left operation, statusword {:04X}h",
                      i < kAxisCount ? fmt::format("drive {}", kAxisNames[i])
                                     : std::string("the spindle drive"),
                      measured_next_[i].statusword));
    return;
  }
}

void NcUnit::advance(Tick k) {
  earlier_[1] = earlier_[0];
  earlier_[0] = planned_;
  if (state_ == NcState::starting) {
    const bool enabled = std::all_of(
        measured_next_.begin(), measured_next_.end(),
        [](const DriveStatus& d) { return drive_state(d) == cia402::State::operation_enabled; });
    if (enabled) state_ = NcState::running;
  }
  if (state_ == NcState::done) {  // at rest, but a filter settles
    planned_.step = player_.step();
    shape(k);
  } else if (state_ == NcState::running || state_ == NcState::dwell) {
    planned_.step = player_.step();
    shape(k);
    state_ = planned_.step.done    ? NcState::done
             : planned_.step.dwell ? NcState::dwell
                                   : NcState::running;
    if (state_ == NcState::done) {
      ending_since_ = k;
      reason_ = "program end";
    }
  }
  if (state_ == NcState::alarm) {  // the drives brake on their own ramps
    planned_.step.velocity.fill(0);
    planned_.step.feed = 0;
    planned_.step.spindle = PlayerStep::Spindle::off;
  }
  planned_.state = state_;
}

/// What becomes of the planned set-points on their way out.
void NcUnit::shape(Tick k) {
  if (shaping_.empty()) return;
  InterpolationPort::Signal<double> signal{planned_.step.position, planned_.step.velocity};
  shaping_.step(signal, {{seconds(k), kCycle, k}});
  planned_.step.position = signal.position;
  planned_.step.velocity = signal.velocity;
}

void NcUnit::command(Tick k, Frames& out) {
  GroupCommand command{.tick = low16(k)};
  switch (state_) {
    case NcState::starting:
      command.controlword = bring_up(measured_next_);
      break;
    case NcState::alarm:
      command.controlword = cia402::kQuickStop;
      break;
    default:
      command.controlword = cia402::kEnable;
      break;
  }
  for (std::size_t i = 0; i < kAxisCount; ++i)
    command.axes[i] = {planned_.step.position[i], planned_.step.velocity[i]};
  command.spindle_mode = static_cast<GroupCommand::SpindleMode>(planned_.step.spindle);
  command.spindle_speed = planned_.step.spindle_speed;
  if (alarmed_) command.flags |= kSpindleLock;
  out.push_back(encode(command));
}

void NcUnit::sample(Tick k) {
  const Commanded& commanded = earlier_[1];
  TelemetryRow row;
  row.tick = static_cast<double>(k);
  row.line = commanded.step.line;
  row.state = static_cast<double>(static_cast<int>(commanded.state));
  row.feed = commanded.step.feed;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    row.q_cmd[i] = commanded.step.position[i];
    row.q_act[i] = measured_[i].position;
    row.q_second[i] = measured_[i].second_encoder;
    row.force[i] = measured_[i].force;
  }
  row.deflection = probe_.deflection;
  std::copy(probe_.adc.begin(), probe_.adc.end(), row.adc.begin());
  row.probe_flags = probe_.flags;
  row.overtravel = static_cast<double>(overtravel_.state);
  row.spindle_speed = measured_[kAxisCount].second_encoder;
  row.bus_load = bus_load_;
  sink_.row(row);
}

bool NcUnit::standing() const {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (std::abs(measured_next_[i].position - measured_[i].position) > 1e-3 * kCycle) return false;
  return true;
}

}  // namespace vcnc
