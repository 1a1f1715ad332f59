#include "diagnosis/candidates/trial.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "model/math.hpp"

namespace vcnc {
namespace {

bool is_shape(const Candidate& c, std::size_t number) {
  return std::find(c.shape.begin(), c.shape.end(), number) != c.shape.end();
}

/// Index of the phase of a candidate, or of none.
std::size_t phase_of(const Candidate& c) {
  for (std::size_t i = 0; i < c.numbers.size(); ++i)
    if (is_phase(c.numbers[i])) return i;
  return c.numbers.size();
}

bool has_part(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

/// Periods that the wave of a trial has per turn of its phase: of n lobes the phase is the
/// direction of one, A cos(n (theta - psi)).
double periods_per_turn(const Candidate& c, const Trial& trial) {
  for (std::size_t i = 0; i < c.numbers.size(); ++i)
    if (has_part(c.numbers[i].key, ".lobes")) return trial.values[i];
  return 1;
}

/// The amplitude that a wave of the base machine has most of, as one of the directions.
const Direction* amplitude_of_present(const Candidate& c, const Trial& trial) {
  const Direction* most = nullptr;
  for (const Direction& d : trial.directions)
    if (!is_shape(c, d.number) && !has_no_phase(c.numbers[d.number]) &&
        (!most || std::abs(trial.values[d.number]) > std::abs(trial.values[most->number])))
      most = &d;
  return most && trial.values[most->number] != 0 ? most : nullptr;
}

/// A wave that the base machine has already is turned by as much as the step of its amplitude
/// displaces: A sin(k x + psi + d) = A sin(k x + psi) + A d cos(k x + psi).
std::optional<Direction> turn_of_present(const Candidate& c, const Trial& trial,
                                         std::size_t phase) {
  const Direction* amplitude = amplitude_of_present(c, trial);
  if (!amplitude) return std::nullopt;
  const double angle = amplitude->step / trial.values[amplitude->number];
  return Direction{phase, false, angle / kDegree / periods_per_turn(c, trial)};
}

}  // namespace

bool is_fixed(const FreeNumber& n) {
  if (n.whole) return true;
  for (const char* part : {".reference_", ".expansion_", ".channel"})
    if (has_part(n.key, part)) return true;
  return false;
}

bool is_phase(const FreeNumber& n) {
  return has_part(n.key, ".phase_") || has_part(n.key, ".weight_imbalance.angle_");
}

bool is_place(const FreeNumber& n) {
  return has_part(n.key, ".centre_") || has_part(n.key, ".rest_");
}

bool is_wavelength(const FreeNumber& n) {
  return has_part(n.key, ".period_") || has_part(n.key, "pitch_") ||
         has_part(n.key, ".wavelength_");
}

bool has_no_phase(const FreeNumber& n) { return has_part(n.key, "_bow_"); }

bool is_limit(const FreeNumber& n) { return has_part(n.key, ".range_clip.limit_"); }

bool at_its_most(const FreeNumber& n, double value) {
  constexpr double kAtBound = 1e-3;  // of the range
  return !n.whole && !is_phase(n) && value >= n.max - kAtBound * (n.max - n.min);
}

std::vector<Trial> trials(const Machine& base, const std::vector<Candidate>& candidates,
                          const TrialValues& trial_values) {
  std::vector<Trial> all;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Candidate& candidate = candidates[c];
    Trial first{.candidate = c, .values = {}, .directions = {}};
    bool present = false;  // the base machine has it already
    for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
      // What goes along in every fit is taken anew at every shape: what the base machine has of it
      // is a multiple of a column that the trial is held against.
      const std::string& key = candidate.numbers[i].key;
      first.values.push_back(
          never_quite_absent(key) && !candidate.shape.empty() ? 0 : number_of(base, key));
      present = present || (!is_shape(candidate, i) && first.values.back() != 0 &&
                            !never_quite_absent(candidate.numbers[i].key));
    }
    const std::size_t phase = phase_of(candidate);
    for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
      if (is_shape(candidate, i) || is_fixed(candidate.numbers[i])) continue;
      const FreeNumber& n = candidate.numbers[i];
      double step = std::abs(n.typical);
      if (present) step = std::min(step, std::max(0.05 * std::abs(first.values[i]), 1e-3 * step));
      if (first.values[i] + step > n.max) step = -step;
      first.directions.push_back({i, false, step});
      if (phase < candidate.numbers.size() && !present && !has_no_phase(n))
        first.directions.push_back({i, true, step});
    }
    if (phase < candidate.numbers.size() && present)
      if (const auto turn = turn_of_present(candidate, first, phase))
        first.directions.push_back(*turn);
    std::vector<Trial> grid{first};
    for (Direction& direction : first.directions)
      if (const FreeNumber& n = candidate.numbers[direction.number]; is_limit(n) && !present) {
        direction.whole = true;
        grid.clear();
        for (const double value : trial_values(candidate, direction.number)) {
          direction.step = value - first.values[direction.number];
          grid.push_back(first);
        }
      }
    for (std::size_t i = 0; i < candidate.numbers.size() && !present; ++i) {
      const FreeNumber& n = candidate.numbers[i];
      if (!is_shape(candidate, i) || (is_fixed(n) && !n.whole) || i == phase) continue;
      std::vector<Trial> wider;
      for (const double value : trial_values(candidate, i)) {
        const double allowed = std::clamp(value, n.min, n.max);
        for (Trial t : grid) {
          t.values[i] = allowed;
          wider.push_back(std::move(t));
        }
      }
      if (!wider.empty()) grid = std::move(wider);
    }
    all.insert(all.end(), grid.begin(), grid.end());
  }
  return all;
}

