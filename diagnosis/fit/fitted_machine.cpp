#include "diagnosis/fit/fitted_machine.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/fit/ground.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Angles that went so far that the end of what is allowed is near, a turn back.
void turn_back(std::vector<FreedNumber>& numbers) {
  constexpr double kNearEnd = 270, kTurn = 360;  // [deg]
  for (FreedNumber& n : numbers)
    if (is_phase(n.number) && n.tolerance == 0 && std::abs(n.value) > kNearEnd)
      n.value = std::remainder(n.value, kTurn);
}

bool is_axis(const std::string& place) { return axis_named(place) < kAxisCount; }

}  // namespace

std::vector<Explained> FittedMachine::explained() const {
  std::vector<Explained> all;
  for (const AddedEffect& a : added) all.push_back(a.explained);
  for (const ReleasedNumber& r : released) all.push_back(r.explained);
  return all;
}

std::vector<ActingSlices> FittedMachine::acting() const {
  std::vector<ActingSlices> all;
  for (const AddedEffect& a : added) all.push_back(a.acts);
  all.resize(found());
  return all;
}

std::set<std::string> places_found(const FittedMachine& m) {
  std::set<std::string> places;
  for (const FreedNumber& n : m.numbers()) places.insert(place_of_key(n.number.key));
  for (const ReleasedNumber& r : m.released) places.insert(place_of_key(r.key));
  return places;
}

std::string drive_of(const std::string& key, const std::vector<Candidate>& candidates) {
  const bool of_drive =
      key.starts_with("axes.") ||
      std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
        return is_of_drive(c) && std::any_of(c.numbers.begin(), c.numbers.end(),
                                             [&](const FreeNumber& n) { return n.key == key; });
      });
  return of_drive ? place_of_key(key) : "";
}

std::set<std::string> drives_found(const FittedMachine& m,
                                   const std::vector<Candidate>& candidates) {
  std::set<std::string> drives;
  for (const AddedEffect& a : m.added)
    if (is_of_drive(candidates[a.candidate])) drives.insert(candidates[a.candidate].place);
  for (const ReleasedNumber& r : m.released)
    if (const std::string drive = drive_of(r.key, candidates); !drive.empty()) drives.insert(drive);
  return drives;
}

std::vector<Column> FittedMachine::columns_of(std::size_t which) const {
  std::size_t first = 0;
  for (std::size_t i = 0; i < which; ++i) first += added[i].numbers.size();
  const std::size_t end = std::min(first + added[which].numbers.size(), columns.size());
  std::vector<Column> all;
  for (std::size_t c = first; c < end; ++c) all.push_back(columns[c]);
  return all;
}

std::vector<FreedNumber> FittedMachine::numbers() const {
  std::vector<FreedNumber> all;
  for (const AddedEffect& a : added) all.insert(all.end(), a.numbers.begin(), a.numbers.end());
  return all;
}

FittedMachine FittedMachine::without_effect(std::size_t i) const {
  FittedMachine less = *this;
  std::size_t first = 0;
  for (std::size_t j = 0; j < i; ++j) first += added[j].numbers.size();
  const auto from = less.columns.begin() + static_cast<std::ptrdiff_t>(first);
  less.columns.erase(from, from + static_cast<std::ptrdiff_t>(added[i].numbers.size()));
  less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
  return less;
}

FittedMachine FittedMachine::holding(const std::string& key, const FittedMachine& base) const {
  FittedMachine held = *this;
  std::erase_if(held.released, [&](const ReleasedNumber& r) { return r.key == key; });
  for (FreedNumber& n : held.nuisances.numbers)
    for (const FreedNumber& as : base.nuisances.numbers)
      if (n.number.key == key && as.number.key == key) n.tolerance = as.tolerance, n.held = true;
  return held;
}

LinearPart FittedMachine::linear() const {
  LinearPart all = nuisances;
  const std::vector<FreedNumber> more = numbers();
  for (std::size_t i = 0; i < more.size() && i < columns.size(); ++i) {
    all.numbers.push_back(more[i]);
    all.columns.push_back(columns[i]);
  }
  return all;
}

std::vector<FittedMachine> moved_to(const Evidence& evidence, const FittedMachine& m,
                                    const std::vector<Refit>& found) {
  std::vector<FittedMachine> all(found.size(), m);
  std::vector<Machine> machines;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Refit& f = found[i];
    FittedMachine& at = all[i];
    for (AddedEffect& a : at.added) adopt(a.numbers, f.live), turn_back(a.numbers);
    adopt(at.nuisances.numbers, f.linear);
    adopt(at.nuisances.numbers, f.live);
    turn_back(at.nuisances.numbers);
    at.machine = with(with(f.machine, at.numbers()), at.nuisances.numbers);
    machines.push_back(at.machine);
  }
  std::vector<Prediction> predictions = evidence.predict_all(machines);
  for (std::size_t i = 0; i < found.size(); ++i) {
    FittedMachine& at = all[i];
    at.prediction = std::move(predictions[i]);
    at.residual = evidence.residual(at.prediction);
    at.columns = found[i].columns;
    at.held_out = Ground(evidence, at.residual, at.linear()).held_out;
  }
  return all;
}

void stay(const Evidence& evidence, FittedMachine& m) {
  for (AddedEffect& a : m.added) take_values(a.numbers, m.machine);
  m.prediction = evidence.predict(m.machine);
  m.residual = evidence.residual(m.prediction);
  m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
}

void anchor_at(Evidence& evidence, FittedMachine& m) {
  evidence.anchor(m.machine);
  m.prediction = evidence.predict(m.machine);
  m.residual = evidence.residual(m.prediction);
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
}

void linearise(const Evidence& evidence, FittedMachine& m, const std::vector<std::size_t>& which) {
  std::vector<FreedNumber> numbers;
  for (const std::size_t i : which) numbers.push_back(m.nuisances.numbers[i]);
  std::vector<Column> columns = columns_of(evidence, m.machine, m.prediction, numbers);
  m.nuisances.columns.resize(m.nuisances.numbers.size());
  for (std::size_t i = 0; i < which.size(); ++i)
    m.nuisances.columns[which[i]] = std::move(columns[i]);
}

std::vector<std::size_t> concerned(const FittedMachine& m) {
  const std::set<std::string> places = places_found(m);
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    const std::string place = place_of_key(m.nuisances.numbers[i].number.key);
    if (!is_axis(place) || places.contains(place)) all.push_back(i);
  }
  return all;
}

std::vector<std::size_t> every(const FittedMachine& m) {
  std::vector<std::size_t> all(m.nuisances.numbers.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

void add_common(const Evidence& evidence, FittedMachine& m,
                const std::vector<FreedNumber>& common) {
  const std::set<std::string> places = places_found(m);
  for (const FreedNumber& n : common) {
    const std::string place = place_of_key(n.number.key);
    if (has_key(m.nuisances.numbers, n.number.key) || (is_axis(place) && !places.contains(place)))
      continue;
    m.nuisances.numbers.push_back(n);
    m.nuisances.columns.emplace_back(
        Column::Channels(evidence.replica().channels().size()));  // until it is linearised
  }
}

void hold_common(FittedMachine& m) {
  const std::set<std::string> places = places_found(m);
  std::vector<FreedNumber> held;
  for (FreedNumber n : m.nuisances.numbers) {
    const std::string place = place_of_key(n.number.key);
    if (!n.common() || places.contains(place) || (!is_axis(place) && !places.empty())) continue;
    n.value = n.centre;
    held.push_back(n);
  }
  m.machine = with(m.machine, held);
  m.nuisances = without(m.nuisances, held);
}

}  // namespace vcnc
