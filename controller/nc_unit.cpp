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
constexpr int kSilentCyclesBearable = 2;
constexpr Tick kRememberCycles = 20;  ///< between two records while the axes are being secured
constexpr Tick kDataCycles = 1000;    ///< between two records of offsets, parameters and tools

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

/// The unit reads the probe.
PlayerOptions feeling(PlayerOptions options) {
  options.feels = true;
  return options;
}

}  // namespace

NcUnit::NcUnit(const Machine& machine, const std::string& program, TelemetrySink& sink,
               const NcUnitOptions& options)
    : machine_(machine),
      protection_(machine.probe),
      player_(program, machine, feeling(options.player)),
      panel_(options.operations),
      shaping_(machine_chain<InterpolationPort>(machine.effects, kNoSeed)),
      compensation_(machine),
      compensating_(compensation_),
      sink_(sink),
      heartbeat_period_(heartbeat_cycles(machine.bus.heartbeat_time)),
      outage_(machine_, player_),
      options_(options),
      saved_(options.record) {
  protection_.restore(saved_.protection);
  if (!options_.resume) options_.kept.begin = options_.player.interpreter.data;
  options_.kept.touches = player_.touches();
  if (options_.data) options_.data->save(encode_nc_data(options_.kept));
  if (options_.resume) seek();
  for (HeartbeatWatch& watch : heartbeats_) {
    watch.set_time(kHeartbeatPatience * heartbeat_period_);
    watch.heard(NmtState::operational, 0);  // as they said at the start
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double start =
        options_.resume ? options_.switched_on_at[i] : machine.axes[i].limits.start;
    planned_.step.position[i] = start;
    measured_[i].position = measured_next_[i].position = start;
  }
  earlier_.fill(planned_);
  for (const AxisParams& axis : machine.axes) {
    const double stop_s = axis.limits.velocity / axis.limits.acceleration;
    blind_stop_cycles_ =
        std::max(blind_stop_cycles_, kSettleCycles + static_cast<Tick>(std::ceil(stop_s / kCycle)));
  }
}

/// Takes the player to where the program was held, and sees that it is the same place.
void NcUnit::seek() {
  constexpr double kRounding = 1e-12;
  const auto refuse = [](const char* why) {
    throw InputError(std::string("the interrupted program cannot go on: ") + why +
                     "; drop it with `vcnc reset`");
  };
  try {
    player_.seek(saved_.held);
  } catch (const std::out_of_range&) {
    refuse("it ends before the place where it was held");
  }
  const AxisVector rest = player_.rest();
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (std::abs(rest[i] - saved_.path_point[i]) > kRounding)
      refuse("its path does not lead through the place where it was held");
}

bool NcUnit::step(Tick k, std::span<const Frame> answers, Frames& out) {
  latch(k, answers);
  supervise(k);
  operate(k);
  try {
    advance(k);
  } catch (const ProgramError& error) {
    raise(k, AlarmCode::program_refused, "NC unit", error.what(), Stop::hold);
    planned_.state = state_;
  }
  command(k, out);
  sample(k);
  remember(k);
  if (ending_since_ < 0) return true;
  const Tick ended = k - ending_since_;
  if (alarmed_ && ended < blind_stop_cycles_ &&
      std::any_of(missing_.begin(), missing_.end(), [](bool m) { return m; }))
    return true;
  return alarmed_ ? !(ended > kSettleCycles && standing()) && ended < kStopCycles
                  : ended < kSettleCycles;
}

/// Whether a frame of the node, stamped `tick`, is young enough to be believed.
bool NcUnit::heard(int node, std::uint16_t tick, std::uint16_t expected) {
  if (static_cast<std::uint16_t>(expected - tick) > kSilentCyclesBearable) return false;
  int& silent = silent_cycles_[static_cast<std::size_t>(node)];
  if (silent == 0) stray_id_ = kStatusBase + node;  // a second one in this cycle
  silent = 0;
  return true;
}

