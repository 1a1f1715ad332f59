#include "diagnosis/laws/law_in_loop.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/laws/law_fit.hpp"
#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

constexpr int kRounds = 4, kAlternations = 4;
constexpr double kNudge = 0.02, kWorthARound = 0.99;

Machine with_law(Machine machine, const Law& law) {
  machine.effects.laws.push_back(law);
  return machine;
}

/// A machine by hypothesis and what it leaves of chi-square on the fitted laps.
struct Settled {
  Machine machine;
  double fitted = 0;
};

/// A machine with the numbers that go along with its law moved, where that is for the better: a law
/// of the position and a constant may be large and cancel.
Settled settle(const Evidence& evidence, const Machine& machine, const Ground& at,
               const LinearPart& linear) {
  const LinearStep s = linear_step(at.grams.fitted, at.grams.held_out, at.precision, at.offset);
  std::vector<FreedNumber> numbers = linear.numbers;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i].value += s.step[static_cast<Eigen::Index>(i)] * numbers[i].number.typical;
  Machine moved = with(machine, numbers);
  const double before = at.grams.fitted(0, 0),
               after = evidence.chi2(evidence.residual(evidence.predict(moved)), Role::fitted);
  return after < before ? Settled{std::move(moved), after} : Settled{machine, before};
}

}  // namespace

struct LawInLoop::Acting {
  Law law;
  Machine machine;
  Prediction prediction;
  Column residual;
  Ground ground;
  Settled settled;

  Acting(const Evidence& evidence, const Machine& without, Law own, const LinearPart& linear)
      : law(std::move(own)),
        machine(with_law(without, law)),
        prediction(evidence.predict(machine)),
        residual(evidence.residual(prediction)),
        ground(evidence, residual, linear),
        settled(settle(evidence, machine, ground, linear)) {}

  Acting(const Acting&) = delete;  // the ground refers to the residual
};

LawInLoop::LawInLoop(const Evidence& evidence, const FittedMachine& at, Law law,
                     std::shared_ptr<const LinearPart> linear)
    : evidence_(&evidence),
      without_(std::shared_ptr<void>(), &at),  // not owned
      linear_(std::move(linear)),
      acting_(std::make_unique<Acting>(evidence, at.machine, std::move(law), *linear_)) {}

LawInLoop::~LawInLoop() = default;
LawInLoop::LawInLoop(LawInLoop&&) noexcept = default;
LawInLoop& LawInLoop::operator=(LawInLoop&&) noexcept = default;

const Law& LawInLoop::law() const { return acting_->law; }
const Ground& LawInLoop::ground() const { return acting_->ground; }

void LawInLoop::refine() {
  columns_ = gauss_newton(*without_, *linear_, acting_);
  for (int i = 0; i < kAlternations; ++i) {
    FittedMachine moved = *without_;
    moved.machine = with_law(moved.machine, acting_->law);
    converge_anew(*evidence_, moved);
    moved.machine.effects.laws.pop_back();
    auto linear = std::make_shared<const LinearPart>(moved.linear());
    auto again = std::make_unique<Acting>(*evidence_, moved.machine, acting_->law, *linear);
    std::vector<Column> columns = gauss_newton(moved, *linear, again);
    const double before = acting_->settled.fitted, now = again->settled.fitted;
    if (!(now < before)) return;
    acting_ = std::move(again);
    linear_ = std::move(linear);
    columns_ = std::move(columns);
    without_ = std::make_shared<const FittedMachine>(std::move(moved));
    if (now > kWorthARound * before) return;
  }
}

std::vector<Column> LawInLoop::gauss_newton(const FittedMachine& without, const LinearPart& linear,
                                            std::unique_ptr<Acting>& best) const {
  std::vector<Column> columns;
  for (int round = 0; round < kRounds; ++round) {
    const Acting& acting = *best;
    double largest = 0;
    for (const double v : acting.law.value) largest = std::max(largest, std::abs(v));
    const double step = kNudge * largest;
    std::vector<Machine> nudged;
    for (std::size_t h = 0; h < acting.law.value.size(); ++h) {
      nudged.push_back(acting.machine);
      nudged.back().effects.laws.back().value[h] += step;
    }
    const std::vector<Prediction> predictions = evidence_->predict_all(nudged);
    columns.resize(nudged.size());
    parallel_for(nudged.size(), [&](std::size_t h) {
      columns[h] = evidence_->sensitivity(acting.prediction, predictions[h], step);
    });
    const LinearLaw fitted = fit_law(*evidence_, acting.ground, columns);
    bool better = false;
    for (const double share : {1.0, 0.3}) {
      Law law = acting.law;
      for (std::size_t h = 0; h < law.value.size(); ++h)
        law.value[h] += share * fitted.value[static_cast<Eigen::Index>(h)];
      auto next = std::make_unique<Acting>(*evidence_, without.machine, law, linear);
      if (!(next->settled.fitted < acting.settled.fitted)) continue;
      better = next->settled.fitted < kWorthARound * acting.settled.fitted;
      best = std::move(next);
      break;
    }
    if (!better) break;
  }
  return columns;
}

/// What a law leaves is told in the loop: numbers moved along their columns may disappoint there.
Machine LawInLoop::machine() const {
  FittedMachine moved = *without_;
  moved.machine = acting_->machine;
  converge(*evidence_, moved);
  return evidence_->chi2(moved.residual, Role::fitted) < acting_->settled.fitted
             ? moved.machine
             : acting_->settled.machine;
}

Eigen::VectorXd LawInLoop::deviations() const {
  return deviations_of_law(*evidence_, acting_->ground, columns_);
}

}  // namespace vcnc