Machine machine_of(const Machine& base, const Candidate& candidate, const Trial& trial,
                   const Direction& direction) {
  Machine machine = base;
  const std::size_t phase = phase_of(candidate);
  for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
    double value = trial.values[i];
    if (i == direction.number) value += direction.step;
    if (i == phase && direction.quadrature) value = 90 / periods_per_turn(candidate, trial);
    move_number(machine, candidate.numbers[i].key, value);
  }
  return machine;
}

void set_whole_numbers(Machine& machine, const Candidate& candidate, const Trial& trial) {
  for (std::size_t i = 0; i < candidate.numbers.size(); ++i)
    if (candidate.numbers[i].whole) move_number(machine, candidate.numbers[i].key, trial.values[i]);
}

std::vector<FreedNumber> start_of(const Candidate& candidate, const Trial& trial,
                                  const Eigen::VectorXd& size, const Eigen::VectorXd& worth) {
  std::vector<double> values = trial.values;
  const std::size_t phase = phase_of(candidate);
  const bool two = std::any_of(trial.directions.begin(), trial.directions.end(),
                               [](const Direction& d) { return d.quadrature; });
  double angle = 0, largest = 0;
  std::vector<double> in(values.size(), 0.0), across(values.size(), 0.0), does = in;
  for (std::size_t d = 0; d < trial.directions.size(); ++d) {
    const Direction& direction = trial.directions[d];
    const double share = direction.whole ? 1 : size[static_cast<Eigen::Index>(d)];
    const double part = share * direction.step;
    (direction.quadrature ? across : in)[direction.number] = part;
    const double part_worth = share * worth[static_cast<Eigen::Index>(d)];
    does[direction.number] = std::hypot(does[direction.number], part_worth);
  }
  if (two) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (is_shape(candidate, i) || has_no_phase(candidate.numbers[i])) continue;
      if (does[i] <= largest) continue;
      largest = does[i];
      angle = std::atan2(across[i], in[i]);
    }
    values[phase] = angle / kDegree / periods_per_turn(candidate, trial);
  }
  const bool turned = phase < values.size() && in[phase] != 0;
  if (const Direction* a = turned ? amplitude_of_present(candidate, trial) : nullptr) {
    const double was = values[a->number], along = was + in[a->number],
                 beside = was * in[phase] * kDegree * periods_per_turn(candidate, trial);
    values[phase] += std::atan2(beside, along) / kDegree / periods_per_turn(candidate, trial);
    in[a->number] = std::hypot(along, beside) - was;
  }
  std::vector<FreedNumber> numbers;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const FreeNumber& n = candidate.numbers[i];
    if (is_fixed(n) || (is_phase(n) && !two && !turned)) continue;
    const bool shape = is_shape(candidate, i);
    if (!shape)
      values[i] += has_no_phase(n) ? in[i] : in[i] * std::cos(angle) + across[i] * std::sin(angle);
    FreedNumber freed{.number = n, .value = std::clamp(values[i], n.min, n.max), .centre = 0};
    freed.number.typical = std::abs(n.typical) > 0 ? std::abs(n.typical) : 1;
    if (is_phase(n)) freed.number.typical = 57.3;
    if (shape && !is_phase(n) && !is_place(n))
      freed.number.typical = std::max(std::abs(values[i]), 1e-6);
    freed.shape = (shape && !is_phase(n)) || is_limit(n);
    numbers.push_back(freed);
  }
  return numbers;
}

}  // namespace vcnc
