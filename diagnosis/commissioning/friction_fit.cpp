#include "diagnosis/commissioning/friction_fit.hpp"

#include <algorithm>

#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/refit.hpp"
#include "diagnosis/fit/settling.hpp"

namespace vcnc {
namespace {

/// What friction of the motor's side must explain of what is left.
constexpr double kShareOfSide = 0.02;

/// Effects of an axis that are fitted together.
struct FrictionLaw {
  std::string name;
  std::vector<std::string> effects;
};

/// The simplest that does best is taken.
const std::vector<FrictionLaw> kFrictionLaws{
    {"dry and viscous friction", {"coulomb", "viscous"}},
    {"dry, viscous and break-away friction", {"coulomb", "viscous", "stribeck"}},
    {"dry and viscous friction with pre-sliding", {"coulomb", "viscous", "presliding"}},
    {"dry, viscous and break-away friction with pre-sliding",
     {"coulomb", "viscous", "stribeck", "presliding"}}};

/// Whether a fit has left numbers where they were: what was gained is not theirs.
bool nothing_moved(const Machine& before, const std::vector<FreedNumber>& now) {
  return std::all_of(now.begin(), now.end(), [&](const FreedNumber& n) {
    return n.value == number_of(before, n.number.key);
  });
}

}  // namespace

FrictionFit::FrictionFit(MachineInFit& machine, std::string place)
    : machine_(machine), place_(std::move(place)), before_(machine.now) {}

void FrictionFit::fit() {
  Fitted best = with_best_law();
  if (best.law) machine_.accept(std::move(best.machine), place_, kFrictionLaws[*best.law].name);
}

void FrictionFit::fit_anew(const std::vector<std::size_t>& since) {
  const std::vector<std::string>& of_law = kFrictionLaws.back().effects;
  LinearPart& along = before_.nuisances;
  for (std::size_t i = 0; i < machine_.now.nuisances.numbers.size(); ++i) {
    const FreedNumber& n = machine_.now.nuisances.numbers[i];
    if (has_key(along.numbers, n.number.key) ||
        std::find(of_law.begin(), of_law.end(), effect_of_key(n.number.key)) != of_law.end())
      continue;
    along.numbers.push_back(n);
    along.columns.push_back(machine_.now.nuisances.columns[i]);
  }
  Machine& machine = before_.machine;
  for (const std::size_t c : since)
    for (const FreeNumber& n : machine_.candidates[c].numbers)
      move_number(machine, n.key, number_of(machine_.now.machine, n.key));
  machine = with(machine, along.numbers);
  Fitted best = with_best_law();
  if (!best.law || !machine_.gains_enough(machine_.now, best.machine, place_)) return;
  machine_.accept(std::move(best.machine), place_, kFrictionLaws[*best.law].name + " anew");
}

FrictionFit::Fitted FrictionFit::with_best_law(const std::vector<std::size_t>& beside) const {
  std::vector<Fitted> trials(kFrictionLaws.size(), Fitted{before_, {}});
  machine_.evidence.each_together(trials.size(), [&](std::size_t i) {
    std::vector<std::size_t> law = machine_.the(kFrictionLaws[i].effects, place_);
    if (law.empty()) return;
    law.insert(law.end(), beside.begin(), beside.end());
    FittedMachine fitted = machine_.with_candidates(before_, law);
    converge(machine_.evidence, fitted);
    if (!nothing_moved(before_.machine, fitted.numbers())) trials[i] = {std::move(fitted), i};
  });
  Fitted best{before_, {}};
  for (Fitted& trial : trials)
    if (trial.law && machine_.gains_enough(best.machine, trial.machine, place_))
      best = std::move(trial);
  return best;
}

void FrictionFit::fit_with(std::size_t gain) {
  if (!machine_.candidates[gain].of_loops) return;
  Fitted better = with_best_law({gain});
  if (!better.law || !machine_.gains_enough(machine_.now, better.machine, place_, kShareOfLeft) ||
      machine_.is_as_declared(better.machine) || machine_.stands_for_force(better.machine))
    return;
  machine_.accept(std::move(better.machine), place_,
                  kFrictionLaws[*better.law].name + " with " + told(machine_.candidates[gain]));
}

void FrictionFit::fit_part_of_motor() {
  const std::vector<std::size_t> motor = machine_.the({"motor_friction"}, place_);
  if (motor.empty()) return;
  // It does little that friction of the load does not, so no way leads there from none of it. What
  // is declared may lack its bristles alone.
  std::vector<double> shares{0.1, 0.35, 0.65};
  const std::string level = machine_.candidates[motor[0]].numbers.front().key;
  if (number_of(machine_.now.machine, level) > 0) shares.push_back(0);
  machine_.rest();
  std::vector<std::size_t> both_sides = of_load();
  both_sides.push_back(motor[0]);
  std::vector<FittedMachine> better(shares.size());
  machine_.evidence.each_together(better.size(), [&](std::size_t i) {
    better[i] = machine_.with_candidates(machine_.now, both_sides);
    move_to_motor(better[i], shares[i]);
    converge_jointly(machine_.evidence, better[i]);
  });
  const auto best = std::min_element(
      better.begin(), better.end(),
      [](const FittedMachine& a, const FittedMachine& b) { return a.held_out < b.held_out; });
  if (machine_.gains_enough(machine_.now, *best, place_, kShareOfSide))
    machine_.accept(std::move(*best), place_, "part of its friction on the motor's side");
  fit_law_beside_motor(motor[0]);
}

void FrictionFit::fit_law_beside_motor(std::size_t motor) {
  machine_.rest();
  const std::vector<std::size_t> simplest = machine_.the(kFrictionLaws.front().effects, place_),
                                 has = of_load();
  const auto is_in = [](const std::vector<std::size_t>& some, std::size_t c) {
    return std::find(some.begin(), some.end(), c) != some.end();
  };
  std::vector<FittedMachine> trials(kFrictionLaws.size(), machine_.now);
  machine_.evidence.each_together(trials.size(), [&](std::size_t i) {
    std::vector<std::size_t> law = machine_.the(kFrictionLaws[i].effects, place_);
    const bool lacks = std::any_of(has.begin(), has.end(), [&](auto c) { return !is_in(law, c); }),
               adds = std::any_of(law.begin(), law.end(),
                                  [&](auto c) { return !is_in(has, c) && !is_in(simplest, c); });
    if (lacks || !adds) return;
    law.push_back(motor);
    trials[i] = machine_.with_candidates(machine_.now, law);
    converge_jointly(machine_.evidence, trials[i]);
  });
  const auto best = std::min_element(
      trials.begin(), trials.end(),
      [](const FittedMachine& a, const FittedMachine& b) { return a.held_out < b.held_out; });
  if (!machine_.gains_enough(machine_.now, *best, place_, kShareOfSide)) return;
  const auto law = static_cast<std::size_t>(best - trials.begin());
  machine_.accept(std::move(*best), place_, kFrictionLaws[law].name + " beside that of the motor");
}

std::vector<std::size_t> FrictionFit::of_load() const {
  std::vector<std::size_t> some = machine_.the(kFrictionLaws.back().effects, place_);
  std::erase_if(some, [&](std::size_t c) {
    return number_of(machine_.now.machine, machine_.candidates[c].numbers.front().key) == 0;
  });
  return some;
}

/// A share of the dry and viscous friction of the load, on bristles of a usual stiffness.
void FrictionFit::move_to_motor(FittedMachine& m, double share) const {
  const std::string of_axis = "effects." + place_ + ".";
  for (const auto& [from, to] : {std::pair{"coulomb.level", "motor_friction.level"},
                                 std::pair{"viscous.coefficient", "motor_friction.viscous"}}) {
    double moved = 0;
    for (AddedEffect& a : m.added)
      for (FreedNumber& n : a.numbers) {
        if (n.number.key.starts_with(of_axis + from)) {
          moved = share * n.value;
          n.value -= moved;
        }
        if (n.number.key.starts_with(of_axis + to))
          n.value = number_of(m.machine, n.number.key) + moved;
        if (n.number.key.starts_with(of_axis + "motor_friction.stiffness") && n.value == 0)
          n.value = n.number.typical;
      }
  }
  m.machine = with(std::move(m.machine), m.numbers());
}

}  // namespace vcnc
