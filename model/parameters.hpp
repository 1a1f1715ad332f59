// Every number of a machine by name: for perturbing it, for tables, for fits.
//
// The names are the keys of a machine file with dots between tables ("axes.Y.load_kg",
// "effects.X.backlash.gap_um"); components of a vector are named .x, .y, .z.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/machine.hpp"

namespace vcnc {

struct Parameter {
  std::string key;
  double* value;  ///< SI, in the machine it was taken from
  Unit unit;      ///< of the key
  Range range;    ///< in the unit of the key

  double in_unit() const { return *value / unit.to_si; }
};

/// The numbers of `machine`, which must outlive the result and not be moved.
std::vector<Parameter> parameters(Machine& machine);

/// A whole number: waves per turn, lobes.
struct WholeParameter {
  std::string key;
  int* value;
  Range range;
};
std::vector<WholeParameter> whole_parameters(Machine& machine);

/// One of them; empty: there is none of this key.
std::optional<Parameter> find_parameter(Machine& machine, std::string_view key);
std::optional<WholeParameter> find_whole_parameter(Machine& machine, std::string_view key);

/// Sets one number, given in the unit of its key. Throws std::invalid_argument for an unknown key
/// or a value out of range, with what is allowed.
void set_parameter(Machine& machine, const std::string& key, double value);

}  // namespace vcnc
