#include "diagnosis/search/counted_gain.hpp"

#include <algorithm>

namespace vcnc {

namespace {

/// Times what a found law leaves where it explains most, for what it may leave elsewhere.
constexpr double kElsewhere = 4;

/// Part of what was found that a law of it may be wrong by: as much as is believed of any, or less
/// where it has been seen to be right.
double wrong_by(double believed, const std::vector<double>& before,
                const std::vector<double>& left) {
  double most = 0, seen = believed;
  for (std::size_t c = 0; c < left.size(); ++c)
    if (const double explained = before[c] - left[c]; explained > most)
      most = explained, seen = kElsewhere * left[c] / explained;
  return std::min(believed, seen);
}

}  // namespace

Doubt doubt_of(const DiagnosisOptions& options, const std::vector<double>& before,
               const std::vector<double>& left) {
  const std::vector<double>& form = options.form_of_channel;
  if (form.empty() && before.empty()) return {};
  Doubt doubt(left.size(), 0.0);
  const double wrong = before.empty() ? 0 : wrong_by(options.share_of_found, before, left);
  for (std::size_t c = 0; c < left.size(); ++c) {
    if (!before.empty())
      doubt[c] += wrong * std::max(0.0, before[c] - left[c]) + std::max(0.0, left[c] - before[c]);
    if (!form.empty()) doubt[c] += options.taken_of_form * form[c];
  }
  return doubt;
}

double counted(double gain, const std::vector<double>& before, const std::vector<double>& after,
               const Doubt& doubt) {
  for (std::size_t c = 0; c < doubt.size(); ++c)
    gain -= std::clamp(before[c] - after[c], 0.0, doubt[c]);
  return gain;
}

}  // namespace vcnc
