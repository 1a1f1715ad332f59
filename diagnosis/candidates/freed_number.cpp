#include "diagnosis/candidates/freed_number.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "diagnosis/candidates/candidate.hpp"
#include "model/fields.hpp"
#include "model/parameters.hpp"

namespace vcnc {
namespace {

struct Tolerance {
  std::string_view prefix, part;
  double size;
};

constexpr Tolerance kTolerances[] = {
    {"axes.", ".load_kg", 0.01},
    {"axes.", ".motor_inertia_kgm2", 0.01},
    {"effects.", ".coulomb.level", 0.03},
    {"effects.", ".stribeck.excess", 0.10},
    {"effects.", ".viscous.coefficient", 0.05},
    {"effects.", ".presliding.stiffness", 0.10},
    {"effects.", ".motor_friction.level", 0.03},
    {"effects.", ".motor_friction.viscous", 0.05},
    {"effects.", ".motor_friction.stiffness", 0.10},
    {"effects.", ".grease_drag.level", 0.05},
    {"effects.", ".nonlinear_viscous.force", 0.05},
    {"effects.", ".windup.compliance", 0.02},
    {"effects.", ".windup.damping_ratio", 0.50},
    {"effects.", ".backlash.gap", 0.02},
};
/// Tolerances in the unit of the key, of effects that are never quite absent.
constexpr Tolerance kResidues[] = {
    {"effects.setup.piece_offset.", ".shift_um", 100},
    {"effects.setup.piece_tilt.", ".tilt_urad", 500},
    {"effects.", ".scale_error.error_ppm", 1.5},
    {"effects.", ".lead_error.error_ppm", 30},
    {"effects.probe.tip_radius.", ".larger_um", 1},
    {"effects.X.", ".thermal_drift.offset_um", 3},
    {"effects.Y.", ".thermal_drift.offset_um", 3},
    {"effects.Z.", ".thermal_drift.offset_um", 3},
};

/// The same of what a builder reckons and nobody has measured, before a machine is commissioned.
constexpr Tolerance kReckonings[] = {
    {"effects.", ".windup.compliance", 0.06},
    {"effects.", ".backlash.gap", 0.06},
    {"effects.", ".weight_imbalance.force", 0.05},
    {"effects.", ".weight_imbalance.torque", 0.05},
};
constexpr double kReckonedAngle = 2;   // of a weight [deg]
constexpr double kReckonedScale = 15;  // of a linear axis, a screw above all [ppm]

double reckoned(const Machine& machine, const std::string& key, double value) {
  for (const Tolerance& t : kReckonings)
    if (key.starts_with(t.prefix) && key.find(t.part) != std::string::npos)
      return t.size * std::abs(value);
  if (key.find(".scale_error.error_ppm") != std::string::npos) return kReckonedScale;
  const bool hangs =
      key.find(".weight_imbalance.angle_deg") != std::string::npos &&
      machine.effects.axis[axis_named(place_of_key(key))].get<WeightImbalance>().force != 0;
  return hangs ? kReckonedAngle : 0;
}

double tolerance_of(const std::string& key, double value) {
  for (const Tolerance& t : kResidues)
    if (key.starts_with(t.prefix) && key.find(t.part) != std::string::npos) return t.size;
  for (const Tolerance& t : kTolerances)
    if (key.starts_with(t.prefix) && key.find(t.part) != std::string::npos)
      return t.size * std::abs(value);
  return 0;
}

/// Of a machine or of a const one; null where there is none.
template <class M>
auto deviation_of(M& machine, const std::string& key)
    -> decltype(machine.effects.deviations.data()) {
  for (auto& d : machine.effects.deviations)
    if (d.key == key) return &d;
  return nullptr;
}

const Uncertainty* uncertainty_of(const Machine& machine, const std::string& key) {
  for (const Uncertainty& u : machine.uncertainties)
    if (u.key == key) return &u;
  return nullptr;
}

/// A size at which a number shows of which only the bounds are known.
double typical_within(const Range& range, double value) {
  constexpr double kOfValue = 0.1, kOfRange = 0.05;
  const double of_range = kOfRange * (range.max - range.min);
  return value != 0 ? std::min(kOfValue * std::abs(value), of_range) : of_range;
}

/// Where a number is said to deviate, it is the deviation that is moved.
void put(const Parameter& p, Deviation* deviation, double value) {
  const double within = std::clamp(value, p.range.min, p.range.max);
  if (deviation)
    deviation->value = within;
  else
    *p.value = within * p.unit.to_si;
}

}  // namespace

double si_of_unit(const std::string& key) {
  if (key.ends_with("_mm")) return unit::mm.to_si;
  if (key.ends_with("_um")) return unit::um.to_si;
  if (key.ends_with("_deg")) return unit::deg.to_si;
  if (key.ends_with("_arcsec")) return unit::arcsec.to_si;
  return 1;
}

std::string place_of_key(const std::string& key) {
  const std::size_t from = key.find('.') + 1;
  return key.substr(from, key.find('.', from) - from);
}

std::string effect_of_key(const std::string& key) {
  const std::size_t from = key.find('.', key.find('.') + 1) + 1;
  return key.substr(from, key.find('.', from) - from);
}

bool is_clamping(const std::string& key) { return key.starts_with("effects.setup."); }

bool has_a_lead(const Machine& declared, std::size_t axis) {
  return declared.axes[axis].servo.feedback == ServoParams::Feedback::load &&
         declared.axes[axis].mechanics.motor_inertia > 0;
}

bool never_quite_absent(const std::string& key) {
  return std::any_of(std::begin(kResidues), std::end(kResidues), [&](const Tolerance& t) {
    return key.starts_with(t.prefix) && key.find(t.part) != std::string::npos;
  });
}

double number_of(const Machine& machine, const std::string& key) {
  if (const Deviation* d = deviation_of(machine, key)) return d->value;
  if (key.starts_with(kCommon)) return 0;
  Machine copy = machine;
  if (const auto p = find_parameter(copy, key)) return p->in_unit();
  if (const auto p = find_whole_parameter(copy, key)) return *p->value;
  throw std::invalid_argument(key + ": is not a number of a machine file");
}

void move_number(Machine& machine, const std::string& key, double value) {
  Deviation* deviation = deviation_of(machine, key);
  if (key.starts_with(kCommon)) {
    if (!deviation) deviation = &machine.effects.deviations.emplace_back(Deviation{key, 0});
    deviation->value = value;
    return;
  }
  if (const auto p = find_parameter(machine, key)) return put(*p, deviation, value);
  const auto p = find_whole_parameter(machine, key);
  if (!p) throw std::invalid_argument(key + ": is not a number of a machine file");
  *p->value = static_cast<int>(std::lround(std::clamp(value, p->range.min, p->range.max)));
}

Machine with(Machine machine, const std::vector<FreedNumber>& numbers) {
  for (const FreedNumber& n : numbers)
    if (n.common()) move_number(machine, n.number.key, n.value);
  for (const FreedNumber& n : numbers) {
    if (n.common()) continue;
    const auto p = find_parameter(machine, n.number.key);
    if (!p) throw std::invalid_argument(n.number.key + ": is not a number of a machine file");
    put(*p, deviation_of(machine, n.number.key), n.value);
  }
  return machine;
}

void adopt(std::vector<FreedNumber>& numbers, const std::vector<FreedNumber>& from) {
  for (FreedNumber& n : numbers)
    for (const FreedNumber& f : from)
      if (f.number.key == n.number.key) n.value = f.value;
}

void take_values(std::vector<FreedNumber>& numbers, const Machine& machine) {
  Machine copy = machine;
  for (FreedNumber& n : numbers)
    if (const auto p = find_parameter(copy, n.number.key)) n.value = p->in_unit();
  for (FreedNumber& n : numbers)
    if (n.common() || deviation_of(machine, n.number.key))
      n.value = number_of(machine, n.number.key);
}

bool has_key(const std::vector<FreedNumber>& numbers, const std::string& key) {
  return std::any_of(numbers.begin(), numbers.end(),
                     [&](const FreedNumber& n) { return n.number.key == key; });
}

std::string unit_of_key(const std::string& key) {
  static const std::vector<std::pair<std::string, std::string>> units = [] {
    Machine machine;
    std::vector<std::pair<std::string, std::string>> all;
    for (const Parameter& p : parameters(machine)) all.emplace_back(p.key, p.unit.suffix);
    std::sort(all.begin(), all.end());
    return all;
  }();
  const auto at = std::lower_bound(units.begin(), units.end(), std::pair(key, std::string()));
  return at != units.end() && at->first == key ? at->second : "";
}

Machine with_fitted(Machine other, const Machine& declared, const Machine& fitted) {
  constexpr double kSame = 1e-9;  // of a number, as files write it
  Machine all = declared;
  for (const Parameter& p : parameters(all)) {
    const double was = number_of(declared, p.key), is = number_of(fitted, p.key),
                 says = number_of(other, p.key);
    if (is != was && std::abs(says - was) <= kSame * std::abs(was)) move_number(other, p.key, is);
  }
  return other;
}

namespace {

bool is_of_rotor(const std::string& key) {
  return key.starts_with("axes.") && key.find(".motor_inertia") != std::string::npos;
}

bool is_no_lead(const Machine& declared, const std::string& key) {
  const std::size_t axis = axis_named(place_of_key(key));
  return key.find(".lead_error.") != std::string::npos && axis < kAxisCount &&
         !has_a_lead(declared, axis);
}

}  // namespace

std::vector<FreedNumber> nuisances(const Machine& declared, Against against) {
  Machine copy = declared;
  std::vector<FreedNumber> all;
  for (const Parameter& p : parameters(copy)) {
    const Deviation* d = deviation_of(declared, p.key);
    const double value = d ? d->value : p.in_unit();
    const Uncertainty* told =
        against == Against::healthy_run ? nullptr : uncertainty_of(declared, p.key);
    // A rotor is the same in both runs; what is on a table may be another.
    if (against == Against::healthy_run && is_of_rotor(p.key)) continue;
    if (is_no_lead(declared, p.key)) continue;
    const double tolerance =
        told ? told->standard
        : against == Against::reckoning
            ? std::max(reckoned(declared, p.key, value), tolerance_of(p.key, value))
            : tolerance_of(p.key, value);
    const bool free = told && told->free();
    if (tolerance <= 0 && !free) continue;
    // Counted in what is small, so that differences are taken near the declaration.
    const bool clamped = is_clamping(p.key);
    const Range range = range_with_a_motor_side(
        declared, p.key,
        told && !told->between.empty() ? Range{told->between[0], told->between[1]} : p.range);
    all.push_back({.number = {.key = p.key,
                              .typical = clamped ? 10
                                         : free  ? typical_within(range, value)
                                                 : tolerance,
                              .min = range.min,
                              .max = range.max},
                   .value = value,
                   .centre = value,
                   .tolerance = tolerance});
  }
  return all;
}

}  // namespace vcnc
