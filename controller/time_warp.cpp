#include "controller/time_warp.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kLastExcess = 1e-4;  ///< of a limit
constexpr int kMostSteps = 60;
constexpr double kFirstSlack = 0.1;    ///< at least; where the limit leaves less, it is exceeded
constexpr double kSlowestTime = 1e-4;  ///< of c; the solver has lost its way below
constexpr double kFirstGap = 0.1;
constexpr double kFirstGapOfNearest = 1e-4;
constexpr double kToBoundary = 0.95;  ///< share of the way to the nearest limit that a step goes
constexpr double kYield =
    1e-5;  ///< of a limit, per unit of its multiplier: none can block all others
constexpr double kRoughness = 1e-4;  ///< weight of the second difference of c
constexpr std::size_t kHeld = 3;     ///< coefficients that hold an end
constexpr std::size_t kFlat = 3;     ///< differences of coefficients that vanish at a free end
constexpr double kNearness = 30;     ///< weight of the change of c
constexpr double kGentleness = 2e4;  ///< and of its second difference: over some 5 steps
constexpr double kFlatness = 1e5;    ///< weight of these differences

using Triple = std::array<double, 3>;

/// Value, first and second difference of c at a grid point from its three coefficients.
Triple spline(const double* c) {
  return {(c[0] + 4 * c[1] + c[2]) / 6, 0.5 * (c[2] - c[0]), c[0] - 2 * c[1] + c[2]};
}

bool moves(const WarpNode& node, Eigen::Index axis) {
  return node.a1[axis] != 0 || node.j0_low[axis] != 0 || node.j0_high[axis] != 0;
}

/// Widens the limits to what c = 1 needs: next to a held end c cannot do much about it.
void ease(WarpNode& node) {
  constexpr double kMargin = 1.0005;
  node.c_max = std::max(node.c_max, kMargin);
  const auto largest = [](const Coordinates& low, const Coordinates& high) {
    return std::max({1.0, -kMargin * low.minCoeff(), kMargin * high.maxCoeff()});
  };
  const double a = largest(node.a0_low, node.a0_high);
  for (Coordinates* x : {&node.a0_low, &node.a0_high, &node.a1}) *x /= a;
  const double j = largest(node.j0_low, node.j0_high);
  for (Coordinates* x : {&node.j0_low, &node.j0_high, &node.j1, &node.j2}) *x /= j;
}

/// A limit at a grid point: what is left of it, and the derivative of that.
struct Slack {
  double left;
  Triple slope;
};

/// Calls visit(slack) for every limit.
template <class Visit>
void for_each_slack(const WarpNode& node, const Triple& v, Visit visit) {
  visit(Slack{1 - v[0] / node.c_max, {-1 / node.c_max, 0, 0}});
  const double reach = 1 / std::sqrt(v[0]), fall = -0.5 * reach / v[0];
  visit(Slack{v[0], {1, 0, 0}});
  visit(Slack{v[0] - v[2] / 6, {1, 0, -1.0 / 6}});  // the coefficient itself
  for (Eigen::Index k = 0; k < 5; ++k) {
    if (!moves(node, k)) continue;
    const double turn = node.a1[k] * v[1];
    visit(Slack{1 - node.a0_high[k] * v[0] - turn, {-node.a0_high[k], -node.a1[k], 0}});
    visit(Slack{1 + node.a0_low[k] * v[0] + turn, {node.a0_low[k], node.a1[k], 0}});
    const double j1 = node.j1[k], j2 = node.j2[k], rest = j1 * v[1] + j2 * v[2];
    const double high = node.j0_high[k], low = node.j0_low[k];
    visit(Slack{reach - high * v[0] - rest, {fall - high, -j1, -j2}});
    visit(Slack{reach + low * v[0] + rest, {fall + low, j1, j2}});
  }
}

double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Symmetric 3 x 3 matrix and vector in (value, first, second difference).
struct Local {
  Triple g{};
  std::array<Triple, 3> h{};
  void add(const Triple& d, double first, double second) {
    for (std::size_t r = 0; r < 3; ++r) {
      g[r] += first * d[r];
      for (std::size_t k = r; k < 3; ++k) h[r][k] += second * d[r] * d[k];
    }
  }
};

