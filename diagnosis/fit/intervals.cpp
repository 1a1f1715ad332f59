#include "diagnosis/fit/intervals.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/candidates/trial.hpp"

namespace vcnc {
namespace {

/// Of the noise's chi-square: a form that leaves less in every channel makes no model inexact.
constexpr double kExactForm = 0.01;
/// What the scatter of few conditions misses of the variance between them.
constexpr double kFewConditions = 1.3;
constexpr double kFewLaps = 4;  ///< too few for their scatter to tell anything

/// Two-sided 95 % quantile of Student's t: the expansion about the normal one (Abramowitz & Stegun
/// 26.7.5), within 1 % from 3 degrees of freedom on.
double student_95(double freedom) {
  const double z = kNormal95, n = freedom, z2 = z * z;
  const double g1 = z * (z2 + 1) / 4, g2 = z * ((5 * z2 + 16) * z2 + 3) / 96,
               g3 = z * (((3 * z2 + 19) * z2 + 17) * z2 - 15) / 384,
               g4 = z * ((((79 * z2 + 776) * z2 + 1482) * z2 - 1920) * z2 - 945) / 92160;
  return z + g1 / n + g2 / (n * n) + g3 / (n * n * n) + g4 / (n * n * n * n);
}

/// A time constant of nought, and the like, is that the effect has none: it would be another one
/// with the least of it, so that no slope there tells how well that is known.
bool is_none_of_its_shape(const FreedNumber& number) {
  return number.shape && number.value == 0 && number.number.min == 0;
}

/// The largest amplitude of the effect of a number that has its unit: what a law gets wrong about
/// one of them shows in the others. In the unit of the key; of a phase a radian, as what is as
/// large as a share of the wave and not in phase with it turns it by that share of one. Where a
/// scale ends is read off and hangs on the form of no law, and where on an axis something is hangs
/// on nothing that its coordinate is large by.
double size_of(const FittedMachine& machine, const FreedNumber& number) {
  if (is_limit(number.number) || is_place(number.number)) return 0;
  if (is_phase(number.number)) return 1 / si_of_unit(number.number.key);
  double largest = std::abs(number.value);
  for (const AddedEffect& a : machine.added) {
    if (!has_key(a.numbers, number.number.key) || number.shape || is_phase(number.number)) continue;
    for (const FreedNumber& n : a.numbers)
      if (!n.shape && !is_phase(n.number) &&
          unit_of_key(n.number.key) == unit_of_key(number.number.key))
        largest = std::max(largest, std::abs(n.value));
  }
  return largest;
}

/// Sum over the clusters of the squares of what each moves some of the numbers by.
Eigen::VectorXd scatter(const Eigen::MatrixXd& inverse,
                        const std::map<std::size_t, Eigen::VectorXd>& score_of,
                        const std::vector<Eigen::Index>& some) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(inverse.rows());
  for (const auto& [cluster, score] : score_of) sum += (inverse * score(some)).cwiseAbs2();
  return sum;
}

/// What chi-square tells of the numbers of a machine, in their typical sizes.
struct Curvature {
  Eigen::MatrixXd information;
  /// Of the scores of parts of the record.
  std::map<std::size_t, Eigen::VectorXd> of_block, of_condition, of_lap;
  double ratio = 1;    ///< by which chi-square is too large
  double of_laps = 0;  ///< factor of the scatter of laps that counts; 0: does not
  bool inexact = false;
};

/// Half widths of some of the numbers, were all others known: of noise, and of the scatter between
/// conditions where the model is not exact.
struct HalfWidths {
  Eigen::VectorXd noise, form;
};

HalfWidths half_widths(const Curvature& of, const std::vector<Eigen::Index>& some) {
  const auto n = static_cast<Eigen::Index>(some.size());
  const Eigen::MatrixXd information = of.information(some, some);
  const Eigen::MatrixXd inverse =
      information.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
  const auto clusters = static_cast<double>(of.of_block.size()),
             conditions = static_cast<double>(of.of_condition.size()),
             laps = static_cast<double>(of.of_lap.size());
  const Eigen::VectorXd between_blocks = scatter(inverse, of.of_block, some) * clusters /
                                         std::max(1.0, clusters - static_cast<double>(n)),
                        between_conditions = scatter(inverse, of.of_condition, some) * conditions /
                                             std::max(1.0, conditions - 1),
                        between_laps =
                            scatter(inverse, of.of_lap, some) * laps / std::max(1.0, laps - 1);
  // With few clusters their scatter tells nothing.
  const bool enough = clusters > 3 * static_cast<double>(n), several = conditions > 3;
  const double few = several ? kFewConditions * student_95(conditions - 1) : 0;
  HalfWidths widths{Eigen::VectorXd(n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    widths.noise[i] = std::max(kNormal95 * std::sqrt(std::max({0.0, of.ratio * inverse(i, i),
                                                               enough ? between_blocks[i] : 0.0})),
                               of.of_laps * std::sqrt(between_laps[i]));
    if (of.inexact) widths.form[i] = few * std::sqrt(between_conditions[i]);
  }
  return widths;
}

}  // namespace

bool is_inexact(const Evidence& evidence, const DiagnosisOptions& options, double floor,
                double held_out) {
  const std::vector<double>& form = options.form_of_channel;
  for (std::size_t c = 0; c < form.size(); ++c)
    if (form[c] > kExactForm * evidence.count(c, Role::held_out)) return true;
  return held_out > options.model_form * floor;
}

std::map<std::string, Interval> intervals_of(const Evidence& evidence, const FittedMachine& machine,
                                             bool inexact) {
  const LinearPart all = machine.linear();
  const auto n = static_cast<Eigen::Index>(all.numbers.size());
  std::map<std::string, Interval> intervals;
  if (n == 0) return intervals;
  std::vector<const Column*> columns{&machine.residual};
  for (const Column& c : all.columns) columns.push_back(&c);
  const BlockGrams blocks = evidence.grams(columns);
  const Eigen::MatrixXd sum = evidence.sum(blocks, Role::fitted);

  Curvature of;
  of.information = sum.block(1, 1, n, n);
  of.information.diagonal() += all.precision();
  of.information.diagonal().array() += 1e-10 * (1e-6 + of.information.diagonal().array());
  of.ratio = std::max(1.0, sum(0, 0) / std::max(1.0, evidence.count(Role::fitted)));
  of.inexact = inexact;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const RecordBlock& block = evidence.partition().blocks[b];
    const Eigen::VectorXd score = blocks[b].block(1, 0, n, 1);
    const auto add = [&](std::map<std::size_t, Eigen::VectorXd>& clusters, std::size_t cluster) {
      const auto [at, first] = clusters.try_emplace(cluster, score);
      if (!first) at->second += score;
    };
    if (block.held_out) continue;
    add(of.of_lap, block.stretch);
    add(of.of_block, b);
    add(of.of_condition, static_cast<std::size_t>(block.condition));
  }
  const bool many_laps = static_cast<double>(of.of_lap.size()) > kFewLaps;
  of.of_laps = many_laps && evidence.partition().repeated && !inexact ? kNormal95 : 0;