void NcUnit::latch(Tick k, std::span<const Frame> answers) {
  measured_ = measured_next_;
  probe_heard_ = false;
  stray_id_ = -1;
  for (int& silent : silent_cycles_) ++silent;
  for (const Frame& frame : answers) {
    if (const auto status = decode_drive_status(frame)) {
      if (!is_finite(*status) || !heard(status->node, status->tick, low16(k + 1))) continue;
      measured_next_[static_cast<std::size_t>(status->node - 1)] = *status;
    } else if (const auto sample = decode_probe_sample(frame)) {
      if (!is_finite(*sample) || !heard(kProbeNode, sample->tick, low16(k))) continue;
      probe_ = *sample;
      probe_heard_ = true;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      if (!heard(kOvertravelNode, overtravel->tick, low16(k))) continue;
      overtravel_ = *overtravel;
    } else if (const auto emergency = decode_emergency(frame)) {
      if (emergency->code == 0 || emergency->code == kOvertravelEmergency) continue;
      const AlarmCode code = alarm_of_emergency(emergency->code, emergency->detail[0]);
      if (emergency->node == kSpindleNode &&
          (code == AlarmCode::command_lost || code == AlarmCode::overtravel_module_lost ||
           code == AlarmCode::heartbeat_lost))
        spindle_alone_ = code;
      if (emergency->node >= 1 && emergency->node <= kSpindleNode)
        drive_emergency_[static_cast<std::size_t>(emergency->node - 1)] = code;
      sink_.alarm(
          {k, static_cast<int>(code), module_name(emergency->node),
           fmt::format("{} (emergency message {:04X}h)", alarm_text(code).title, emergency->code)});
    } else if (const auto heartbeat = decode_heartbeat(frame)) {
      if (heartbeat->node <= kOvertravelNode)
        heartbeats_[static_cast<std::size_t>(heartbeat->node)].heard(heartbeat->state, k);
    } else if (!is_sdo(frame.id) && frame.id < kHeartbeatBase) {
      stray_id_ = frame.id;
    }
  }
}

void NcUnit::raise(Tick k, AlarmCode code, std::string source, const std::string& detail,
                   Stop stop) {
  if (stop == Stop::hold && outage_.off_path()) stop = Stop::quick;
  std::string text = alarm_text(code).title;
  if (!detail.empty()) text += ": " + detail;
  if (planned_.step.line > 0) text += fmt::format(" (program line {})", planned_.step.line);
  if (!alarmed_) saved_.alarm = static_cast<int>(code);
  if (!alarmed_) reason_ = fmt::format("alarm {}: {}", static_cast<int>(code), text);
  alarmed_ = true;
  state_ = NcState::alarm;
  if (stop > stop_) {
    stop_ = stop;
    if (stop == Stop::hold) player_.hold();
    if (stop == Stop::quick) ending_since_ = k;
  }
  sink_.alarm({k, static_cast<int>(code), std::move(source), std::move(text)});
}

void NcUnit::supervise(Tick k) {
  watch_modules(k);
  watch_heartbeats(k);
  watch_bus(k);
  watch_protection(k);
  if (stop_ == Stop::quick) return;
  if (state_ == NcState::starting) {
    if (k > kStartUpCycles) refuse_start(k);
    return;
  }
  watch_drives(k);
  watch_mains(k);
}

/// Names the drives that are not in operation.
void NcUnit::refuse_start(Tick k) {
  std::string names;
  int missing = 0;
  for (std::size_t i = 0; i <= kAxisCount; ++i) {
    if (drive_state(measured_next_[i]) == cia402::State::operation_enabled) continue;
    names += (names.empty() ? "" : ", ") + module_name(static_cast<int>(i) + 1);
    ++missing;
  }
  raise(k, AlarmCode::drives_not_enabled, missing == 1 ? names : "NC unit", names, Stop::quick);
}