/// Primal-dual interior point method for one stretch, with a slack s and a multiplier z per limit.
class Solver {
 public:
  Solver(const std::vector<WarpNode>& nodes, WarpAim aim, std::vector<double> c, bool hold_start,
         bool hold_end)
      : nodes_(nodes),
        aim_(aim),
        c_(std::move(c)),
        first_(hold_start ? kHeld : 0),
        last_(c_.size() - (hold_end ? kHeld : 0)),
        step_(c_.size()),
        diagonals_(c_.size()) {
    const double gap = aim == WarpAim::fastest ? kFirstGap : kFirstGapOfNearest;
    begin_.reserve(nodes.size() + 1);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      begin_.push_back(limits_.size());
      for_each_slack(nodes_[i], spline(&c_[i]), [&](const Slack& limit) {
        const double slack = std::max(limit.left, kFirstSlack);
        limits_.push_back({.slack = slack, .multiplier = gap / slack});
      });
    }
    begin_.push_back(limits_.size());
  }

  const std::vector<double>& coefficients() const { return c_; }

  void run(double accuracy) {
    double share = 1;
    for (int step = 0; step < kMostSteps; ++step) {
      double gap = 0;
      for (const Limit& limit : limits_) gap += limit.slack * limit.multiplier;
      gap /= static_cast<double>(limits_.size());
      const double aim = std::max(0.3 * accuracy, gap * (share > 0.9   ? 0.1
                                                         : share > 0.5 ? 0.3
                                                                       : 0.7));
      const double excess = assemble(aim);
      if (gap < accuracy && excess < kLastExcess) break;
      solve();
      share = advance(aim);
    }
  }

 private:
  /// A limit at a grid point with what a step needs.
  struct Limit {
    double slack, multiplier;
    Triple slope{};
    double residual = 0, inverse = 0;
    double slack_step = 0, multiplier_step = 0;
  };

  Local objective(const Triple& v) const {
    Local local;
    if (aim_ == WarpAim::fastest) {
      const double reach = 1 / std::sqrt(v[0]);
      local.add({1, 0, 0}, -0.5 * reach / v[0], 0.75 * reach / (v[0] * v[0]));
    } else {
      local.add({1, 0, 0}, 2 * kNearness * (v[0] - 1), 2 * kNearness);
    }
    const double weight = aim_ == WarpAim::fastest ? kRoughness : kGentleness;
    const double rough = 2 * weight / (v[0] * v[0]);
    local.add({0, 0, 1}, rough * v[2], rough);
    return local;
  }

  /// Gradient and matrix of the step that aims at slack times multiplier = aim. Gives the largest
  /// excess over a limit.
  double assemble(double aim) {
    double excess = 0;
    std::fill(step_.begin(), step_.end(), 0.0);
    for (auto& row : diagonals_) row = {1e-12, 0, 0};
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const Triple v = spline(&c_[i]);
      Local local = objective(v);
      Limit* limit = &limits_[begin_[i]];
      for_each_slack(nodes_[i], v, [&](const Slack& now) {
        excess = std::max(excess, -now.left);
        const double s = limit->slack, z = limit->multiplier;
        limit->slope = now.slope;
        limit->residual = now.left + kYield * z - s;
        limit->inverse = 1 / (s + kYield * z);
        local.add(now.slope, -z - (aim - z * (s + limit->residual)) * limit->inverse,
                  z * limit->inverse);
        ++limit;
      });
      add(i, local);
    }
    for (std::size_t i = 0; i < std::min(kFlat, c_.size() - 1); ++i) {
      if (first_ == 0) flatten(i);
      if (last_ == c_.size()) flatten(c_.size() - 2 - i);
    }
    return excess;
  }

  /// Where the axes start from rest c hardly matters, and shall not swing.
  void flatten(std::size_t i) {
    const double slope = 2 * kFlatness * (c_[i + 1] - c_[i]);
    step_[i] -= slope;
    step_[i + 1] += slope;
    diagonals_[i][0] += 2 * kFlatness;
    diagonals_[i + 1][0] += 2 * kFlatness;
    diagonals_[i][1] -= 2 * kFlatness;
  }

  void add(std::size_t i, const Local& local) {
    constexpr Triple kValue{1.0 / 6, 4.0 / 6, 1.0 / 6}, kFirst{-0.5, 0, 0.5}, kSecond{1, -2, 1};
    const auto& h = local.h;
    for (std::size_t r = 0; r < 3; ++r) {
      const Triple row{kValue[r], kFirst[r], kSecond[r]};
      step_[i + r] += dot(local.g, row);
      const Triple m{h[0][0] * row[0] + h[0][1] * row[1] + h[0][2] * row[2],
                     h[0][1] * row[0] + h[1][1] * row[1] + h[1][2] * row[2],
                     h[0][2] * row[0] + h[1][2] * row[1] + h[2][2] * row[2]};
      for (std::size_t k = r; k < 3; ++k)
        diagonals_[i + r][k - r] += m[0] * kValue[k] + m[1] * kFirst[k] + m[2] * kSecond[k];
    }
  }

  /// step := -matrix^-1 step for the free coefficients, 0 for those held; L D L^T.
  void solve() {
    for (std::size_t i = 0; i < step_.size(); ++i) {
      if (i >= first_ && i < last_) continue;
      step_[i] = 0;
      diagonals_[i] = {1, 0, 0};
      for (std::size_t back = 1; back <= 2 && back <= i; ++back) diagonals_[i - back][back] = 0;
    }
    const std::size_t n = step_.size();
    for (std::size_t i = 0; i < n; ++i) {
      auto& row = diagonals_[i];
      const double inverse = 1 / row[0], l1 = row[1] * inverse, l2 = row[2] * inverse;
      if (i + 1 < n) {
        diagonals_[i + 1][0] -= l1 * row[1];
        diagonals_[i + 1][1] -= l1 * row[2];
        step_[i + 1] -= l1 * step_[i];
      }
      if (i + 2 < n) {
        diagonals_[i + 2][0] -= l2 * row[2];
        step_[i + 2] -= l2 * step_[i];
      }
      row[1] = l1;
      row[2] = l2;
      step_[i] *= -inverse;
    }
    for (std::size_t i = n; i-- > 0;) {
      if (i + 1 < n) step_[i] -= diagonals_[i][1] * step_[i + 1];
      if (i + 2 < n) step_[i] -= diagonals_[i][2] * step_[i + 2];
    }
  }

  /// Slacks and multipliers stay positive; what share of the step could be gone.
  double advance(double aim) {
    double primal = 1, dual = 1;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const Triple v = spline(&step_[i]);
      for (std::size_t k = begin_[i]; k < begin_[i + 1]; ++k) {
        Limit& limit = limits_[k];
        const double s = limit.slack, z = limit.multiplier;
        const double change = dot(limit.slope, v) + limit.residual;
        const double dz = (aim - z * (s + change)) * limit.inverse, ds = change + kYield * dz;
        limit.slack_step = ds;
        limit.multiplier_step = dz;
        if (-ds * primal > kToBoundary * s) primal = -kToBoundary * s / ds;
        if (-dz * dual > kToBoundary * z) dual = -kToBoundary * z / dz;
      }
    }
    for (Limit& limit : limits_) {
      limit.slack += primal * limit.slack_step;
      limit.multiplier += dual * limit.multiplier_step;
    }
    for (std::size_t i = 0; i < c_.size(); ++i) c_[i] += primal * step_[i];
    return std::min(primal, dual);
  }

  const std::vector<WarpNode>& nodes_;
  WarpAim aim_;
  std::vector<double> c_;
  std::size_t first_, last_;  ///< the free coefficients
  std::vector<Limit> limits_;
  std::vector<std::size_t> begin_;  ///< of the limits of each grid point
  std::vector<double> step_;
  std::vector<Triple> diagonals_;
};

}  // namespace

