#include "diagnosis/fit/joint_fit.hpp"

#include <cmath>
#include <utility>

#include "diagnosis/fit/misfit.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {
namespace {

constexpr double kNoStep = 1;  ///< chi-square that no step is worth

/// A step that is damped so much, and how far it is gone.
struct Way {
  double damping = 0, share = 1;
};

std::vector<FreedNumber> all_numbers(const FittedMachine& m) {
  std::vector<FreedNumber> all = m.nuisances.numbers;
  for (const FreedNumber& n : m.numbers()) all.push_back(n);
  return all;
}

/// All numbers with their sensitivities where a machine stood.
class Sensitivities {
 public:
  Sensitivities(const Evidence& evidence, const FittedMachine& m)
      : evidence_(evidence), all_(m.linear()), columns_(pointers(all_.columns)) {
    own_ = evidence.products(columns_);
  }

  /// The step that makes least of what a machine leaves; chi-square is of weighted channels.
  LinearStep step(const FittedMachine& m, const std::vector<double>& weight, double damping) const {
    const std::vector<const Column*> left{&m.residual};
    const RoleGrams grams =
        bordered(evidence_.cross(left, left), evidence_.cross(left, columns_), own_);
    return step_within_range(grams.fitted_with(weight), grams.held_out, all_numbers(m), damping);
  }

 private:
  const Evidence& evidence_;
  const LinearPart all_;
  const std::vector<const Column*> columns_;
  RoleGrams own_;
};

/// Part of the way along a step, of which those of the numbers begin at `first`.
std::vector<FreedNumber> gone(const std::vector<FreedNumber>& numbers, const LinearStep& step,
                              double share, std::size_t first = 0) {
  std::vector<FreedNumber> to = numbers;
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i].value += step.step[static_cast<Eigen::Index>(first + i)] * to[i].number.typical;
  return between(numbers, std::move(to), share);
}

Refit part_of(const FittedMachine& m, std::vector<FreedNumber> linear,
              std::vector<FreedNumber> live) {
  Refit part;
  part.machine = with(with(m.machine, live), linear);
  part.linear = std::move(linear);
  part.live = std::move(live);
  part.columns = m.columns;
  return part;
}

/// Steps from where a machine stands.
class Stepping {
 public:
  Stepping(const Evidence& evidence, const Sensitivities& sensitivities, const FittedMachine& from)
      : evidence_(evidence),
        sensitivities_(sensitivities),
        from_(from),
        weight_(weights_of_channels(evidence, from.residual)),
        before_(misfit(evidence, from.residual, weight_, from.nuisances.numbers)),
        begun_(quiet_misfit(evidence, from)),
        least_(begun_) {}

  /// Goes the best of some ways, if it is better than what was gone before.
  bool go(FittedMachine& m, const std::vector<Way>& ways) {
    std::vector<Refit> parts;
    std::vector<double> promise;
    for (const Way& way : ways) {
      const LinearStep step = sensitivities_.step(from_, weight_, way.damping);
      const std::vector<FreedNumber>& linear = from_.nuisances.numbers;
      parts.push_back(part_of(from_, gone(linear, step, way.share),
                              gone(from_.numbers(), step, way.share, linear.size())));
      promise.push_back(before_ - step.fitted);
    }
    std::vector<FittedMachine> there = moved_to(evidence_, from_, parts);
    bool better = false;
    for (std::size_t i = 0; i < there.size(); ++i) {
      const double left = quiet_misfit(evidence_, there[i]);
      if (!(left < least_ - kNoStep)) continue;
      better = true;
      least_ = left;
      way_ = ways[i];
      promised_ = promise[i];
      m = std::move(there[i]);
    }
    return better;
  }
  Way way() const { return way_; }
  /// Whether sensitivities told how much the step would bring.
  bool kept_its_promise() const {
    constexpr double kAlmost = 0.3;
    return way_.share == 1 && std::abs(begun_ - least_ - promised_) < kAlmost * promised_;
  }

 private:
  const Evidence& evidence_;
  const Sensitivities& sensitivities_;
  const FittedMachine from_;
  const std::vector<double> weight_;
  const double before_, begun_;
  double least_;
  Way way_;
  double promised_ = 0;
};

/// Goes as far as it makes the misfit less. False: no step does.
bool go_on(Stepping& steps, FittedMachine& m, double& damping) {
  constexpr double kFarthest = 16, kUndamped = 1e-3, kLess = 10;
  if (steps.go(m, {{damping, 1}, {damping, 2}})) {
    for (double more = 4; steps.way().share == more / 2 && more <= kFarthest; more *= 2)
      steps.go(m, {{damping, more}});
    damping = damping > kUndamped ? damping / kLess : 0;
    return true;
  }
  if (!steps.go(m, {{1e-2, 1}, {1e-1, 1}, {1, 1}, {10, 1}})) return false;
  damping = steps.way().damping;
  return true;
}

}  // namespace

void fit_jointly(const Evidence& evidence, FittedMachine& m,
                 const std::vector<std::size_t>& which) {
  constexpr int kSteps = 16;
  double damping = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double held_out = m.held_out, before = misfit(evidence, m);
    linearise(evidence, m, which);
    m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
    const Sensitivities sensitivities(evidence, m);
    Stepping steps(evidence, sensitivities, m);
    if (!go_on(steps, m, damping)) break;
    const double little = settled(evidence, m),
                 gain = std::max(held_out - m.held_out, before - misfit(evidence, m));
    if (gain < little) break;
    if (!steps.kept_its_promise()) continue;
    const std::vector<double> weight = weights_of_channels(evidence, m.residual);
    const double next = misfit(evidence, m.residual, weight, m.nuisances.numbers) -
                        sensitivities.step(m, weight, damping).fitted;
    if (next < little) break;
  }
}

}  // namespace vcnc
