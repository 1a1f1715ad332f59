#include "diagnosis/fit/needed_numbers.hpp"

#include <algorithm>
#include <numeric>

#include "diagnosis/candidates/trial.hpp"

namespace vcnc {
namespace {

/// Part of the information about a number that is there anyway, so that an inverse exists.
constexpr double kAnyway = 1e-12;

}  // namespace

std::vector<Eigen::Index> needless(const Eigen::MatrixXd& information, Eigen::VectorXd off,
                                   std::vector<Eigen::Index> may_go, double cost) {
  std::vector<Eigen::Index> gone, left(static_cast<std::size_t>(information.rows()));
  std::iota(left.begin(), left.end(), Eigen::Index{0});
  while (may_go.size() > 1) {
    const auto n = static_cast<Eigen::Index>(left.size());
    const Eigen::MatrixXd part = information(left, left),
                          inverse =
                              part.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
    const auto place = [&](Eigen::Index number) {
      return std::lower_bound(left.begin(), left.end(), number) - left.begin();
    };
    const auto costs = [&](Eigen::Index number) {
      return off[number] * off[number] / inverse(place(number), place(number));
    };
    const auto least =
        std::min_element(may_go.begin(), may_go.end(),
                         [&](Eigen::Index a, Eigen::Index b) { return costs(a) < costs(b); });
    cost -= costs(*least);
    if (!(cost > 0)) break;
    const Eigen::Index i = place(*least);
    const double x = off[*least];
    for (Eigen::Index j = 0; j < n; ++j)
      off[left[static_cast<std::size_t>(j)]] -= x * inverse(j, i) / inverse(i, i);
    gone.push_back(*least);
    left.erase(left.begin() + i);
    may_go.erase(least);
  }
  std::sort(gone.begin(), gone.end());
  return gone;
}

std::set<std::string> needless_of(const std::vector<FreedNumber>& effect,
                                  const std::vector<FreedNumber>& all,
                                  const Eigen::MatrixXd& information, const Machine& declared,
                                  double cost) {
  std::vector<Eigen::Index> amplitudes;
  Eigen::VectorXd off = Eigen::VectorXd::Zero(information.rows());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const FreedNumber& n = all[i];
    if (!has_key(effect, n.number.key) || n.shape || is_phase(n.number)) continue;
    const auto at = static_cast<Eigen::Index>(i);
    amplitudes.push_back(at);
    off[at] = (n.value - number_of(declared, n.number.key)) / n.number.typical;
  }
  Eigen::MatrixXd known = information;
  known.diagonal().array() += kAnyway * (1e-6 + known.diagonal().array());
  std::set<std::string> keys;
  for (const Eigen::Index i : needless(known, off, amplitudes, cost))
    keys.insert(all[static_cast<std::size_t>(i)].number.key);
  return keys;
}

}  // namespace vcnc
