#include "diagnosis/search/generic_laws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "diagnosis/search/parallel.hpp"
#include "diagnosis/search/screening.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kHats = 10;
constexpr std::size_t kSimulated = 3;  // of the best laws by their columns
constexpr int kRounds = 4;
constexpr std::size_t kAlternations = 4;
constexpr double kNudge = 0.02, kWorthARound = 0.99;
/// Part of what a true effect does that its model may be wrong by, see takes_names_away().
constexpr double kWrongAboutOne = 0.05;
/// Part of what the least of many names does that a law need not do.
constexpr double kOfTheLeast = 0.1;
constexpr double kPulse = 2e-3;        // half width of the pulse [s]
constexpr std::size_t kInstants = 64;  // at which a jump is sought first
constexpr double kLongestJump = 5e-3;  // [s]

using Series = std::vector<double>;

/// Motion of an axis as commanded, by central differences.
struct Course {
  Series position, velocity, acceleration;
};

Course course_of(const Series& q, double period) {
  Course c{q, Series(q.size(), 0.0), Series(q.size(), 0.0)};
  for (std::size_t k = 1; k + 1 < q.size(); ++k) {
    c.velocity[k] = (q[k + 1] - q[k - 1]) / (2 * period);
    c.acceleration[k] = (q[k + 1] - 2 * q[k] + q[k - 1]) / (period * period);
  }
  return c;
}

/// How the channels answer at one axis.
struct Response {
  bool moves = false;
  SeriesOfChannels displacement;     ///< change per metre (or radian) of displacement
  std::vector<Series> force;         ///< impulse response per newton, per channel
  std::vector<char> through_motion;  ///< the channel sees the axis through its position
};