/// What the bus says has gone, and what has not been heard for too long.
void NcUnit::watch_modules(Tick k) {
  for (const auto& [id, why] : gone_) {
    missing_[static_cast<std::size_t>(id)] = true;
    raise(k, AlarmCode::module_gone, module_name(id), why, Stop::quick);
  }
  gone_.clear();
  const auto too_long = [&](int node) {
    return silent_cycles_[static_cast<std::size_t>(node)] > kSilentCyclesBearable;
  };
  bool nobody = true;
  for (int node = 1; node <= kOvertravelNode; ++node) nobody = nobody && too_long(node);
  for (int node = 1; node <= kOvertravelNode; ++node) {
    bool& missing = missing_[static_cast<std::size_t>(node)];
    if (missing || !too_long(node)) continue;
    missing = true;
    raise(k, AlarmCode::module_silent, module_name(node),
          nobody ? "none is heard any more, the bus itself has failed" : module_name(node),
          Stop::quick);
  }
}

/// Whoever lets its heartbeat fail, or shows another state than it should be in.
void NcUnit::watch_heartbeats(Tick k) {
  for (int node = 1; node <= kOvertravelNode; ++node) {
    HeartbeatWatch& watch = heartbeats_[static_cast<std::size_t>(node)];
    const bool lost = watch.check(k) == HeartbeatWatch::Event::lost;
    const bool left = watch.state() != NmtState::operational;
    bool& missing = missing_[static_cast<std::size_t>(node)];
    if (missing || (!lost && !left)) continue;
    missing = true;
    raise(k, AlarmCode::heartbeat_lost, module_name(node),
          lost ? fmt::format("{}, none for {} ms", module_name(node), watch.time())
               : fmt::format("{} says {}", module_name(node), text_of(watch.state())),
          Stop::quick);
  }
}

/// Frames that do not belong there are told once; together with an overload they stop the machine.
void NcUnit::watch_bus(Tick k) {
  const bool overloaded = stray_id_ >= 0 && bus_load_ > 1;
  overloaded_cycles_ = overloaded ? overloaded_cycles_ + 1 : 0;
  if (stray_id_ < 0) return;
  const std::string which = fmt::format("identifier {:03X}h", stray_id_);
  if (!stray_told_)
    sink_.alarm({k, static_cast<int>(AlarmCode::communication_disturbed), "NC unit",
                 fmt::format("{}: {} does not belong there",
                             alarm_text(AlarmCode::communication_disturbed).title, which)});
  stray_told_ = true;
  if (overloaded_cycles_ == kSilentCyclesBearable + 1)
    raise(k, AlarmCode::bus_overloaded, "NC unit", which, Stop::quick);
}

/// The module's protection first, then the NC unit's own, each as hard as it says.
void NcUnit::watch_protection(Tick k) {
  protection_.step({.sampled = probe_heard_,
                    .deflection = Vec3(probe_.deflection.data()),
                    .overtravel = (probe_.flags & ProbeSample::kOvertravel) != 0,
                    .signal_fault = (probe_.flags & ProbeSample::kSignalFault) != 0,
                    .slip = (probe_.flags & ProbeSample::kSlip) != 0,
                    .tick = probe_.tick},
                   false);
  const auto tell = [&](ProtectionState state, ProtectionCause cause, double deflection,
                        AlarmCode soft, AlarmCode hard, const char* source) {
    const Stop stop = state == ProtectionState::hard        ? Stop::quick
                      : state == ProtectionState::soft_stop ? Stop::hold
                                                            : Stop::none;
    const bool harder = stop == Stop::quick ? stop_ != Stop::quick : stop_ == Stop::none;
    if (stop == Stop::none || !harder) return;
    raise(k, stop == Stop::quick ? hard : soft, source,
          fmt::format("{}, {:.3f} mm", text_of(cause), deflection * 1e3), stop);
  };
  tell(static_cast<ProtectionState>(overtravel_.state),
       static_cast<ProtectionCause>(overtravel_.cause), overtravel_.deflection,
       AlarmCode::overtravel_soft, AlarmCode::overtravel_hard, "overtravel");
  tell(protection_.state(), protection_.cause(), protection_.deflection(),
       AlarmCode::overtravel_soft_nc, AlarmCode::overtravel_hard_nc, "NC unit");
}

