// What may be the matter with a machine: every effect of the library at every place it fits, and
// every declared number that may be another one.
//
// A candidate is a set of machine-file keys with start values and bounds; trying it is setting them
// on a copy of the declared machine. Left out are
//
// - effects that no prediction can show, with the reason: no_hypothesis() in effect_stage.hpp;
// - wind-up and backlash of an axis whose motor side is next to nothing: there are no two masses;
// - effects of nothing but whole numbers: bus latency, which a command delay describes as well, and
//   the slip of a period, which is sought by itself (period_slip_search.hpp);
// - declared numbers that an effect stands for: gains, feed-forwards, force limit, torque constant,
//   ball radius, positions of the rotary axes, of the piece and of the probe.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// One number that a candidate frees.
struct FreeNumber {
  std::string key;     ///< "effects.X.backlash.gap_um"
  double typical = 0;  ///< a size at which it shows, in the unit of the key
  double min = 0, max = 0;
  bool one_sided = false;  ///< its null value is at a bound
  bool whole = false;      ///< lobes, waves per turn: tried at several values, never fitted
};

struct Candidate {
  std::string effect;  ///< its name in the library; of a declared number: "deviation"
  std::string place;   ///< "X", "geometry", "probe", ...; of a declared number: its key
  std::vector<FreeNumber> numbers;
  /// Numbers that a null effect leaves without a meaning and that are tried at several values: the
  /// frequency of a vibration, the time constant of a drift.
  std::vector<std::size_t> shape;  ///< indices into numbers
  Family family = Family::nc;      ///< of the effect
  bool of_loops = false;  ///< it acts on gains or set-points of a drive (controller_check.hpp)

  std::string name() const { return place.empty() ? effect : place + "." + effect; }
};

/// Whether it is of the drive of an axis: servo, friction or mechanics.
bool is_of_drive(const Candidate& candidate);

/// The range of a number of a machine file, kept so that play and compliance find a motor side that
/// is heavy enough (AxisDrive) whatever else is changed.
Range range_with_a_motor_side(const Machine& declared, const std::string& key, Range range);

/// The candidates of a machine, in the order of the library.
std::vector<Candidate> candidates(const Machine& declared);

/// Those of them that are sought in a record.
std::vector<Candidate> candidates(const Machine& declared, const Record& record);

/// Whether a record can tell of a candidate, as far as it holds anything of its place; of sensors
/// other than a probe (on the table, a bar) no more than what any sensor has.
bool is_sought(const Record& record, const Candidate& candidate);

/// Whether a record without readings holds nothing of a place: of another axis, of a probe, of the
/// geometry. Where something was read, an axis that stands shows, too. `place`: of a candidate.
bool holds_nothing_of(const Record& record, const std::string& place);

/// A machine with numbers outside [effects] other than declared, as a hypothesis: the declared
/// machine, with the effects of `machine` and with a deviation for each of those numbers. Its
/// controllers know what is declared, its bodies are as `machine` says.
Machine as_hypothesis(const Machine& declared, const Machine& machine);

/// What the library says of an effect; null: it has none of that name.
const EffectText* effect_text(const std::string& effect);

}  // namespace vcnc