class Laws {
 public:
  Laws(const Evidence& evidence, const FittedMachine& at)
      : evidence_(evidence), at_(at), period_(evidence.record().period) {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const MeasuredSignal* command = evidence.record().find(SignalKind::command, i);
      courses_.push_back(command ? course_of(command->value, period_) : Course{});
      const auto faster = [](double v) { return std::abs(v) > 0.2e-3; };
      moves_.push_back(
          std::any_of(courses_[i].velocity.begin(), courses_[i].velocity.end(), faster));
    }
    responses_.resize(kAxisCount);
    parallel_for(kAxisCount, [&](std::size_t i) {
      if (moves_[i]) responses_[i] = response_of(i);
    });
  }

  /// All laws that are tried, without values.
  std::vector<Law> all() const {
    std::vector<Law> laws;
    using Point = Law::Point;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (!moves_[i]) continue;
      const auto add = [&](Point point, Covariate over, std::size_t of, Covariate times) {
        Law law;
        law.axis = static_cast<Law::OfAxis>(i);
        law.point = point;
        law.over = over;
        law.over_axis = static_cast<Law::OfAxis>(of);
        law.times = times;
        law.times_axis = static_cast<Law::OfAxis>(i);
        law.at = knots(law);
        if (law.at.size() == kHats) laws.push_back(law);
      };
      using enum Covariate;
      for (const Point point : {Point::table_force, Point::displacement}) {
        add(point, position, i, time);
        add(point, position, i, sign);
        add(point, velocity, i, time);
        add(point, acceleration, i, time);
        add(point, time, i, time);
        add(point, time, i, sign);
        add(point, time, i, position);
      }
      for (std::size_t j = 0; j < kAxisCount; ++j) {
        if (j == i || !moves_[j]) continue;
        for (const Covariate c : {position, velocity, acceleration})
          add(Point::displacement, c, j, time);
        for (const Covariate times : {time, sign}) add(Point::table_force, position, j, times);
      }
      if (!is_read(i)) continue;
      for (std::size_t j = 0; j < kAxisCount; ++j)
        if (moves_[j]) add(Point::reading, position, j, time);
      add(Point::reading, time, i, time);
    }
    return laws;
  }

  /// Jumps in time, each where `gain` of it is largest: of the displacement of axes and of
  /// readings.
  template <class GainOf>
  std::vector<Law> jumps(const GainOf& gain) const {
    std::vector<Law> all;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (moves_[i]) all.push_back(jump(i, Law::Point::displacement, 1));
      if (is_read(i)) all.push_back(jump(i, Law::Point::reading, 1));
    }
    parallel_for(all.size(), [&](std::size_t i) {
      const auto at = [&](std::size_t sample) {
        return jump(all[i].axis_index(), all[i].point, sample);
      };
      const std::size_t samples = evidence_.record().samples();
      std::size_t step = samples / kInstants, best = 0;
      double most = 0;
      const auto take_if_better = [&](std::size_t sample) {
        if (sample < 1 || sample + 1 >= samples) return;
        if (const double g = gain(at(sample)); g > most) most = g, best = sample;
      };
      for (std::size_t k = 1; k < kInstants; ++k) take_if_better(k * step);
      while (best > 0 && step > 1) {
        step = (step + 1) / 2;
        const std::size_t middle = best;
        take_if_better(middle - std::min(step, middle));
        take_if_better(middle + step);
      }
      all[i] = at(std::max<std::size_t>(1, best));
    });
    return all;
  }

  /// Whether the record has this component of the probe's reading.
  bool is_read(std::size_t component) const {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    return std::any_of(channels.begin(), channels.end(), [&](const ComparedChannel& c) {
      return is_reading(c.kind) && c.axis == component;
    });
  }

  std::vector<Column> columns(const Law& law) const {
    std::vector<Column> all;
    for (std::size_t h = 0; h < law.at.size(); ++h) {
      Law hat = law;
      hat.value.assign(law.at.size(), 0.0);
      hat.value[h] = 1;
      all.push_back(evidence_.whiten(change(hat)));
    }
    return all;
  }

  const Course& course(Law::OfAxis axis) const { return courses_[static_cast<std::size_t>(axis)]; }

 private:
  double covariate(Covariate c, Law::OfAxis axis, std::size_t k) const {
    const Course& of = course(axis);
    switch (c) {
      case Covariate::position:
        return of.position[k];
      case Covariate::velocity:
        return of.velocity[k];
      case Covariate::acceleration:
        return of.acceleration[k];
      case Covariate::sign:
        return of.velocity[k] > 0 ? 1 : of.velocity[k] < 0 ? -1 : 0;
      case Covariate::time:
        break;
    }
    return static_cast<double>(k) * period_;
  }

  Series knots(const Law& law) const {
    Series values;
    for (const RecordBlock& block : evidence_.partition().blocks)
      for (std::size_t k = block.begin; k < block.end; ++k)
        if (const double v = covariate(law.over, law.over_axis, k); std::isfinite(v))
          values.push_back(v);
    if (values.size() < 100) return {};
    // The outermost thousandth is left out: single peaks of the acceleration.
    const auto quantile = [&](double share) {
      const auto at = values.begin() +
                      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    const double low = quantile(0.001), high = quantile(0.999);
    Series at;
    if (!(high - low > 1e-9)) return at;
    for (std::size_t h = 0; h < kHats; ++h)
      at.push_back(low + (high - low) * static_cast<double>(h) / (kHats - 1));
    return at;
  }

  /// A law without values that changes from one sample to this one, shortly before it where samples
  /// are far from each other: it jumps (Law::jumps()).
  Law jump(std::size_t axis, Law::Point point, std::size_t sample) const {
    Law law;
    law.axis = law.over_axis = law.times_axis = static_cast<Law::OfAxis>(axis);
    law.point = point;
    const double time = static_cast<double>(sample) * period_;
    law.at = {time - std::min(period_, kLongestJump), time};
    return law;
  }

  Law pulse(std::size_t axis, double at, double size) const {
    Law law;
    law.axis = static_cast<Law::OfAxis>(axis);
    law.point = Law::Point::table_force;
    law.at = {at - kPulse, at, at + kPulse};
    law.value = {0, size, 0};
    return law;
  }

  Response response_of(std::size_t i) const {
    Response r;
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    Law constant;
    constant.axis = static_cast<Law::OfAxis>(i);
    constant.point = Law::Point::displacement;
    const double shift = is_rotary(i) ? 1e-6 : 1e-6;
    constant.at = {0, 1};
    constant.value = {shift, shift};
    r.displacement = difference(constant, 1 / shift);

    // A pulse where the axis moves fastest, so that friction does not hold it.
    const Series& v = courses_[i].velocity;
    std::size_t fastest = 0;
    for (std::size_t k = 0; k < v.size(); ++k)
      if (std::abs(v[k]) > std::abs(v[fastest])) fastest = k;
    const double time = static_cast<double>(fastest) * period_;
    const double size = is_rotary(i) ? 1 : 50;
    const SeriesOfChannels answer = difference(pulse(i, time, size), period_ / (size * kPulse));
    const auto length = static_cast<std::size_t>(std::round(0.3 / period_));
    const auto lead = static_cast<std::size_t>(std::round(kPulse / period_));
    for (std::size_t c = 0; c < channels.size(); ++c) {
      r.through_motion.push_back(is_reading(channels[c].kind));
      Series h;
      const bool own = channels[c].axis == i && !is_reading(channels[c].kind);
      for (std::size_t k = 0; own && k < length && fastest + k < v.size() + lead; ++k) {
        if (fastest + k < lead) continue;
        h.push_back(answer[c][fastest + k - lead]);
      }
      r.force.push_back(std::move(h));
    }
    return r;
  }

  SeriesOfChannels difference(const Law& law, double scale) const {
    Machine machine = at_.machine;
    machine.effects.laws.push_back(law);
    const Prediction p = evidence_.predict(machine);
    SeriesOfChannels d;
    for (std::size_t c = 0; c < p.size(); ++c) {
      d.emplace_back(p[c].size());
      for (std::size_t k = 0; k < p[c].size(); ++k)
        d[c][k] = (p[c][k] - at_.prediction[c][k]) * scale;
    }
    return d;
  }

  /// y of a law at every sample.
  Series strength(const Law& law) const {
    Series y(evidence_.record().samples());
    for (std::size_t k = 0; k < y.size(); ++k) {
      const double m = law.times == Covariate::time ? 1 : covariate(law.times, law.times_axis, k);
      y[k] = m * law.function(covariate(law.over, law.over_axis, k));
      if (!std::isfinite(y[k])) y[k] = 0;
    }
    return y;
  }

  static Series convolved(const Series& y, const Series& h, std::size_t lead) {
    Series out(y.size(), 0.0);
    for (std::size_t k = 0; k < y.size(); ++k) {
      if (y[k] == 0) continue;
      for (std::size_t j = 0; j < h.size() && k + j < y.size() + lead; ++j)
        if (k + j >= lead) out[k + j - lead] += y[k] * h[j];
    }
    return out;
  }

  /// What a law changes; channels that it does not change are empty.
  SeriesOfChannels change(const Law& law) const {
    const Response& r = responses_[law.axis_index()];
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    const Series y = strength(law);
    SeriesOfChannels p(channels.size());
    if (law.point == Law::Point::reading) {
      for (std::size_t c = 0; c < channels.size(); ++c)
        if (is_reading(channels[c].kind) && channels[c].axis == law.axis_index()) p[c] = y;
      return p;
    }
    Series motion = y;
    if (law.point == Law::Point::table_force) {
      const auto lead = static_cast<std::size_t>(std::round(kPulse / period_));
      motion.assign(y.size(), 0.0);
      for (std::size_t c = 0; c < channels.size(); ++c) {
        if (r.force[c].empty()) continue;
        p[c] = convolved(y, r.force[c], lead);
        if (channels[c].kind == SignalKind::position) motion = p[c];
      }
    }
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (!r.through_motion[c]) continue;
      p[c].resize(y.size());
      for (std::size_t k = 0; k < y.size(); ++k) p[c][k] = r.displacement[c][k] * motion[k];
    }
    return p;
  }

  const Evidence& evidence_;
  const FittedMachine& at_;
  double period_;
  std::vector<Course> courses_;
  std::vector<char> moves_;
  std::vector<Response> responses_;
};

