// Demonstrations: for every effect of the list the experiment that shows it, and the number that
// is read off its figure.
//
// What an effect needs to become visible follows from its port, family and place (motor feedback
// for a transmission, some friction for what changes friction, ...), so that a new effect has its
// page without a word here. What does not follow stands in one table in the source file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/experiments.hpp"

namespace vcnc {

/// A number read off the figure, SI.
struct Reading {
  std::string name;   ///< "step at the reversal"
  std::string value;  ///< "9.98 um", as it is shown
  double si = 0;
};

struct Demonstration {
  const EffectText* text = nullptr;
  std::string where;     ///< "X axis", "probe", ...
  std::string setting;   ///< its nominal parameters, as keys: "gap_um = 10"
  std::string prepared;  ///< what else was set on the machine, both times; may be empty
  Quantity quantity = Quantity::machine_error;
  Experiment without, with;
};

/// Names of all effects, by family, in the order of the list.
std::vector<const EffectText*> all_effect_texts();

/// Throws std::invalid_argument for an unknown name, naming a similar one.
Demonstration demonstration(std::string_view effect, const Machine& machine);

/// The figures read off: the most telling one first.
std::vector<Reading> readings(const Demonstration& demonstration, const std::vector<Curve>& without,
                              const std::vector<Curve>& with);

/// "µm", "arcsec", "N", "N m" and the factor to SI of what is drawn; the abscissa likewise.
struct Scale {
  const char* unit;
  double to_si;
};
Scale scale_of(const Demonstration& demonstration);
Scale abscissa_scale_of(const Demonstration& demonstration);

}  // namespace vcnc
