#include "diagnosis/fit/acting_slices.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vcnc {
namespace {

constexpr double kSlice = 0.05;   ///< [s]
constexpr double kAtRest = 0.01;  ///< of the mean chi-square of a slice

std::size_t samples_of_slice(const Record& record) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kSlice / record.period)));
}

/// Chi-square per slice of what two residuals of a channel differ by.
std::vector<double> difference(const std::vector<float>& a, const std::vector<float>& b,
                               std::size_t samples, std::size_t slice) {
  std::vector<double> all((samples + slice - 1) / slice, 0.0);
  for (std::size_t k = 0; k < samples; ++k) {
    const double d = (a.empty() ? 0.0 : static_cast<double>(a[k])) -
                     (b.empty() ? 0.0 : static_cast<double>(b[k]));
    all[k / slice] += d * d;
  }
  return all;
}

bool acts(const ActingSlices& effect, std::size_t channel, std::size_t slice) {
  return effect.empty() || effect[channel][slice];
}

}  // namespace

ActingSlices acting_slices(const Record& record, const Column& with, const Column& without) {
  const std::size_t slice = samples_of_slice(record);
  ActingSlices acting;
  for (std::size_t c = 0; c < with.size(); ++c) {
    const std::vector<double> chi2 = difference(with[c], without[c], record.samples(), slice);
    const std::size_t n = chi2.size();
    const double least =
        kAtRest * std::accumulate(chi2.begin(), chi2.end(), 0.0) / static_cast<double>(n);
    std::vector<char> of_channel(n, false);
    for (std::size_t i = 0; i < n; ++i)
      if (chi2[i] > least)
        std::fill(of_channel.begin() + static_cast<std::ptrdiff_t>(i - (i > 0)),
                  of_channel.begin() + static_cast<std::ptrdiff_t>(std::min(n, i + 2)), true);
    acting.push_back(std::move(of_channel));
  }
  return acting;
}

std::vector<double> chi2_at_rest(const Evidence& evidence, const Column& column,
                                 const std::vector<ActingSlices>& acting) {
  const std::size_t slice = samples_of_slice(evidence.record());
  std::vector<double> all(column.size(), 0.0);
  for (std::size_t c = 0; c < column.size(); ++c) {
    if (column[c].empty()) continue;
    for (const RecordBlock& block : evidence.partition().blocks) {
      if (!block.held_out) continue;
      for (std::size_t k = block.begin; k < block.end; ++k) {
        const bool at_rest = std::none_of(acting.begin(), acting.end(), [&](const ActingSlices& a) {
          return acts(a, c, k / slice);
        });
        const double z = static_cast<double>(column[c][k]);
        if (at_rest) all[c] += z * z;
      }
    }
  }
  return all;
}

}  // namespace vcnc