struct LinearLaw {
  double gain = 0;
  Eigen::VectorXd value, sigma;
};

LinearLaw fit(const Evidence& evidence, const Ground& ground, const std::vector<Column>& columns) {
  std::vector<const Column*> own;
  for (const Column& c : columns) own.push_back(&c);
  const RoleGrams across = evidence.cross(ground.columns, own), among = evidence.cross(own, own);
  const Eigen::Index n = ground.precision.size(), k = among.fitted.rows();
  Eigen::VectorXd precision = Eigen::VectorXd::Zero(n + k), offset = Eigen::VectorXd::Zero(n + k);
  precision.head(n) = ground.precision;
  offset.head(n) = ground.offset;
  precision.tail(k).setConstant(1e-4 * among.fitted.diagonal().mean());
  const RoleGrams all = bordered(ground.grams, across, among);
  const LinearStep s = linear_step(all.fitted, all.held_out, precision, offset);
  Eigen::MatrixXd a = all.fitted.bottomRightCorner(n + k, n + k);
  a.diagonal() += precision;
  LinearLaw law;
  law.value = s.step.tail(k);
  law.sigma = a.inverse().diagonal().tail(k).cwiseMax(0).cwiseSqrt();
  // The ridge is no evidence: it is taken off what the priors of the step add up to.
  const double ridge = precision[n] * law.value.squaredNorm();
  law.gain = ground.held_out - (s.held_out - ridge);
  return law;
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

/// A law where it acts, in the loop.
struct Acting {
  Law law;
  Machine machine;
  Prediction prediction;
  Column residual;
  Ground ground;
  Settled settled;

  Acting(const Evidence& evidence, const Machine& without, Law own, const LinearPart& linear)
      : law(std::move(own)),
        machine(with(without, law)),
        prediction(evidence.predict(machine)),
        residual(evidence.residual(prediction)),
        ground(evidence, residual, linear),
        settled(settle(evidence, machine, ground, linear)) {}

  Acting(const Acting&) = delete;  // the ground refers to the residual

  static Machine with(Machine machine, const Law& law) {
    machine.effects.laws.push_back(law);
    return machine;
  }
};

/// Fits the values of a law again where it acts: the first ones come from the loop without it, and
/// friction is not linear. Returns their standard deviations.
Eigen::VectorXd refine(const Evidence& evidence, const Machine& without, const LinearPart& linear,
                       std::unique_ptr<Acting>& best) {
  LinearLaw fitted;
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
    const std::vector<Prediction> predictions = evidence.predict_all(nudged);
    std::vector<Column> columns(nudged.size());
    parallel_for(nudged.size(), [&](std::size_t h) {
      columns[h] = evidence.sensitivity(acting.prediction, predictions[h], step);
    });
    fitted = fit(evidence, acting.ground, columns);
    bool better = false;
    for (const double share : {1.0, 0.3}) {
      Law law = acting.law;
      for (std::size_t h = 0; h < law.value.size(); ++h)
        law.value[h] += share * fitted.value[static_cast<Eigen::Index>(h)];
      auto next = std::make_unique<Acting>(evidence, without, law, linear);
      if (!(next->settled.fitted < acting.settled.fitted)) continue;
      better = next->settled.fitted < kWorthARound * acting.settled.fitted;
      best = std::move(next);
      break;
    }
    if (!better) break;
  }
  return fitted.sigma;
}

}  // namespace

