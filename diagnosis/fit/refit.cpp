#include "diagnosis/fit/refit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

std::vector<FreedNumber> moved(std::vector<FreedNumber> numbers, const Eigen::VectorXd& x) {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i].value = x[static_cast<Eigen::Index>(i)] * numbers[i].number.typical;
  return numbers;
}

/// Products of [z, J..., N...] of which those of the N with each other are computed once.
class Products {
 public:
  Products(const Evidence& evidence, const std::vector<Column>& linear)
      : evidence_(evidence), linear_(pointers(linear)) {
    own_ = evidence.products(linear_);
  }

  RoleGrams with(const Column& z, const std::vector<Column>& live) const {
    std::vector<const Column*> first{&z};
    for (const Column& c : live) first.push_back(&c);
    return bordered(evidence_.cross(first, first), evidence_.cross(first, linear_), own_);
  }

 private:
  const Evidence& evidence_;
  std::vector<const Column*> linear_;
  RoleGrams own_;
};

/// One point of the search, kept so that asking again for its derivatives costs no simulation.
struct Point {
  Eigen::VectorXd x;
  Prediction prediction;
  Column residual;
  std::vector<Column> columns;
};

/// s' A s - 2 b' s
struct Quadratic {
  const Eigen::MatrixXd& a;
  const Eigen::VectorXd& b;

  double at(const Eigen::VectorXd& s) const { return s.dot(a * s) - 2 * b.dot(s); }
  /// Half of the gradient.
  Eigen::VectorXd slope(const Eigen::VectorXd& s) const { return a * s - b; }
};

/// Lowest and highest step: no number further off its declaration than it is believed to be,
/// infinite without a tolerance.
struct StepBounds {
  Eigen::VectorXd low, high;

  StepBounds(const Eigen::VectorXd& precision, const Eigen::VectorXd& offset) {
    const Eigen::VectorXd reach = kFarthestPull * precision.cwiseSqrt().cwiseInverse();
    low = -reach - offset;
    high = reach - offset;
  }
  /// Nor out of what is allowed of it.
  StepBounds within(const std::vector<FreedNumber>& numbers) const {
    StepBounds closer = *this;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const FreedNumber& n = numbers[i];
      const auto at = static_cast<Eigen::Index>(i);
      const auto [least, most] = std::minmax(n.number.min, n.number.max);
      closer.low[at] = std::min(0.0, std::max(low[at], (least - n.value) / n.number.typical));
      closer.high[at] = std::max(0.0, std::min(high[at], (most - n.value) / n.number.typical));
    }
    return closer;
  }
  Eigen::VectorXd clamped(const Eigen::VectorXd& s) const { return s.cwiseMax(low).cwiseMin(high); }
  /// Numbers that are not at a bound beyond which they would go on downhill.
  std::vector<Eigen::Index> free_at(const Eigen::VectorXd& s, const Eigen::VectorXd& slope) const {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < s.size(); ++i)
      if (!(s[i] <= low[i] && slope[i] > 0) && !(s[i] >= high[i] && slope[i] < 0))
        free.push_back(i);
    return free;
  }
};

/// Numbers that would leave their bounds stay there, the others go on without them; those that
/// would come back then do not.
Eigen::VectorXd stopped_at_bounds(const Quadratic& q, const StepBounds& bounds) {
  const Eigen::Index n = q.b.size();
  Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> free(static_cast<std::size_t>(n));
  std::iota(free.begin(), free.end(), Eigen::Index{0});
  while (!free.empty()) {
    const Eigen::VectorXd left = -q.slope(s);  // of those at their bounds; the others are 0 here
    const Eigen::MatrixXd part = q.a(free, free);
    const Eigen::VectorXd inner = part.ldlt().solve(Eigen::VectorXd(left(free)));
    std::vector<Eigen::Index> inside;
    Eigen::VectorXd whole = s;
    whole(free) = inner;
    for (const Eigen::Index i : free) {
      if (whole[i] >= bounds.low[i] && whole[i] <= bounds.high[i])
        inside.push_back(i);
      else
        s[i] = std::clamp(whole[i], bounds.low[i], bounds.high[i]);
    }
    if (inside.size() == free.size()) return whole;
    free = std::move(inside);
  }
  return s;
}

