#include "diagnosis/laws/law_fit.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

constexpr double kRidge = 1e-4;  ///< of what a knot makes in the mean

/// Products of all that is fitted with a law, and how well each number is known before.
struct WithLaw {
  RoleGrams grams;
  Eigen::VectorXd precision, offset;

  /// `across`: products of [residual, linear numbers] with a law's columns; `among`: of these.
  WithLaw(const Ground& ground, const RoleGrams& across, const RoleGrams& among, bool per_channel)
      : grams(bordered(per_channel ? ground.grams
                                   : RoleGrams{ground.grams.fitted, ground.grams.held_out, {}, {}},
                       across, among)) {
    const Eigen::Index n = ground.precision.size(), k = among.fitted.rows();
    precision = offset = Eigen::VectorXd::Zero(n + k);
    precision.head(n) = ground.precision;
    offset.head(n) = ground.offset;
    precision.tail(k).setConstant(kRidge * among.fitted.diagonal().mean());
  }

  Eigen::Index numbers() const { return precision.size(); }
  LinearStep step() const { return linear_step(grams.fitted, grams.held_out, precision, offset); }
};

LinearLaw fit(const Ground& ground, const WithLaw& all) {
  const LinearStep s = all.step();
  LinearLaw law;
  law.value = s.step.tail(all.numbers() - ground.precision.size());
  // The ridge is no evidence: it is taken off what the priors of the step add up to.
  const double ridge = all.precision[ground.precision.size()] * law.value.squaredNorm();
  law.gain = ground.held_out - (s.held_out - ridge);
  return law;
}

WithLaw with_columns(const Evidence& evidence, const Ground& ground,
                     const std::vector<Column>& columns) {
  std::vector<const Column*> own;
  for (const Column& c : columns) own.push_back(&c);
  return {ground, evidence.cross(ground.columns, own), evidence.cross(own, own), true};
}

}  // namespace

LinearLaw fit_law(const Evidence& evidence, const Ground& ground,
                  const std::vector<Column>& columns) {
  return fit(ground, with_columns(evidence, ground, columns));
}

Eigen::VectorXd deviations_of_law(const Evidence& evidence, const Ground& ground,
                                  const std::vector<Column>& columns) {
  const WithLaw all = with_columns(evidence, ground, columns);
  const Eigen::Index n = all.numbers();
  const Eigen::VectorXd step = all.step().step;
  const std::vector<double> left = left_after(all.grams.fitted_of, step);
  const Eigen::MatrixXd prior = all.precision.asDiagonal();
  Eigen::MatrixXd louder = prior;
  for (std::size_t c = 0; c < left.size(); ++c)
    louder += std::max(1.0, left[c] / std::max(1.0, evidence.count(c, Role::fitted))) *
              all.grams.fitted_of[c].bottomRightCorner(n, n);
  const Eigen::MatrixXd inverse = (all.grams.fitted.bottomRightCorner(n, n) + prior).inverse();
  return (inverse * louder * inverse)
      .diagonal()
      .tail(static_cast<Eigen::Index>(columns.size()))
      .cwiseMax(0)
      .cwiseSqrt();
}

GainWithHats::GainWithHats(const Evidence& evidence, const Ground& ground,
                           const LawColumns& columns, const Law& law)
    : evidence_(evidence), ground_(ground), of_(columns), law_(law) {
  take(of_.columns(law));
}

double GainWithHats::operator()(const std::vector<Hat>& hats) {
  learn(hats);
  std::vector<Eigen::Index> chosen(law_.at.size()),
      all(static_cast<std::size_t>(across_.fitted.rows()));
  std::iota(chosen.begin(), chosen.end(), 0);
  std::iota(all.begin(), all.end(), 0);
  for (const Hat& h : hats)
    chosen.push_back(static_cast<Eigen::Index>(law_.at.size()) +
                     (std::find(hats_.begin(), hats_.end(), h) - hats_.begin()));
  const auto some = [&](const RoleGrams& of, const std::vector<Eigen::Index>& rows) {
    return RoleGrams{of.fitted(rows, chosen), of.held_out(rows, chosen), {}, {}};
  };
  return fit(ground_, {ground_, some(across_, all), some(among_, chosen), false}).gain;
}

/// Hats that were not asked for before.
void GainWithHats::learn(const std::vector<Hat>& hats) {
  std::vector<Law> fresh;
  for (const Hat& h : hats) {
    if (std::find(hats_.begin(), hats_.end(), h) != hats_.end()) continue;
    hats_.push_back(h);
    fresh.push_back(law_);
    fresh.back().at = {h.low, h.at, h.high};
    fresh.back().value = {0, 1, 0};
  }
  std::vector<Column> columns(fresh.size());
  parallel_for(fresh.size(), [&](std::size_t i) { columns[i] = of_.column(fresh[i]); });
  if (!columns.empty()) take(std::move(columns));
}

void GainWithHats::take(std::vector<Column> fresh) {
  std::vector<const Column*> known, own;
  for (const Column& c : columns_) known.push_back(&c);
  for (Column& c : fresh) columns_.push_back(std::move(c));
  for (std::size_t i = known.size(); i < columns_.size(); ++i) own.push_back(&columns_[i]);
  RoleGrams across = evidence_.cross(ground_.columns, own), among = evidence_.cross(own, own);
  if (known.empty()) {
    across_ = std::move(across);
    among_ = std::move(among);
    return;
  }
  among_ = bordered(among_, evidence_.cross(known, own), among);
  across_ = beside(across_, across);
}

}  // namespace vcnc
