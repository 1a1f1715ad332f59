#include "controller/supplied_master.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bus/cia402.hpp"

namespace vcnc {

namespace {

bool holds_its_motor(const DriveStatus& status) {
  using cia402::State;
  const State state = cia402::state_of(status.statusword);
  return state == State::operation_enabled || state == State::quick_stop ||
         state == State::fault_reaction;
}

}  // namespace

SuppliedMaster::SuppliedMaster(const Machine& actual, const BusFaults& faults, Master& inner,
                               NcUnit& nc, TelemetrySink& sink, bool keeps)
    : supply_(actual.supply), inner_(inner), nc_(nc), sink_(sink), keeps_(keeps) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    force_limit_[i] = actual.axes[i].mechanics.force_limit;
  std::copy_if(faults.begin(), faults.end(), std::back_inserter(losses_),
               [](const BusFault& f) { return f.of_supply(); });
}

void SuppliedMaster::hear(std::span<const Frame> answers) {
  for (const Frame& frame : answers) {
    const auto status = decode_drive_status(frame);
    if (!status || !is_finite(*status)) continue;
    Motion& drive = drives_[static_cast<std::size_t>(status->node - 1)];
    drive.velocity = drive.heard ? (status->position - drive.status.position) / kCycle : 0;
    drive.status = *status;
    drive.heard = true;
  }
}

SupplyLoad SuppliedMaster::load() const {
  SupplyLoad load;
  for (const Motion& drive : drives_) load.drives += holds_its_motor(drive.status) ? 1 : 0;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    load.motion_power += drives_[i].status.force * force_limit_[i] * drives_[i].velocity;
  return load;
}

void SuppliedMaster::tell(Tick k) {
  const bool moving = std::any_of(drives_.begin(), drives_.begin() + kAxisCount,
                                  [](const Motion& d) { return std::abs(d.velocity) > 1e-3; });
  const RunStage stage = nc_.stage();
  const bool program = stage > RunStage::none && stage < RunStage::alarm;
  std::string text = fmt::format("{}, {:.3f} s after the mains were lost, {}",
                                 alarm_text(AlarmCode::supply_exhausted).title,
                                 seconds(k - lost_at_), moving ? "axes moving" : "axes at rest");
  if (program) text += fmt::format("; {}", text_of(stage));
  if (resumable(stage)) text += keeps_ ? "; state saved" : "; no memory, so no state is saved";
  if (program && !resumable(stage)) text += "; no state saved: the signal came too late";
  reason_ = fmt::format("alarm {}: {}", static_cast<int>(AlarmCode::supply_exhausted), text);
  sink_.alarm({k, static_cast<int>(AlarmCode::supply_exhausted), "supply", std::move(text)});
}

bool SuppliedMaster::step(Tick k, std::span<const Frame> answers, Frames& out) {
  hear(answers);
  const bool mains =
      std::none_of(losses_.begin(), losses_.end(), [&](const BusFault& f) { return f.active(k); });
  if (mains_ && !mains) lost_at_ = k;
  mains_ = mains;
  struck_ = struck_ || !mains;
  supply_.step(mains, load(), kCycle);
  if (supply_.dark()) {
    tell(k);
    return false;
  }
  nc_.power_fail(supply_.failing());
  return inner_.step(k, answers, out);
}

}  // namespace vcnc