/// Newton's steps of those that are free, projected on the bounds and shortened until they lead
/// downhill (Bertsekas, SIAM J. Control Optim. 20 (1982) 221).
Eigen::VectorXd descended(const Quadratic& q, const StepBounds& bounds, Eigen::VectorXd s) {
  constexpr int kSteps = 60, kHalvings = 40;
  constexpr double kEnough = 1e-4, kNothing = 1e-12, kRounding = 1e-8;
  double cost = q.at(s);
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::VectorXd slope = q.slope(s);
    const std::vector<Eigen::Index> free = bounds.free_at(s, slope);
    const Eigen::VectorXd rounding = kRounding * (q.b.cwiseAbs() + q.a.cwiseAbs() * s.cwiseAbs());
    if (std::all_of(free.begin(), free.end(),
                    [&](Eigen::Index k) { return std::abs(slope[k]) <= rounding[k]; }))
      break;
    Eigen::VectorXd way = Eigen::VectorXd::Zero(s.size());
    const Eigen::MatrixXd part = q.a(free, free);
    way(free) = -part.ldlt().solve(Eigen::VectorXd(slope(free)));
    Eigen::VectorXd next = s;
    double now = cost, share = 1;
    for (int k = 0; k < kHalvings; ++k, share /= 2) {
      next = bounds.clamped(s + share * way);
      now = q.at(next);
      if (now <= cost + kEnough * 2 * slope.dot(next - s)) break;
    }
    if (!(cost - now > kNothing * std::abs(cost))) break;
    s = std::move(next);
    cost = now;
  }
  return s;
}

/// Minimum of a quadratic within bounds.
struct BoundedStep {
  Eigen::VectorXd step;
  std::vector<Eigen::Index> free;  ///< numbers that are not at their bound
};

BoundedStep bounded_step(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                         const StepBounds& bounds) {
  const Quadratic q{a, b};
  BoundedStep s{stopped_at_bounds(q, bounds), {}};
  // Numbers whose columns nearly cancel each other stop at their bounds together, where the one
  // makes sense with the other beyond its own only.
  const Eigen::VectorXd none = bounds.clamped(Eigen::VectorXd::Zero(b.size()));
  s.step = descended(q, bounds, q.at(s.step) <= q.at(none) ? s.step : none);
  for (Eigen::Index i = 0; i < b.size(); ++i)
    if (s.step[i] > bounds.low[i] && s.step[i] < bounds.high[i]) s.free.push_back(i);
  return s;
}

/// Solves for the linear numbers at z; products of [z, J..., N...].
struct Eliminated {
  double cost = 0;
  Eigen::VectorXd step;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd gram;
};

Eliminated eliminate(const Eigen::MatrixXd& g, Eigen::Index live, const LinearPart& linear,
                     double damping) {
  const Eigen::Index n = static_cast<Eigen::Index>(linear.numbers.size());
  const Eigen::VectorXd precision = linear.precision(), offset = linear.offset();
  Eliminated e;
  e.cost = g(0, 0) + offset.dot(precision.cwiseProduct(offset));
  const Eigen::MatrixXd jj = g.block(1, 1, live, live);
  const Eigen::VectorXd jz = g.block(1, 0, live, 1);
  e.gradient = -jz;
  e.gram = jj;
  if (n == 0) return e;
  Eigen::MatrixXd a = g.block(1 + live, 1 + live, n, n);
  a.diagonal() *= 1 + damping;
  a.diagonal() += precision;
  a.diagonal().array() += 1e-12 * (1 + a.diagonal().maxCoeff());
  const Eigen::VectorXd b =
      g.block(1 + live, 0, n, 1) - Eigen::VectorXd(precision.cwiseProduct(offset));
  BoundedStep bounded = bounded_step(a, b, StepBounds(precision, offset));
  e.step = std::move(bounded.step);
  e.cost += e.step.dot(a * e.step) - 2 * b.dot(e.step);
  if (live > 0) {
    const Eigen::MatrixXd nj = g.block(1 + live, 1, n, live);
    e.gradient += nj.transpose() * e.step;
    if (!bounded.free.empty()) {
      const Eigen::MatrixXd free = nj(bounded.free, Eigen::all);
      const Eigen::MatrixXd part = a(bounded.free, bounded.free);
      e.gram -= free.transpose() * part.ldlt().solve(free);
    }
  }
  return e;
}

