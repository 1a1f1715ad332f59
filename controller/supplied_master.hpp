// The NC unit on its uninterruptible supply, which a fault `supply power_loss` takes the mains
// from.
//
// This is a piece of the simulated world around the unit: it knows the truth
// (model/safety/supply.hpp) and lets the unit know the power-fail signal only. What the machine
// takes is read off the bus, as the drives tell it in each cycle: drives that hold their motors (in
// operation, quick stop or fault reaction), drive force times velocity. A drive that is not heard
// counts as it was heard last.
//
// With the store exhausted everything is dark from that cycle on: no frame, no row, no record; the
// run ends and the alarm that says so is told by the simulation, since nobody in the dark can.
// Modelled of what follows: holding brakes that close, as each drive's quick stop ramp run on its
// own. Not modelled: the brakes' delay and wear, axes that sink meanwhile. The recording PC has
// mains of its own.
#pragma once

#include <array>
#include <string>

#include "bus/fault.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/telemetry.hpp"
#include "controller/nc_unit.hpp"
#include "model/safety/supply.hpp"

namespace vcnc {

class SuppliedMaster : public Master {
 public:
  /// `actual`: the machine as it is. `inner` is `nc`, maybe behind its faults on the bus; all
  /// outlive this one. `keeps`: the unit has a memory.
  SuppliedMaster(const Machine& actual, const BusFaults& faults, Master& inner, NcUnit& nc,
                 TelemetrySink& sink, bool keeps);

  bool step(Tick k, std::span<const Frame> answers, Frames& out) override;
  void cycle_load(double share) override { inner_.cycle_load(share); }
  void node_lost(int id, const std::string& why) override { inner_.node_lost(id, why); }

  bool dark() const { return supply_.dark(); }
  const std::string& reason() const { return reason_; }  ///< how it got dark, for people
  const Supply& supply() const { return supply_; }
  bool struck() const { return struck_; }  ///< the mains have been away

 private:
  void hear(std::span<const Frame> answers);
  SupplyLoad load() const;
  void tell(Tick k);

  struct Motion {
    DriveStatus status;
    double velocity = 0;
    bool heard = false;
  };
  std::array<double, kAxisCount> force_limit_{};
  BusFaults losses_;
  Supply supply_;
  Master& inner_;
  NcUnit& nc_;
  TelemetrySink& sink_;
  bool keeps_;
  std::array<Motion, kAxisCount + 1> drives_{};  ///< axes, spindle
  Tick lost_at_ = 0;                             ///< when the mains went
  bool mains_ = true, struck_ = false;
  std::string reason_;
};

}  // namespace vcnc
