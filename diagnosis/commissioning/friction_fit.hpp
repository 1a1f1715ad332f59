// The friction of one axis of a healthy machine.
//
// Of the laws - dry and viscous, with break-away, with pre-sliding, with both - the simplest that
// does best on held-out data. Friction that was fitted without something else (a gain, a ripple)
// may imitate it so well that no way leads from there to that: then both are fitted from where the
// axis was before.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/commissioning/machine_in_fit.hpp"

namespace vcnc {

class FrictionFit {
 public:
  /// Of a machine in which nothing was added on the axis `place`; it must outlive this.
  FrictionFit(MachineInFit& machine, std::string place);

  void fit();
  /// The law beside all that was found since, which goes along; of those `since` are on the axis.
  void fit_anew(const std::vector<std::size_t>& since);
  /// Beside a gain.
  void fit_with(std::size_t gain);
  /// Of an elastic transmission, what part of its friction is before it, and what law the load has
  /// beside that.
  void fit_part_of_motor();

 private:
  /// The axis as it was before, with the law that does best there; without one where none does
  /// anything.
  struct Fitted {
    FittedMachine machine;
    std::optional<std::size_t> law;
  };
  Fitted with_best_law(const std::vector<std::size_t>& beside = {}) const;
  /// The law was chosen where all of the friction was the load's: a richer one beside the motor's.
  void fit_law_beside_motor(std::size_t motor);
  /// Effects of the law that the load has.
  std::vector<std::size_t> of_load() const;
  void move_to_motor(FittedMachine& m, double share) const;

  MachineInFit& machine_;
  std::string place_;
  FittedMachine before_;
};

}  // namespace vcnc
