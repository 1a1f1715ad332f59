#include "diagnosis/laws/law_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kPlaces = 80;  // intervals of a travel
constexpr std::size_t kWidest = 10;  // of these: more, and ten hats over the travel see it
constexpr double kBelongs = 0.05;    // part of the largest promise

/// Products of the residual with what a hat changes, and of that with itself.
struct HatProducts {
  double with_residual = 0, own = 0;

  double promise() const { return own > 0 ? with_residual * with_residual / own : 0; }
  HatProducts plus(const HatProducts& other, double sign) const {
    return {with_residual + sign * other.with_residual, own + other.own};
  }
};

std::vector<double> fine_knots(const Law& over_all) {
  const double from = over_all.at.front(), way = over_all.at.back() - from;
  std::vector<double> at(kPlaces + 1);
  for (std::size_t i = 0; i <= kPlaces; ++i)
    at[i] = from + way * static_cast<double>(i) / static_cast<double>(kPlaces);
  return at;
}

/// Of the hats at all knots but the ends.
std::vector<HatProducts> products_of_hats(const Evidence& evidence, const LawColumns& columns,
                                          Law law, const std::vector<double>& knots,
                                          const Column& left) {
  std::vector<HatProducts> all;
  law.value = {0, 1, 0};
  for (std::size_t i = 1; i + 1 < knots.size(); ++i) {
    law.at = {knots[i - 1], knots[i], knots[i + 1]};
    const Column column = columns.column(law);
    const RoleGrams products = evidence.cross({&column}, {&left, &column});
    all.push_back({products.fitted(0, 0), products.fitted(0, 1)});
  }
  return all;
}

Law at_place(Law law, Covariate times, const std::vector<double>& knots,
             const std::vector<double>& promises) {
  const Neighbours place = about_the_most(promises);  // of the inner knots, from the second one on
  law.times = times;
  law.at.assign(knots.begin() + static_cast<std::ptrdiff_t>(place.first),
                knots.begin() + static_cast<std::ptrdiff_t>(place.last) + 2);
  return law;
}

}  // namespace

Neighbours about_the_most(const std::vector<double>& promises) {
  const auto most = std::max_element(promises.begin(), promises.end());
  const auto at = static_cast<std::size_t>(most - promises.begin());
  Neighbours place{at, at + 1};
  const auto belongs = [&](std::size_t i) { return promises[i] > kBelongs * *most; };
  while (place.last - place.first < kWidest) {
    const bool before = place.first > 0 && belongs(place.first - 1),
               after = place.last < promises.size() && belongs(place.last);
    if (!before && !after) break;
    if (before && (!after || promises[place.first - 1] > promises[place.last]))
      --place.first;
    else
      ++place.last;
  }
  return place;
}

std::vector<Law> laws_of_places(const Evidence& evidence, const LawColumns& columns,
                                const Column& left) {
  std::vector<Law> over_all = columns.all();
  std::erase_if(over_all, [](const Law& law) { return law.times != Covariate::forwards; });
  std::vector<std::array<Law, 4>> laws(over_all.size());
  parallel_for(over_all.size(), [&](std::size_t l) {
    Law law = over_all[l];
    const std::vector<double> knots = fine_knots(law);
    const std::vector<HatProducts> forwards = products_of_hats(evidence, columns, law, knots, left);
    law.times = Covariate::backwards;
    const std::vector<HatProducts> backwards =
        products_of_hats(evidence, columns, law, knots, left);
    std::array<std::vector<double>, 4> promises;
    for (std::size_t i = 0; i < forwards.size(); ++i) {
      const HatProducts &f = forwards[i], &b = backwards[i];
      const std::array<HatProducts, 4> of{f, b, f.plus(b, 1), f.plus(b, -1)};
      for (std::size_t w = 0; w < of.size(); ++w) promises[w].push_back(of[w].promise());
    }
    constexpr std::array kWays{Covariate::forwards, Covariate::backwards, Covariate::time,
                               Covariate::sign};
    for (std::size_t w = 0; w < kWays.size(); ++w)
      laws[l][w] = at_place(law, kWays[w], knots, promises[w]);
  });
  std::vector<Law> all;
  for (const std::array<Law, 4>& of : laws) all.insert(all.end(), of.begin(), of.end());
  return all;
}

}  // namespace vcnc
