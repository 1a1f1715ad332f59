// The uninterruptible supply: a store of energy that feeds the machine while the mains are away.
//
//   dE/dt = -(P_e + n P_d + max(0, sum F_i v_i) / eta)     while the mains are away
//   dE/dt = 0                                              while they are there
//
//   E      energy the store can still give [J]; E(0) = hold_up_energy
//   P_e    electronics: NC unit, probe, overtravel module, drive electronics [W]
//   P_d    what each of the n drives takes that hold their motors [W]
//   F_i v_i mechanical power of axis i, drive force (torque) times velocity [W]
//   eta    efficiency from the store to the motion
//
// What braking axes give back heats a resistor: it feeds neither the store nor the electronics, and
// it does balance axes that take power at the same moment, since they share the intermediate
// circuit. The power-fail signal comes when the mains have been away for the signal's delay, goes
// with their return, and is all that the NC unit gets to know. With E = 0 everything is dark and
// stays so: only switching the machine on again ends it. Where hold_up_energy is 0 there is no
// store, and dark comes with the loss.
//
// The charger takes hours and a run minutes: within a run what was used is not charged again, so
// losses of the mains add up. Every run begins with a full store.
//
// Powers are constant over a step. Valid for a store whose converter keeps its efficiency down to
// the end (0.85 is usual) and gives the peak power that accelerating axes want. Not modelled:
// ageing, voltage sag, the spindle's motion power.
// Source: hold-up time t = C (V1^2 - V2^2) eta / 2 P of a buffered 24 V supply, as an energy
// balance.
#pragma once

#include "model/machine.hpp"

namespace vcnc {

/// What the machine takes at one moment.
struct SupplyLoad {
  int drives = 0;           ///< that hold their motors
  double motion_power = 0;  ///< sum F_i v_i [W], negative while braking gives back
};

class Supply {
 public:
  explicit Supply(const SupplyParams& params);

  /// `dt` seconds with or without mains, while the machine takes `load`.
  void step(bool mains, const SupplyLoad& load, double dt);

  double energy() const { return energy_; }  ///< left [J]
  bool failing() const;                      ///< the power-fail signal
  bool dark() const { return dark_; }
  /// What the store gives for a load [W].
  double power(const SupplyLoad& load) const;

 private:
  SupplyParams params_;
  double energy_;
  double away_ = 0;  ///< how long the mains have been away [s]
  bool dark_ = false;
};

}  // namespace vcnc
