#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/effect_stage.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/candidates/trial.hpp"
#include "model/effects/numbers.hpp"
#include "model/parameters.hpp"

namespace vcnc {
namespace {

constexpr double kLeastMotorShare = 1e-3;  // of the load: see AxisDrive
constexpr double kDeviation = 0.1;         // typical, of the declared value

/// Declared numbers that no effect stands for, by the end of their key.
constexpr std::array<std::string_view, 8> kDeclared{".load_kg",
                                                    ".load_kgm2",
                                                    ".motor_inertia_kgm2",
                                                    ".dead_time_ms",
                                                    "probe.spring_rate_N_per_mm",
                                                    "probe.damping_ratio",
                                                    "probe.moving_mass_g",
                                                    "probe.stylus_mass_g"};

/// A component of a number of an effect.
struct Component {
  std::size_t number = 0;
  int index = 0;
};

double in_unit(const EffectNumber& number, int index) {
  return number.get(index) / number.unit.to_si;
}

/// A size of every component at which it shows: its nominal one, or the largest of its like.
std::vector<double> typical_sizes(const std::vector<EffectNumber>& nominal,
                                  const std::vector<Component>& components) {
  std::vector<double> sizes;
  for (const Component& c : components) {
    double size = std::abs(in_unit(nominal[c.number], c.index));
    for (const Component& like : components)
      if (size == 0 && nominal[like.number].unit.suffix == nominal[c.number].unit.suffix)
        size = std::max(size, std::abs(in_unit(nominal[like.number], like.index)));
    sizes.push_back(size);
  }
  return sizes;
}

template <class Effect>
void add_candidate(const EffectPlace& place, std::vector<Candidate>& all) {
  Effect nominal = nominal_of<Effect>(place.rotary), null;
  const std::vector<EffectNumber> at_nominal = numbers_of(nominal, place.rotary);
  std::vector<Component> components;
  for (std::size_t i = 0; i < at_nominal.size(); ++i)
    for (int k = 0; k < at_nominal[i].size(); ++k) components.push_back({i, k});
  const std::vector<double> sizes = typical_sizes(at_nominal, components);

  Candidate candidate{
      std::string(Effect::text.name), std::string(place.name), {}, {}, Effect::text.family,
      is_of_loops<Effect>()};
  bool acts = false;
  for (std::size_t c = 0; c < components.size(); ++c) {
    const EffectNumber& number = at_nominal[components[c].number];
    std::string key = "effects." + std::string(place.name) + "." + std::string(Effect::text.name) +
                      "." + number.key;
    if (number.size() > 1) key += std::string(".") + "xyz"[components[c].index];
    // An amplitude makes an effect of nothing; anything else only shapes one.
    Effect alone;
    numbers_of(alone, place.rotary)[components[c].number].set(components[c].index, sizes[c]);
    const bool amplitude = !number.whole() && !alone.null();
    acts = acts || amplitude;
    if (!amplitude) candidate.shape.push_back(candidate.numbers.size());
    const double at_null =
        in_unit(numbers_of(null, place.rotary)[components[c].number], components[c].index);
    candidate.numbers.push_back(
        {std::move(key), sizes[c], number.range.min, number.range.max,
         amplitude && (at_null <= number.range.min || at_null >= number.range.max),
         number.whole()});
  }
  if (acts) all.push_back(std::move(candidate));
}

template <class Effect>
bool can_be(const EffectPlace& place, const Machine& declared) {
  if constexpr (std::is_same_v<Effect, Windup> || std::is_same_v<Effect, Backlash>) {
    const MechanicsParams& m = declared.axes[place.axis].mechanics;
    return m.reflected_inertia() > kLeastMotorShare * m.load;
  }
  if constexpr (std::is_same_v<Effect, LeadError>) return has_a_lead(declared, place.axis);
  if constexpr (std::is_same_v<Effect, MotorFriction>) {
    const AxisEffects& e = declared.effects.axis[place.axis];
    return !(e.get<Windup>().null() && e.get<Backlash>().null());  // else it is that of the load
  }
  return true;
}

}  // namespace

Range range_with_a_motor_side(const Machine& declared, const std::string& key, Range range) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const std::string of = fmt::format("axes.{}.", kAxisNames[axis]);
    if (!key.starts_with(of)) continue;
    const MechanicsParams& m = declared.axes[axis].mechanics;
    const double spare = std::sqrt(m.reflected_inertia() / (kLeastMotorShare * m.load));
    if (!(spare > 1)) continue;  // it has none
    if (key == of + "load_kg" || key == of + "load_kgm2")
      range.max = std::min(range.max, 0.99 * spare * m.load);
    if (key == of + "motor_inertia_kgm2")
      range.min = std::max(range.min, 1.01 / spare * m.motor_inertia);
  }
  return range;
}