void NcUnit::watch_drives(Tick k) {
  if (spindle_alone_) {
    const std::string spindle = module_name(kSpindleNode);
    raise(k, *spindle_alone_, spindle, spindle + " has locked itself", Stop::quick);
    return;
  }
  const bool starts = planned_.step.spindle != PlayerStep::Spindle::off;
  if (starts && !alarmed_ && (measured_next_[kAxisCount].statusword & cia402::kLocked) != 0) {
    raise(k, AlarmCode::spindle_locked, module_name(kSpindleNode), "", Stop::hold);
    return;
  }
  for (std::size_t i = 0; i <= kAxisCount; ++i) {
    if (!seen(i) || drive_state(measured_next_[i]) == cia402::State::operation_enabled) continue;
    const std::string drive =
        i < kAxisCount ? fmt::format("drive {}", kAxisNames[i]) : std::string("drive spindle");
    const bool first = !alarmed_;
    raise(k, AlarmCode::drive_left_operation, drive,
          fmt::format("{}, statusword {:04X}h", drive, measured_next_[i].statusword), Stop::quick);
    if (const auto& why = drive_emergency_[i]; first && why) {  // it has said why
      reason_ =
          fmt::format("alarm {}: {}: {}", static_cast<int>(*why), alarm_text(*why).title, drive);
      if (planned_.step.line > 0) reason_ += fmt::format(" (program line {})", planned_.step.line);
    }
    return;
  }
}

/// What is worth knowing and stops nothing.
void NcUnit::tell(Tick k, AlarmCode code, const std::string& detail) {
  std::string text = alarm_text(code).title;
  if (!detail.empty()) text += ": " + detail;
  if (planned_.step.line > 0) text += fmt::format(" (program line {})", planned_.step.line);
  sink_.alarm({k, static_cast<int>(code), "NC unit", std::move(text)});
}

/// What the operator does at the panel in this cycle.
void NcUnit::operate(Tick k) {
  if (panel_.empty() || state_ == NcState::alarm || state_ == NcState::done) return;
  for (const Operation& operation : panel_.due(k, planned_.step.line)) {
    if (operation.kind == Operation::Kind::hold) player_.feed_hold();
    if (operation.kind == Operation::Kind::start) player_.cycle_start();
  }
  player_.operate(panel_.switches());
  player_.attended(panel_.start_to_come());
}

/// Tells the program what the probe reads, with the axes as measured at the instant of the reading.
void NcUnit::feel(Tick k) {
  std::rotate(places_.begin(), places_.end() - 1, places_.end());
  for (std::size_t i = 0; i < kAxisCount; ++i)
    places_[0][i] = measured_[i].position - earlier_[1].correction[i];
  const std::size_t age = static_cast<std::uint16_t>(low16(k) - probe_.tick);
  if (!machine_.probe.in_spindle || !probe_heard_ || age >= places_.size() ||
      state_ == NcState::alarm || state_ == NcState::done)
    return;
  player_.feel({Vec3(probe_.deflection.data()), places_[age]});
}

/// A probing move that has found nothing, or has nothing to look for.
void NcUnit::watch_probing(Tick k) {
  if (alarmed_ || player_.probe_fault() == ProbeFault::none) return;
  const bool at_begin = player_.probe_fault() == ProbeFault::at_begin;
  raise(k, at_begin ? AlarmCode::probe_at_begin : AlarmCode::probe_no_contact, "NC unit",
        fmt::format("deflection {:.3f} mm", Vec3(probe_.deflection.data()).norm() * 1e3),
        Stop::hold);
}

void NcUnit::watch_mains(Tick k) {
  if (mains_failing_ != mains_told_) {
    const bool playing = state_ == NcState::running || state_ == NcState::dwell ||
                         (state_ == NcState::hold && !outage_.active());
    tell(k, mains_failing_ ? AlarmCode::mains_lost : AlarmCode::mains_back,
         mains_failing_ && playing ? "feed hold" : "");
    mains_told_ = mains_failing_;
  }
  if (!mains_failing_ || (state_ != NcState::running && state_ != NcState::dwell &&
                          (state_ != NcState::hold || outage_.active())))
    return;
  if (!outage_.active() || outage_.phase() == Outage::Phase::rising) outage_.begin();
}

