#include "diagnosis/fit/misfit.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

/// Times its noise that a channel may be off before it loses weight.
constexpr double kLoudChannel = 2;

/// Chi-square from which on a channel is loud.
double loud(const Evidence& evidence, std::size_t channel) {
  return kLoudChannel * kLoudChannel * evidence.count(channel, Role::fitted);
}

double pulls(const std::vector<FreedNumber>& numbers) {
  double sum = 0;
  for (const FreedNumber& n : numbers) sum += n.pull() * n.pull();
  return sum;
}

}  // namespace

std::vector<double> weights_of_channels(const Evidence& evidence, const Column& residual) {
  std::vector<double> all(residual.size(), 1.0);
  for (std::size_t c = 0; c < all.size(); ++c) {
    const double off = evidence.chi2(residual, c, Role::fitted), most = loud(evidence, c);
    if (off > most) all[c] = most / off;
  }
  return all;
}

double misfit(const Evidence& evidence, const Column& residual, const std::vector<double>& weight,
              const std::vector<FreedNumber>& numbers) {
  double sum = pulls(numbers);
  for (std::size_t c = 0; c < weight.size(); ++c)
    sum += weight[c] * evidence.chi2(residual, c, Role::fitted);
  return sum;
}

double misfit(const Evidence& evidence, const FittedMachine& m) {
  const std::vector<double> alike(m.residual.size(), 1.0);
  return misfit(evidence, m.residual, alike, m.nuisances.numbers);
}

double quiet_misfit(const Evidence& evidence, const FittedMachine& m) {
  double sum = pulls(m.nuisances.numbers);
  for (std::size_t c = 0; c < m.residual.size(); ++c) {
    const double off = evidence.chi2(m.residual, c, Role::fitted), most = loud(evidence, c);
    sum += off > most ? most * (1 + std::log(off / most)) : off;
  }
  return sum;
}

double settled(const Evidence& evidence, const FittedMachine& m) {
  constexpr double kLittle = 1e-4, kFarMore = 10;
  const double noise = evidence.count(Role::held_out), excess = std::max(0.0, m.held_out - noise);
  return 5 + kLittle * excess * std::clamp(excess / std::max(1.0, noise), 1.0, kFarMore);
}

}  // namespace vcnc