namespace {

/// A zone lies within the travel of its axis and takes half of it at most: a wider one is friction
/// as such. A spring rests half a travel beyond it at most: else it is a weight. A wave is twice as
/// long at most, or a turn of a rotary axis and a little: a longer one is none.
void keep_within_travel(const Machine& declared, Candidate& of_axis) {
  constexpr double kTurn_deg = 400;
  const std::size_t axis = axis_named(of_axis.place);
  if (axis == kAxisCount) return;
  const double unit = is_rotary(axis) ? unit::deg.to_si : unit::mm.to_si;
  const double low = declared.axes[axis].limits.min / unit,
               high = declared.axes[axis].limits.max / unit, travel = high - low;
  for (FreeNumber& n : of_axis.numbers) {
    if (is_place(n)) n.min = low, n.max = high;
    if (n.key.find(".rest_") != std::string::npos)
      n.min -= travel / 2, n.max += travel / 2, n.typical = travel / 10;
    if (n.key.find(".width_") != std::string::npos || n.key.find(".edge_") != std::string::npos)
      n.max = std::min(n.max, travel / 2);
    if (is_wavelength(n) && si_of_unit(n.key) == unit)
      n.max = std::min(n.max, std::max(2 * travel, is_rotary(axis) ? kTurn_deg : 0));
  }
}

void add_deviations(const Machine& declared, std::vector<Candidate>& all) {
  Machine machine = declared;
  for (const Parameter& p : parameters(machine)) {
    const bool known = std::any_of(kDeclared.begin(), kDeclared.end(),
                                   [&](std::string_view end) { return p.key.ends_with(end); });
    if (!known || p.key.starts_with("effects.") || *p.value == 0) continue;
    const Range range = range_with_a_motor_side(declared, p.key, p.range);
    all.push_back({"deviation",
                   p.key,
                   {{p.key, kDeviation * std::abs(p.in_unit()), range.min, range.max, false}},
                   {},
                   Family::nc});
  }
}

}  // namespace

bool is_of_drive(const Candidate& c) {
  return c.family == Family::servo || c.family == Family::friction || c.family == Family::mechanics;
}

std::vector<Candidate> candidates(const Machine& declared) {
  std::vector<Candidate> all;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (!no_hypothesis<Effect>().empty()) return;
    for (const EffectPlace& place : places_of(Effect::place))
      if (can_be<Effect>(place, declared)) add_candidate<Effect>(place, all);
  });
  for (Candidate& c : all) keep_within_travel(declared, c);
  add_deviations(declared, all);
  return all;
}

bool holds_nothing_of(const Record& record, const std::string& place) {
  for (const MeasuredSignal& s : record.signals)
    if (is_reading(s.kind) || place_of_key(place) == kAxisNames[s.axis]) return false;
  return true;
}

bool is_sought(const Record& record, const Candidate& c) {
  const std::set<std::string> of_any_sensor{"probe_gain",     "cross_talk",  "probe_drift",
                                            "sample_latency", "clock_drift", "tip_radius"};
  if (holds_nothing_of(record, c.place)) return false;
  if (!record.on_table) return true;
  if (c.place.starts_with("probe")) return of_any_sensor.contains(c.effect);
  // About one place an axis that turns as it goes looks out of square and of another scale.
  return !(record.on_table->is_bar() && c.effect == "angular_errors");
}

std::vector<Candidate> candidates(const Machine& declared, const Record& record) {
  std::vector<Candidate> all = candidates(declared);
  std::erase_if(all, [&](const Candidate& c) { return !is_sought(record, c); });
  return all;
}

Machine as_hypothesis(const Machine& declared, const Machine& machine) {
  Machine hypothesis = declared, given = machine;
  hypothesis.effects = machine.effects;
  const std::vector<Parameter> before = parameters(hypothesis), after = parameters(given);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (*before[i].value == *after[i].value || before[i].key.starts_with("effects.")) continue;
    std::vector<Deviation>& known = hypothesis.effects.deviations;
    const bool already = std::any_of(known.begin(), known.end(),
                                     [&](const Deviation& d) { return d.key == before[i].key; });
    if (!already) known.push_back({before[i].key, after[i].in_unit()});
  }
  return hypothesis;
}

const EffectText* effect_text(const std::string& effect) {
  const EffectText* text = nullptr;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (Effect::text.name == effect) text = &Effect::text;
  });
  return text;
}

}  // namespace vcnc