bool takes_names_away(double alone, const Named& named, double needed) {
  if (named.count <= 1) return alone > named.gain + needed + kWrongAboutOne * named.gain;
  return alone > named.gain - (named.count >= kImitation ? kOfTheLeast * named.least : 0);
}

std::string words_of(const Law& law) {
  constexpr const char* points[] = {"command", "command time", "motor force",
                                    "force",   "displacement", "reading"};
  constexpr const char* letters[] = {"t", "q", "v", "a", "sgn v"};
  const auto named = [&](Covariate c, Law::OfAxis axis) -> std::string {
    if (c == Covariate::time) return "t";
    return fmt::format("{}_{}", letters[static_cast<int>(c)],
                       kAxisNames[static_cast<std::size_t>(axis)]);
  };
  std::string factor;
  if (law.times == Covariate::sign)
    factor = fmt::format("sgn(v_{}) ", kAxisNames[static_cast<std::size_t>(law.times_axis)]);
  else if (law.times != Covariate::time)
    factor = named(law.times, law.times_axis) + " ";
  if (law.jumps())
    return fmt::format("{} on {} that jumps at {:.2f} s of the run",
                       points[static_cast<int>(law.point)], kAxisNames[law.axis_index()],
                       law.at.back());
  return fmt::format("{} on {} as {}f({})", points[static_cast<int>(law.point)],
                     kAxisNames[law.axis_index()], factor, named(law.over, law.over_axis));
}

