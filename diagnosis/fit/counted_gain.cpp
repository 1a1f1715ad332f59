#include "diagnosis/fit/counted_gain.hpp"

#include <algorithm>

namespace vcnc {

namespace {

/// Times what a found law leaves where it explains most, for what it may leave elsewhere.
constexpr double kWorseElsewhere = 4;

/// Part of what an effect explains that it may be wrong by: as much as is believed of any, or less
/// where it has been seen to be right.
double wrong_by(double believed, const Explained& explained, const std::vector<double>& left) {
  const auto most = std::max_element(explained.begin(), explained.end());
  if (most == explained.end() || *most <= 0) return believed;
  const auto channel = static_cast<std::size_t>(most - explained.begin());
  return std::min(believed, kWorseElsewhere * left[channel] / *most);
}

}  // namespace

Doubt doubt_of(const DiagnosisOptions& options, const std::vector<double>& rounding) {
  Doubt doubt = options.form_of_channel;
  for (double& d : doubt) d *= options.taken_of_form;
  const std::vector<double>& reckoned = options.rounding_of_channel;
  doubt.resize(std::max({doubt.size(), reckoned.size(), rounding.size()}), 0.0);
  for (std::size_t c = 0; c < reckoned.size(); ++c)
    doubt[c] += options.taken_of_rounding * reckoned[c];
  for (std::size_t c = 0; c < rounding.size(); ++c) doubt[c] += rounding[c];
  return doubt;
}

Doubt doubt_of(const DiagnosisOptions& options, const std::vector<Explained>& found,
               const std::vector<double>& before, const std::vector<double>& left,
               const std::vector<double>& rounding) {
  Doubt doubt = doubt_of(options, rounding);
  doubt.resize(left.size(), 0.0);
  for (const Explained& explained : found) {
    const double wrong = wrong_by(options.share_of_found, explained, left);
    for (std::size_t c = 0; c < left.size(); ++c) doubt[c] += wrong * std::max(0.0, explained[c]);
  }
  for (std::size_t c = 0; c < left.size(); ++c) doubt[c] += std::max(0.0, left[c] - before[c]);
  return doubt;
}

double counted(double gain, const std::vector<double>& before, const std::vector<double>& after,
               const Doubt& doubt) {
  return counted(gain, before, after, doubt, {}, std::vector<double>(doubt.size(), 0.0));
}

double counted(double gain, const std::vector<double>& before, const std::vector<double>& after,
               const Doubt& doubt, const Doubt& anywhere, const std::vector<double>& at_rest) {
  for (std::size_t c = 0; c < doubt.size(); ++c) {
    const double of_channel = before[c] - after[c];
    const double while_acting = std::max(0.0, of_channel - at_rest[c]);
    gain -= std::min(std::clamp(of_channel, 0.0, doubt[c]),
                     while_acting + (c < anywhere.size() ? anywhere[c] : 0.0));
  }
  return gain;
}

}  // namespace vcnc
