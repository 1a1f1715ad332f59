#include "diagnosis/selection/contest_rules.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kChance = 3;  ///< standard deviations of a sum of squares

/// Where so much is left.
double threshold_of(const DiagnosisOptions& options, double left) {
  return std::max({options.least_gain, options.least_share * left,
                   options.share_of_form * std::min(left, options.form)});
}

/// Channels where the residual loses something that goes from `before` to `after`.
std::vector<std::size_t> shown_in(const std::vector<double>& before,
                                  const std::vector<double>& after) {
  double gain = 0;
  for (std::size_t c = 0; c < before.size(); ++c) gain += std::max(0.0, before[c] - after[c]);
  std::vector<std::size_t> channels;
  for (std::size_t c = 0; c < before.size(); ++c)
    if (before[c] - after[c] > kConcerned * gain) channels.push_back(c);
  return channels;
}

}  // namespace

double ContestRules::excess(double held_out) const { return std::max(0.0, held_out - floor); }

double ContestRules::threshold(double held_out) const {
  return threshold_of(options, excess(held_out));
}

double ContestRules::left_where_gained(const std::vector<double>& before,
                                       const std::vector<double>& after) const {
  double left = 0;
  for (const std::size_t c : shown_in(before, after))
    left += std::max(0.0, before[c] - floor_of[c]);
  return left;
}

double ContestRules::threshold(const std::vector<double>& before,
                               const std::vector<double>& after) const {
  return threshold_of(options, left_where_gained(before, after));
}

bool ContestRules::stands_out(const std::vector<double>& before,
                              const std::vector<double>& after) const {
  double gain = 0, above = 0, samples = 0;
  for (const std::size_t c : shown_in(before, after)) {
    gain += before[c] - after[c];
    above += before[c] - evidence.scatter(c, Role::held_out);
    samples += evidence.count(c, Role::held_out);
  }
  return above + kChance * std::sqrt(2 * samples) > 0.5 * gain;
}

}  // namespace vcnc