LawFit best_law(const Evidence& evidence, const FittedMachine& at, const Doubt& doubt,
                const DiagnosisOptions& options) {
  const Laws laws(evidence, at);
  const LinearPart linear = at.linear();
  const Ground ground(evidence, at.residual, linear);
  const auto fitted = [&](const Law& law) { return fit(evidence, ground, laws.columns(law)); };
  std::vector<Law> all = laws.all();
  for (Law& jump : laws.jumps([&](const Law& law) { return fitted(law).gain; }))
    all.push_back(std::move(jump));
  std::vector<LinearLaw> fits(all.size());
  parallel_for(all.size(), [&](std::size_t i) { fits[i] = fitted(all[i]); });

  LawFit best;
  best.machine = at.machine;
  const double excess = std::max(1.0, ground.held_out - evidence.count(Role::held_out));
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t x, std::size_t y) { return fits[x].gain > fits[y].gain; });
  // The columns are a linearisation; the first few are asked what they do in the loop.
  const auto counted_of = [&](const Acting& law) {
    return counted(ground.held_out - law.ground.held_out, ground.held_out_of,
                   law.ground.held_out_of, doubt);
  };
  std::unique_ptr<Acting> acting;
  for (std::size_t rank = 0; rank < std::min(kSimulated, order.size()); ++rank) {
    const LinearLaw& f = fits[order[rank]];
    if (f.gain < options.law_gain) break;
    Law law = all[order[rank]];
    law.value.assign(f.value.data(), f.value.data() + f.value.size());
    auto now = std::make_unique<Acting>(evidence, at.machine, law, linear);
    if (const double gain = counted_of(*now); gain > best.gain) {
      best.gain = gain;
      acting = std::move(now);
    }
  }
  if (!acting) return best;
  Eigen::VectorXd sigma = refine(evidence, at.machine, linear, acting);
  // For want of the law declared numbers may have been pulled, and their columns lack it: they are
  // fitted with it, then the law where they stand.
  FittedMachine without = at;
  std::vector<LinearPart> parts;  // `acting` refers to them
  parts.reserve(kAlternations);
  for (std::size_t i = 0; i < kAlternations; ++i) {
    FittedMachine moved = without;
    moved.machine = Acting::with(moved.machine, acting->law);
    converge_anew(evidence, moved);
    moved.machine.effects.laws.pop_back();
    parts.push_back(moved.linear());
    auto again = std::make_unique<Acting>(evidence, moved.machine, acting->law, parts.back());
    Eigen::VectorXd anew = refine(evidence, moved.machine, parts.back(), again);
    const double before = acting->settled.fitted, now = again->settled.fitted;
    if (!(now < before)) break;
    acting = std::move(again);
    sigma = std::move(anew);
    without = std::move(moved);
    if (now > kWorthARound * before) break;
  }
  Law& law = best.law.law = acting->law;
  law.label = "learned: " + words_of(law);
  for (std::size_t h = 0; h < law.value.size(); ++h) {
    const double band = 1.96 * sigma[static_cast<Eigen::Index>(h)];
    best.law.low.push_back(law.value[h] - band);
    best.law.high.push_back(law.value[h] + band);
  }
  best.gain = counted_of(*acting);
  best.law.words = "behaves like " + words_of(law);
  best.law.share = std::min(1.0, best.gain / excess);
  // What that leaves is told in the loop: numbers moved along their columns may disappoint there.
  FittedMachine learned = without;
  learned.machine = acting->machine;
  converge(evidence, learned);
  best.machine = evidence.chi2(learned.residual, Role::fitted) < acting->settled.fitted
                     ? learned.machine
                     : acting->settled.machine;
  best.machine.effects.laws.back() = law;  // with its label
  if (evidence.chi2(evidence.residual(evidence.predict(best.machine)), Role::held_out) >=
      evidence.chi2(at.residual, Role::held_out)) {
    best.gain = 0;
    best.machine = at.machine;
    return best;
  }
  const double band = options.class_gain + options.class_share * excess;
  for (const std::size_t i : order)
    if (fits[i].gain > fits[order.front()].gain - band &&
        words_of(all[i]) != words_of(best.law.law) && best.law.not_distinguishable_from.size() < 5)
      best.law.not_distinguishable_from.push_back(words_of(all[i]));
  return best;
}

}  // namespace vcnc