LinearStep step_in(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& held_out,
                   const Eigen::VectorXd& precision, const Eigen::VectorXd& offset, double damping,
                   const StepBounds& bounds) {
  const Eigen::Index n = precision.size();
  LinearStep s;
  Eigen::MatrixXd a = fitted.block(1, 1, n, n);
  a.diagonal() *= 1 + damping;
  a.diagonal() += precision;
  a.diagonal().array() += 1e-10 * (1e-6 + a.diagonal().array());
  const Eigen::VectorXd b =
      fitted.block(1, 0, n, 1) - Eigen::VectorXd(precision.cwiseProduct(offset));
  s.step = bounded_step(a, b, bounds).step;
  const Eigen::VectorXd at = offset + s.step;
  const double prior = at.dot(precision.cwiseProduct(at));
  s.fitted = left_after(fitted, s.step) + prior;
  s.held_out = left_after(held_out, s.step) + prior;
  return s;
}

}  // namespace

Eigen::VectorXd LinearPart::precision() const {
  Eigen::VectorXd p(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    p[static_cast<Eigen::Index>(i)] = numbers[i].precision();
  return p;
}

Eigen::VectorXd LinearPart::offset() const {
  Eigen::VectorXd o(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    o[static_cast<Eigen::Index>(i)] =
        (numbers[i].value - numbers[i].centre) / numbers[i].number.typical;
  return o;
}

LinearPart without(const LinearPart& part, const std::vector<FreedNumber>& live) {
  LinearPart left;
  for (std::size_t i = 0; i < part.numbers.size(); ++i) {
    const std::string& key = part.numbers[i].number.key;
    if (std::any_of(live.begin(), live.end(),
                    [&](const FreedNumber& n) { return n.number.key == key; }))
      continue;
    left.numbers.push_back(part.numbers[i]);
    left.columns.push_back(part.columns[i]);
  }
  return left;
}

LinearStep linear_step(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& held_out,
                       const Eigen::VectorXd& precision, const Eigen::VectorXd& offset,
                       double damping) {
  return step_in(fitted, held_out, precision, offset, damping, StepBounds(precision, offset));
}

LinearStep step_within_range(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& held_out,
                             const std::vector<FreedNumber>& numbers, double damping) {
  const LinearPart part{numbers, {}};
  const Eigen::VectorXd precision = part.precision(), offset = part.offset();
  return step_in(fitted, held_out, precision, offset, damping,
                 StepBounds(precision, offset).within(numbers));
}

std::vector<FreedNumber> between(const std::vector<FreedNumber>& from, std::vector<FreedNumber> to,
                                 double share) {
  for (FreedNumber& n : to) {
    for (const FreedNumber& f : from)
      if (f.number.key == n.number.key) n.value = f.value + share * (n.value - f.value);
    if (n.tolerance > 0) {
      const double reach = kFarthestPull * n.tolerance;
      n.value = std::clamp(n.value, n.centre - reach, n.centre + reach);
    }
    n.value = std::clamp(n.value, std::min(n.number.min, n.number.max),
                         std::max(n.number.min, n.number.max));
  }
  return to;
}

std::vector<Column> columns_of(const Evidence& evidence, const Machine& machine,
                               const Prediction& base, const std::vector<FreedNumber>& numbers) {
  std::vector<Column> columns(numbers.size());
  for (std::size_t first = 0; first < numbers.size(); first += Evidence::kTogether) {
    const std::size_t last = std::min(first + Evidence::kTogether, numbers.size());
    std::vector<Machine> changed;
    std::vector<double> steps;
    for (std::size_t i = first; i < last; ++i) {
      const FreedNumber& n = numbers[i];
      double step = is_place(n.number) ? 1e-3 * n.number.typical
                    : n.shape          ? 1e-4 * std::max(std::abs(n.value), 1e-3 * n.number.typical)
                              : std::clamp(0.1 * std::abs(n.value), 0.01 * n.number.typical,
                                           0.1 * n.number.typical);
      if (n.value + step > n.number.max) step = -step;
      changed.push_back(machine);
      move_number(changed.back(), n.number.key, n.value + step);
      steps.push_back(step / n.number.typical);
    }
    const std::vector<Prediction> predictions = evidence.predict_all(changed);
    parallel_for(changed.size(), [&](std::size_t i) {
      columns[first + i] = evidence.sensitivity(base, predictions[i], steps[i]);
    });
  }
  return columns;
}

Refit refit(const Evidence& evidence, const Machine& start, const std::vector<FreedNumber>& live,
            const LinearPart& linear, const RefitOptions& options) {
  Refit result;
  const auto k = static_cast<Eigen::Index>(live.size());
  const Products products(evidence, linear.columns);
  std::vector<Point> points;  // the last one and the best one are asked for again

  const auto visit = [&](const Eigen::VectorXd& x, bool derivatives) -> Point& {
    auto p = std::find_if(points.begin(), points.end(), [&](const Point& q) { return q.x == x; });
    if (p == points.end()) {
      if (points.size() > 1) points.erase(points.begin());
      Point fresh;
      fresh.x = x;
      fresh.prediction = evidence.predict(with(start, moved(live, x)));
      fresh.residual = evidence.residual(fresh.prediction);
      points.push_back(std::move(fresh));
      p = std::prev(points.end());
    }
    if (derivatives && p->columns.empty() && k > 0) {
      const std::vector<FreedNumber> at = moved(live, x);
      const Machine machine = with(start, at);
      p->columns = columns_of(evidence, machine, p->prediction, at);
    }
    return *p;
  };

  LeastSquaresProblem problem;
  problem.start.resize(k), problem.min.resize(k), problem.max.resize(k);
  problem.max_iterations = options.max_iterations;
  problem.hopeless_cost = options.hopeless;
  problem.cautious =
      options.begin == Begin::far &&
      std::any_of(live.begin(), live.end(), [](const FreedNumber& n) { return n.shape; });
  for (std::size_t i = 0; i < live.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double unit = live[i].number.typical;
    problem.start[at] = live[i].value / unit;
    problem.min[at] = std::min(live[i].number.min / unit, live[i].number.max / unit);
    problem.max[at] = std::max(live[i].number.min / unit, live[i].number.max / unit);
  }
  problem.evaluate = [&](const Eigen::VectorXd& x, bool derivatives) {
    const Point& p = visit(x, derivatives);
    const std::vector<Column> none;
    const Eigen::Index used = derivatives ? k : 0;
    const Eigen::MatrixXd g =
        products.with(p.residual, derivatives ? p.columns : none).fitted_with(options.weight);
    const Eliminated e = eliminate(g, used, linear, options.damping);
    Linearisation at{e.cost, {}, {}};
    if (derivatives) {
      at.gradient = e.gradient;
      at.gram = e.gram;
    }
    // What is known of the live numbers themselves.
    for (std::size_t i = 0; i < live.size(); ++i) {
      const double precision = live[i].precision();
      if (precision == 0) continue;
      const auto j = static_cast<Eigen::Index>(i);
      const double offset = x[j] - live[i].centre / live[i].number.typical;
      at.cost += precision * offset * offset;
      if (!derivatives) continue;
      at.gradient[j] += precision * offset;
      at.gram(j, j) += precision;
    }
    return at;
  };
  const LeastSquaresSolution solution = solve(problem);

  Point& best = visit(solution.x, true);
  const RoleGrams grams = products.with(best.residual, {});
  const LinearStep step = linear_step(grams.fitted_with(options.weight), grams.held_out,
                                      linear.precision(), linear.offset(), options.damping);
  result.live = moved(live, solution.x);
  result.linear = linear.numbers;
  for (std::size_t i = 0; i < result.linear.size(); ++i) {
    FreedNumber& n = result.linear[i];
    n.value += step.step[static_cast<Eigen::Index>(i)] * n.number.typical;
  }
  result.machine = with(with(start, result.live), result.linear);
  double prior = 0;
  for (const FreedNumber& n : result.live) prior += n.pull() * n.pull();
  result.fitted = step.fitted + prior;
  result.held_out = step.held_out + prior;
  result.residual = std::move(best.residual);
  result.columns = std::move(best.columns);
  result.linear_step = step.step;
  result.held_out_of = left_after(grams.held_out_of, step.step);
  return result;
}

}  // namespace vcnc