/// One cycle of a loss of the mains, or of what follows it.
void NcUnit::ride_out(Tick k) {
  const bool waited = outage_.phase() == Outage::Phase::waiting;
  const bool go_on = options_.on_power_return == OnPowerReturn::resume && !mains_failing_;
  planned_.step = outage_.step({mains_failing_, go_on, Vec3(probe_.deflection.data())});
  shape(k);
  state_ = !outage_.active() || outage_.on_path() ? NcState::running : NcState::hold;
  const bool waits = outage_.phase() == Outage::Phase::waiting;
  if (waits && !waited) tell(k, AlarmCode::secured, options_.memory ? "state saved" : "");
  if (waited && outage_.phase() == Outage::Phase::spindle) tell(k, AlarmCode::resumed, "");
  if (!waits || mains_failing_ || ended_by_mains_ ||
      options_.on_power_return == OnPowerReturn::resume)
    return;
  ended_by_mains_ = true;
  ending_since_ = k;
  reason_ = fmt::format("ended after a loss of the mains, on line {}, the probe free{}",
                        planned_.step.line, options_.memory ? "; it can go on with --resume" : "");
}

RunStage NcUnit::stage() const {
  if (alarmed_) return RunStage::alarm;
  if (state_ == NcState::done) return RunStage::done;
  switch (outage_.phase()) {
    case Outage::Phase::none:
      return state_ == NcState::starting ? saved_.stage : RunStage::running;
    case Outage::Phase::holding:
      return RunStage::holding;
    case Outage::Phase::settling:
      return RunStage::held;
    case Outage::Phase::retracting:
      return RunStage::retracting;
    case Outage::Phase::waiting:
    case Outage::Phase::spindle:
      return RunStage::retracted;
    case Outage::Phase::returning:
    case Outage::Phase::rising:
      break;
  }
  return RunStage::returning;
}

/// Offsets, parameters and tools where a program has changed them.
void NcUnit::remember_data(Tick k, bool now) {
  if (options_.data == nullptr || (!now && k - data_saved_at_ < kDataCycles)) return;
  data_saved_at_ = k;
  if (player_.data() == options_.kept.now && player_.touches() == options_.kept.touches) return;
  options_.kept.now = player_.data();
  options_.kept.touches = player_.touches();
  options_.data->save(encode_nc_data(options_.kept));
}

/// Writes the record where there is something new to keep.
void NcUnit::remember(Tick k) {
  if (options_.memory == nullptr) return;
  const RunStage now = stage();
  remember_data(k, now != saved_.stage);
  const ProtectionLatch latch = protection_.latch();
  const bool moving = outage_.active() && outage_.phase() != Outage::Phase::waiting &&
                      now != RunStage::alarm && state_ != NcState::starting;
  const bool due = moving && k - saved_at_ >= kRememberCycles;
  if (now == saved_.stage && latch == saved_.protection && !due) return;
  saved_.stage = now;
  saved_.protection = latch;
  saved_.cycle = k;
  for (std::size_t i = 0; i < kAxisCount; ++i) saved_.position[i] = measured_next_[i].position;
  saved_.deflection = probe_heard_ ? Vec3(probe_.deflection.data()) : saved_.deflection;
  if (resumable(now) && outage_.phase() != Outage::Phase::rising) {
    saved_.held = player_.time();
    saved_.path_point = player_.rest();
  }
  if (now == RunStage::running || now == RunStage::done) saved_.alarm = 0;
  options_.memory->save(encode_record(saved_));
  saved_at_ = k;
}