double WarpNode::use() const {
  return std::max({1 / std::sqrt(c_max), -a0_low.minCoeff(), a0_high.maxCoeff(), -j0_low.minCoeff(),
                   j0_high.maxCoeff()});
}

void WarpNode::exceeded(const std::array<double, 3>& ratio) {
  const auto raise = [](double found, Coordinates& low, Coordinates& high) {
    const double shown = std::max({1e-9, -low.minCoeff(), high.maxCoeff()});
    if (found <= shown || found <= 1) return 1.0;
    low *= found / shown;
    high *= found / shown;
    return found / shown;
  };
  if (ratio[0] > 1) c_max = std::min(c_max, 1 / (ratio[0] * ratio[0]));
  a1 *= raise(ratio[1], a0_low, a0_high);
  const double more = raise(ratio[2], j0_low, j0_high);
  j1 *= more;
  j2 *= more;
}

std::vector<double> time_warp(const std::vector<WarpNode>& nodes, WarpAim aim, double accuracy,
                              bool hold_start, bool hold_end) {
  std::vector<WarpNode> eased = nodes;
  for (std::size_t i = 0; i < std::min(kHeld + 1, nodes.size()); ++i) {
    if (hold_start) ease(eased[i]);
    if (hold_end) ease(eased[nodes.size() - 1 - i]);
  }
  Solver solver(eased, aim, std::vector<double>(nodes.size() + 2, 1.0), hold_start, hold_end);
  solver.run(accuracy);
  const std::vector<double>& c = solver.coefficients();
  // The outer coefficients count little; the others are positive where the solver came to an end.
  const bool sound = std::all_of(c.begin() + 1, c.end() - 1,
                                 [](double x) { return std::isfinite(x) && x > kSlowestTime; });
  return sound && std::isfinite(c.front()) && std::isfinite(c.back())
             ? c
             : std::vector<double>(c.size(), 1.0);
}

}  // namespace vcnc
