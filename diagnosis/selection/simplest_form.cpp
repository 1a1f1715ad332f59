#include "diagnosis/selection/simplest_form.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/needed_numbers.hpp"
#include "diagnosis/screening/consequence.hpp"

namespace vcnc {
namespace {

/// Of the noise of a sample: two machines that differ by less are the same.
constexpr double kSameMachine = 1e-3;
constexpr double kMoved = 0.1;  ///< of a usual size, to see whether a number moves anything
/// A number that costs less chi-square to be as declared is put back: this much, or this part of
/// what an effect must gain.
constexpr double kUnneeded = 4, kUnneededPart = 0.25;

/// Indices of the numbers that say how much of the effect there is.
std::vector<std::size_t> amplitudes_of(const AddedEffect& effect) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < effect.numbers.size(); ++i)
    if (!effect.numbers[i].shape && !is_phase(effect.numbers[i].number)) all.push_back(i);
  return all;
}

/// A number of an added effect leaves the fit, and its column with it.
void forget(FittedMachine& m, std::size_t effect, std::size_t number) {
  std::size_t column = number;
  for (std::size_t e = 0; e < effect; ++e) column += m.added[e].numbers.size();
  std::vector<FreedNumber>& numbers = m.added[effect].numbers;
  numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(number));
  if (column < m.columns.size())
    m.columns.erase(m.columns.begin() + static_cast<std::ptrdiff_t>(column));
}

/// What the record can do without, all else fitted again, is as declared.
void put_back_unneeded(const Evidence& evidence, const Machine& declared,
                       const DiagnosisOptions& options, double floor, FittedMachine& m) {
  const double cost = std::max(kUnneeded, kUnneededPart * options.least_gain);
  const bool inexact = is_inexact(evidence, options, floor, m.held_out);
  for (std::size_t e = 0; e < m.added.size(); ++e) {
    if (amplitudes_of(m.added[e]).size() < 2) continue;
    LinearPart all = m.linear();
    const Ground ground(evidence, m.residual, all);
    const auto n = static_cast<Eigen::Index>(all.numbers.size());
    for (Eigen::Index i = 0; i < n; ++i) {  // where the least is, which a fit may stop short of
      FreedNumber& number = all.numbers[static_cast<std::size_t>(i)];
      number.value += ground.step[i] * number.number.typical;
    }
    Eigen::MatrixXd information =
        ground.grams.fitted.block(1, 1, n, n) + ground.grams.held_out.block(1, 1, n, n);
    information.diagonal() += ground.precision;
    const double known_to = inexact ? kKnownTo * kKnownTo * m.added[e].gain : 0;
    const std::set<std::string> keys = needless_of(m.added[e].numbers, all.numbers, information,
                                                   declared, std::max(cost, known_to));
    if (keys.empty()) continue;
    FittedMachine less = m;
    for (std::size_t i = m.added[e].numbers.size(); i-- > 0;) {
      const std::string& key = m.added[e].numbers[i].number.key;
      if (!keys.contains(key)) continue;
      forget(less, e, i);
      move_number(less.machine, key, number_of(declared, key));
    }
    converge(evidence, less);
    if (less.held_out <= m.held_out + options.least_gain) m = std::move(less);
  }
}

void put_back_undetermined(const Evidence& evidence, const Machine& declared,
                           const DiagnosisOptions& options, double floor, FittedMachine& m) {
  while (true) {
    const std::map<std::string, Interval> intervals =
        intervals_of(evidence, m, is_inexact(evidence, options, floor, m.held_out));
    double least = 1;
    std::size_t effect = m.added.size(), number = 0;
    for (std::size_t e = 0; e < m.added.size(); ++e) {
      const std::vector<std::size_t> amplitudes = amplitudes_of(m.added[e]);
      if (amplitudes.size() < 2) continue;
      for (const std::size_t i : amplitudes) {
        const FreedNumber& n = m.added[e].numbers[i];
        const auto known = intervals.find(n.number.key);
        if (known == intervals.end()) continue;
        const double off = std::abs(n.value - number_of(declared, n.number.key)),
                     certain = off / std::max(known->second.half_width, 1e-300);
        if (certain < least) least = certain, effect = e, number = i;
      }
    }
    if (effect == m.added.size()) return;
    const std::string key = m.added[effect].numbers[number].number.key;
    FittedMachine less = m;
    forget(less, effect, number);
    move_number(less.machine, key, number_of(declared, key));
    converge(evidence, less);
    if (less.held_out > m.held_out + options.least_gain) return;
    m = std::move(less);
  }
}

/// Numbers that move nothing where the machine stands, as the period of a wave that has gone, are
/// as declared again.
void put_back_idle(const Evidence& evidence, const Machine& declared, FittedMachine& m) {
  for (std::size_t e = 0; e < m.added.size(); ++e)
    for (std::size_t i = m.added[e].numbers.size(); i-- > 0;) {
      const FreedNumber n = m.added[e].numbers[i];
      const auto moves_nothing = [&](double value) {
        Machine moved = m.machine;
        move_number(moved, n.number.key, value);
        return consequence(evidence, evidence.predict(moved), m.prediction).of_noise < kSameMachine;
      };
      const double put_back = number_of(declared, n.number.key), step = kMoved * n.number.typical;
      if (!moves_nothing(put_back) ||
          !moves_nothing(n.value + (n.value + step > n.number.max ? -step : step)))
        continue;
      forget(m, e, i);
      move_number(m.machine, n.number.key, put_back);
    }
}

/// Whether a number is an amplitude of the wave that its effect is.
bool is_of_wave(const FreedNumber& n) {
  return !n.shape && !is_phase(n.number) && !has_no_phase(n.number);
}

/// The numbers of a wave with all amplitudes turned, and the phase by half a period.
std::vector<FreedNumber> turned(std::vector<FreedNumber> numbers, std::size_t phase) {
  for (FreedNumber& n : numbers)
    if (is_of_wave(n)) n.value = -n.value;
  numbers[phase].value = std::remainder(numbers[phase].value + 180, 360);
  return numbers;
}

void prefer_positive(const Evidence& evidence, FittedMachine& m) {
  for (AddedEffect& a : m.added) {
    std::vector<FreedNumber>& numbers = a.numbers;
    const auto phase = std::find_if(numbers.begin(), numbers.end(),
                                    [](const FreedNumber& n) { return is_phase(n.number); });
    if (phase == numbers.end()) continue;
    phase->value = std::remainder(phase->value, 360);
    const auto amplitude = std::find_if(numbers.begin(), numbers.end(), is_of_wave);
    if (amplitude != numbers.end() && amplitude->value < 0) {
      std::vector<FreedNumber> other =
          turned(numbers, static_cast<std::size_t>(phase - numbers.begin()));
      const Prediction same = evidence.predict(with(m.machine, other));
      if (consequence(evidence, same, m.prediction).of_noise < kSameMachine)
        numbers = std::move(other);
    }
    m.machine = with(m.machine, numbers);
  }
}

}  // namespace

void bring_to_simplest_form(const Evidence& evidence, const Machine& declared,
                            const DiagnosisOptions& options, double floor, FittedMachine& machine) {
  put_back_unneeded(evidence, declared, options, floor, machine);
  put_back_undetermined(evidence, declared, options, floor, machine);
  put_back_idle(evidence, declared, machine);
  prefer_positive(evidence, machine);
}

}  // namespace vcnc