void NcUnit::advance(Tick k) {
  earlier_[1] = earlier_[0];
  earlier_[0] = planned_;
  feel(k);
  if (state_ == NcState::starting) {
    const bool enabled = std::all_of(
        measured_next_.begin(), measured_next_.end(),
        [](const DriveStatus& d) { return drive_state(d) == cia402::State::operation_enabled; });
    if (enabled) state_ = NcState::running;
    if (enabled && options_.resume) {
      outage_.go_on_from(options_.switched_on_at);
      tell(k, AlarmCode::resumed,
           fmt::format("{:.3f} s of the program have been played", seconds(saved_.held.cycles)));
    }
  }
  if (state_ == NcState::done) {  // at rest, but a filter settles
    planned_.step = player_.step();
    shape(k);
  } else if (outage_.active() && state_ != NcState::alarm) {
    ride_out(k);
  } else if (state_ == NcState::running || state_ == NcState::dwell || state_ == NcState::hold) {
    planned_.step = player_.step();
    shape(k);
    const bool at_zero = player_.stands_at_zero();
    state_ = planned_.step.done             ? NcState::done
             : player_.waiting() || at_zero ? NcState::hold
             : planned_.step.dwell          ? NcState::dwell
                                            : NcState::running;
    at_zero_ = at_zero ? at_zero_ + 1 : 0;
    if (ending_since_ < 0 && seconds(at_zero_) > kProgramStopSeconds && !panel_.timed_to_come()) {
      ending_since_ = k;
      reason_ = fmt::format("stands on line {} at an override of 0 %, and nothing more is operated",
                            planned_.step.line);
    }
    if (state_ == NcState::done) {
      ending_since_ = k;
      reason_ = "program end";
    }
  }
  watch_probing(k);
  if (state_ == NcState::alarm) {
    if (stop_ == Stop::quick) {  // the drives brake on their own ramps
      planned_.step.velocity.fill(0);
      planned_.step.feed = 0;
    } else {
      stop_softly(k);
    }
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

/// The probe's deflection; 0 where the protection has not spoken and there is no belief in contact.
Vec3 NcUnit::touching() const {
  const Vec3 deflection(probe_.deflection.data());
  const bool spoken =
      protection_.latched() || overtravel_.state >= OvertravelState::State::soft_stop;
  return spoken || deflection.norm() >= machine_.probe.min_deflection ? deflection : Vec3::Zero();
}

/// Holds on the path, then takes the probe off what it touches.
void NcUnit::stop_softly(Tick k) {
  if (stop_ == Stop::hold) {
    planned_.step = player_.step();
    if (!player_.held()) return;
    planned_.step.velocity.fill(0);
    planned_.step.feed = 0;
    if (retracting_since_ == 0) retracting_since_ = k;
    if (k - retracting_since_ < kSettleCycles) return;  // the deflection of the axes at rest
    stop_ = Stop::retract;
    retract_.emplace(machine_, planned_.step.position, touching());
    retracting_since_ = k;
  }
  const double t = seconds(k - retracting_since_);
  planned_.step.position = retract_->position(t);
  planned_.step.velocity = retract_->velocity(t);
  if (t >= retract_->duration() && ending_since_ < 0) ending_since_ = k;
}

void NcUnit::command(Tick k, Frames& out) {
  GroupCommand command{.tick = low16(k)};
  switch (state_) {
    case NcState::starting:
      command.controlword = bring_up(measured_next_);
      break;
    case NcState::alarm:
      command.controlword = stop_ == Stop::quick ? cia402::kQuickStop : cia402::kEnable;
      break;
    default:
      command.controlword = cia402::kEnable;
      break;
  }
  Compensated sent{planned_.step.position, planned_.step.velocity, {}};
  if (!compensation_.empty() && state_ != NcState::starting)
    sent = compensated(compensation_, sent.position, sent.velocity, compensating_);
  planned_.correction = sent.correction;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    command.axes[i] = {sent.position[i], sent.velocity[i]};
  command.spindle_mode = static_cast<GroupCommand::SpindleMode>(planned_.step.spindle);
  command.spindle_speed = planned_.step.spindle_speed;
  if (alarmed_) command.flags |= kSpindleLock;
  out.push_back(encode(command));
  if (heartbeat_due(k, kNcNode, heartbeat_period_))
    out.push_back(encode(Heartbeat{kNcNode, NmtState::operational}));
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
    row.q_act[i] = measured_[i].position - commanded.correction[i];
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

bool NcUnit::seen(std::size_t drive) const { return !missing_[drive + 1]; }

bool NcUnit::standing() const {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (seen(i) && std::abs(measured_next_[i].position - measured_[i].position) > 1e-3 * kCycle)
      return false;
  return true;
}

}  // namespace vcnc
