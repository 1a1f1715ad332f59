#include "diagnosis/healthy/common_numbers.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include "model/parameters.hpp"

namespace vcnc {
namespace {

/// Part of a tolerance that is left where the healthy run was fitted.
constexpr double kFitted = 0.2;
constexpr double kStep = 0.1;            // of a tolerance, to see what a number does
constexpr std::size_t kRemembered = 64;  // series

/// Of what is declared, or in the unit of the key.
struct CommonTolerance {
  std::string_view prefix, end;
  double share, size;
};
constexpr CommonTolerance kCommonTolerances[] = {
    {"probe.damping_ratio", "", 0.5, 0},
    {"axes.", ".current_lag_us", 0.3, 0},
    {"axes.", ".position_lag_us", 0, 500},
    {"axes.", ".velocity_lag_us", 0, 500},
    {"effects.", ".windup.compliance_nm_per_N", 0.1, 0},
    {"effects.", ".windup.compliance_urad_per_Nm", 0.1, 0},
    {"effects.", ".presliding.stiffness_N_per_um", 0.5, 0},
    {"effects.", ".presliding.stiffness_Nm_per_rad", 0.5, 0},
    {"effects.", ".motor_friction.stiffness_N_per_um", 0.5, 0},
    {"effects.", ".motor_friction.stiffness_Nm_per_rad", 0.5, 0},
};

/// In the unit of the key.
double tolerance_in_common(const std::string& key, double value) {
  for (const CommonTolerance& t : kCommonTolerances)
    if (key.starts_with(t.prefix) && key.ends_with(t.end)) return t.share * value + t.size;
  return 0;
}

std::string own_key(const FreedNumber& n) { return n.number.key.substr(kCommon.size()); }

}  // namespace

std::vector<FreedNumber> common_numbers(const Machine& healthy) {
  Machine copy = healthy;
  std::vector<FreedNumber> all;
  for (const Parameter& p : parameters(copy)) {
    if (tolerance_in_common(p.key, 1) <= 0) continue;
    const double value = number_of(healthy, p.key),
                 tolerance = (healthy.commissioned.empty() ? 1 : kFitted) *
                             tolerance_in_common(p.key, value);
    if (tolerance <= 0) continue;
    all.push_back({.number = {.key = std::string(kCommon) + p.key,
                              .typical = tolerance,
                              .min = p.range.min - value,
                              .max = p.range.max - value},
                   .tolerance = tolerance});
  }
  return all;
}

Machine without_common(Machine hypothesis) {
  std::erase_if(hypothesis.effects.deviations,
                [](const Deviation& d) { return d.key.starts_with(kCommon); });
  return hypothesis;
}

bool is_common(const std::vector<FreedNumber>& common, const std::string& key) {
  return has_key(common, std::string(kCommon) + key);
}

ReplicaOfChange::ReplicaOfChange(Replica& replica, const Machine& healthy,
                                 std::vector<FreedNumber> common)
    : replica_(replica), common_(std::move(common)) {
  anchor(healthy);
  std::vector<std::size_t> all(common_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  at_healthy_ = derivatives(healthy, all);
}

bool ReplicaOfChange::anchor(const Machine& machine) {
  anchor_ = without_common(machine);
  const bool moved = replica_.anchor(anchor_);
  if (moved || of_change_.empty()) {
    of_change_.assign(common_.size(), {});
    latest_.clear();
  }
  return moved;
}

Prediction ReplicaOfChange::predict(const Machine& hypothesis) const {
  return std::move(predict_all({hypothesis})[0]);
}

std::vector<Prediction> ReplicaOfChange::predict_all(const std::vector<Machine>& hypotheses) const {
  std::vector<Machine> declared;
  for (const Machine& h : hypotheses) declared.push_back(without_common(h));
  std::vector<Prediction> all = replica_.predict_all(declared);
  const std::lock_guard lock(guard_);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::vector<double> off = off_healthy(hypotheses[i]);
    derive(off);
    for (std::size_t c = 0; c < all[i].size(); ++c) all[i][c] = corrected(all[i][c], c, off);
  }
  return all;
}

std::vector<double> ReplicaOfChange::off_healthy(const Machine& hypothesis) const {
  std::vector<double> off;
  for (const FreedNumber& n : common_) off.push_back(number_of(hypothesis, n.number.key));
  return off;
}

std::vector<SeriesOfChannels> ReplicaOfChange::derivatives(
    const Machine& about, const std::vector<std::size_t>& numbers) const {
  std::vector<Machine> moved{about};
  for (const std::size_t j : numbers) {
    moved.push_back(about);
    const std::string key = own_key(common_[j]);
    move_number(moved.back(), key, number_of(about, key) + kStep * common_[j].tolerance);
  }
  const std::vector<Prediction> answers = replica_.predict_all(moved);
  std::vector<SeriesOfChannels> all;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    SeriesOfChannels& change = all.emplace_back(channels().size());
    const double step = kStep * common_[numbers[i]].tolerance;
    for (std::size_t c = 0; c < change.size(); ++c) {
      if (answers[i + 1][c].shares(answers[0][c])) continue;
      const std::vector<double>&now = answers[i + 1][c], &before = answers[0][c];
      for (std::size_t k = 0; k < now.size(); ++k) change[c].push_back((now[k] - before[k]) / step);
    }
  }
  return all;
}

/// Of those numbers that are off and were not asked for since the last anchor.
void ReplicaOfChange::derive(const std::vector<double>& off) const {
  std::vector<std::size_t> unknown;
  for (std::size_t j = 0; j < off.size(); ++j)
    if (off[j] != 0 && of_change_[j].empty()) unknown.push_back(j);
  if (unknown.empty()) return;
  std::vector<SeriesOfChannels> here = derivatives(anchor_, unknown);
  for (std::size_t i = 0; i < unknown.size(); ++i) {
    const SeriesOfChannels& there = at_healthy_[unknown[i]];
    for (std::size_t c = 0; c < there.size(); ++c) {
      if (there[c].empty()) continue;
      here[i][c].resize(there[c].size(), 0.0);
      for (std::size_t k = 0; k < there[c].size(); ++k) here[i][c][k] -= there[c][k];
    }
    of_change_[unknown[i]] = std::move(here[i]);
  }
}

SharedSeries ReplicaOfChange::corrected(const SharedSeries& series, std::size_t channel,
                                        const std::vector<double>& off) const {
  std::vector<double> here(off.size(), 0.0);
  for (std::size_t j = 0; j < off.size(); ++j)
    if (off[j] != 0 && !of_change_[j][channel].empty()) here[j] = off[j];
  if (std::all_of(here.begin(), here.end(), [](double d) { return d == 0; })) return series;
  for (const Corrected& known : latest_)
    if (known.from.shares(series) && known.off == here) return known.to;
  std::vector<double> sum = series;
  for (std::size_t j = 0; j < here.size(); ++j)
    for (std::size_t k = 0; here[j] != 0 && k < sum.size(); ++k)
      sum[k] += here[j] * of_change_[j][channel][k];
  if (latest_.size() == kRemembered) latest_.erase(latest_.begin());
  latest_.push_back({series, std::move(here), std::move(sum)});
  return latest_.back().to;
}

}  // namespace vcnc
