#include "diagnosis/laws/law_knots.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace vcnc {
namespace {

constexpr int kLevels = 3;              // halvings of a first interval
constexpr std::size_t kMostKnots = 40;  // knots: all of them are simulated

struct Between {
  double low, high;

  double middle() const { return (low + high) / 2; }
  std::vector<Hat> hats() const {
    const double m = middle();
    return {{low, m, high}, {low, (low + m) / 2, m}, {m, (m + high) / 2, high}};
  }
};

std::vector<Hat> joined(std::vector<Hat> all, const std::vector<Hat>& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace

std::vector<double> with_more_knots(std::vector<double> knots,
                                    const std::function<double(const std::vector<Hat>&)>& gain,
                                    double worth) {
  std::vector<Between> open;
  for (std::size_t i = 1; i < knots.size(); ++i) open.push_back({knots[i - 1], knots[i]});
  std::vector<Hat> kept;
  for (int level = 0; level < kLevels && !open.empty(); ++level) {
    std::vector<Hat> all = kept;
    for (const Between& i : open) all = joined(std::move(all), i.hats());
    const double with_all = gain(all);
    std::vector<Between> halves;
    for (std::size_t i = 0; i < open.size() && knots.size() < kMostKnots; ++i) {
      std::vector<Hat> less = kept;
      for (std::size_t j = 0; j < open.size(); ++j)
        if (j != i) less = joined(std::move(less), open[j].hats());
      if (with_all - gain(less) < worth) continue;
      knots.push_back(open[i].middle());
      halves.push_back({open[i].low, open[i].middle()});
      halves.push_back({open[i].middle(), open[i].high});
    }
    for (std::size_t i = 0; i < halves.size(); i += 2)
      kept.push_back({halves[i].low, halves[i].high, halves[i + 1].high});
    open = std::move(halves);
  }
  std::sort(knots.begin(), knots.end());
  return knots;
}

}  // namespace vcnc
