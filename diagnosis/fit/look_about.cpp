#include "diagnosis/fit/look_about.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/settling.hpp"

namespace vcnc {
namespace {

constexpr std::array<double, 8> kFarOut{-8, -4, -2, -1, 1, 2, 4, 8};  ///< half widths
constexpr int kBeginnings = 2;

FreedNumber* number_of_key(FittedMachine& m, const std::string& key) {
  for (AddedEffect& a : m.added)
    for (FreedNumber& n : a.numbers)
      if (n.number.key == key) return &n;
  return nullptr;
}

/// Chi-square of the fitted laps, all but the number along their columns.
double left_beside(const Evidence& evidence, const FittedMachine& m, const Column& residual,
                   const FreedNumber& number) {
  const LinearPart others = without(m.linear(), {number});
  return Ground(evidence, residual, others).fitted;
}

/// What is left where a number stands elsewhere.
struct Surroundings {
  std::vector<double> k{0}, value, chi_square;

  std::size_t least() const {
    return static_cast<std::size_t>(std::min_element(chi_square.begin(), chi_square.end()) -
                                    chi_square.begin());
  }
};

Surroundings about(const Evidence& evidence, const FittedMachine& m, const FreedNumber& number,
                   double half) {
  Surroundings s;
  s.value = {number.value};
  s.chi_square = {left_beside(evidence, m, m.residual, number)};
  std::vector<Machine> machines;
  for (const double k : kFarOut) {
    const double value = number.value + k * half;
    if (value < number.number.min || value > number.number.max) continue;
    s.k.push_back(k);
    s.value.push_back(value);
    machines.push_back(m.machine);
    move_number(machines.back(), number.number.key, value);
  }
  for (const Prediction& p : evidence.predict_all(machines))
    s.chi_square.push_back(left_beside(evidence, m, evidence.residual(p), number));
  return s;
}

}  // namespace

double times_wider(const std::vector<double>& k, const std::vector<double>& chi_square) {
  if (k.size() < 5) return 1;  // a parabola is through any three
  const auto n = static_cast<Eigen::Index>(k.size());
  Eigen::MatrixXd powers(n, 3);
  Eigen::VectorXd z(n);
  double farthest = 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double at = k[static_cast<std::size_t>(i)];
    powers.row(i) << at * at, at, 1;
    z[i] = chi_square[static_cast<std::size_t>(i)];
    farthest = std::max(farthest, std::abs(at));
  }
  const Eigen::Vector3d p = powers.colPivHouseholderQr().solve(z);
  if (!(p[0] > 0)) return farthest;
  const double scatter = (powers * p - z).norm() / std::sqrt(static_cast<double>(n - 3));
  return std::min(farthest, std::sqrt(1 + std::pow(p[1] / (2 * p[0]), 2) + scatter / p[0]));
}

void look_about(Evidence& evidence, FittedMachine& m, const std::vector<std::string>& keys,
                bool inexact, double least) {
  for (const std::string& key : keys) {
    for (int beginning = 0; beginning <= kBeginnings; ++beginning) {
      FreedNumber* number = number_of_key(m, key);
      if (!number) break;
      number->ragged = 0;
      const auto intervals = intervals_of(evidence, m, inexact);
      const auto known = intervals.find(key);
      if (known == intervals.end() || !(known->second.half_width > 0)) break;
      const double half = known->second.half_width;
      const Surroundings s = about(evidence, m, *number, half);
      const double times = times_wider(s.k, s.chi_square);
      number->ragged = half * std::sqrt(times * times - 1);
      const std::size_t best = s.least();
      if (s.chi_square[best] > s.chi_square.front() - least || beginning == kBeginnings) break;
      FittedMachine elsewhere = m;
      number_of_key(elsewhere, key)->value = s.value[best];
      settle_at(evidence, elsewhere);
      if (left_beside(evidence, elsewhere, elsewhere.residual, *number_of_key(elsewhere, key)) <
          s.chi_square.front())
        m = std::move(elsewhere);
      else
        beginning = kBeginnings;  // its interval knows
      evidence.anchor(m.machine);
    }
  }
  evidence.anchor(m.machine);
}

}  // namespace vcnc