  std::vector<Eigen::Index> every, but_shapes;
  for (Eigen::Index i = 0; i < n; ++i) {
    const FreedNumber& number = all.numbers[static_cast<std::size_t>(i)];
    if (!is_none_of_its_shape(number)) every.push_back(i);
    if (!number.shape) but_shapes.push_back(i);
  }
  const auto fill = [&](const std::vector<Eigen::Index>& some, double Interval::*width) {
    const HalfWidths widths = half_widths(of, some);
    for (std::size_t j = 0; j < some.size(); ++j) {
      const FreedNumber& number = all.numbers[static_cast<std::size_t>(some[j])];
      const double unit = number.number.typical, known = size_of(machine, number) / unit;
      const auto at = static_cast<Eigen::Index>(j);
      const double form = inexact ? std::hypot(widths.form[at], kNormal95 * kKnownTo * known) : 0;
      intervals[number.number.key].*width =
          std::hypot(std::hypot(widths.noise[at], form) * unit, number.ragged);
    }
  };
  fill(every, &Interval::half_width);
  fill(but_shapes, &Interval::shapes_known);
  return intervals;
}

bool may_be_as_declared(const AddedEffect& effect, const Machine& declared,
                        const std::map<std::string, Interval>& intervals) {
  bool some = false;
  for (const FreedNumber& n : effect.numbers) {
    if (n.shape || is_phase(n.number)) continue;
    some = true;
    const auto i = intervals.find(n.number.key);
    const double half = i == intervals.end() ? 0 : i->second.shapes_known;
    if (std::abs(n.value - number_of(declared, n.number.key)) > half) return false;
  }
  return some;
}

}  // namespace vcnc
