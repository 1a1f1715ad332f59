#include "diagnosis/search/counted_gain.hpp"

#include <algorithm>

namespace vcnc {

Doubt doubt_of(const DiagnosisOptions& options, const std::vector<double>& before,
               const std::vector<double>& left) {
  const std::vector<double>& form = options.form_of_channel;
  if (form.empty() && before.empty()) return {};
  Doubt doubt(left.size(), 0.0);
  for (std::size_t c = 0; c < left.size(); ++c) {
    if (!before.empty()) doubt[c] += options.share_of_found * std::max(0.0, before[c] - left[c]);
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
