#include "diagnosis/search/controller_lags.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/search/controller_check.hpp"
#include "diagnosis/search/drive_misfit.hpp"

namespace vcnc {
namespace {

constexpr int kLagRounds = 3;
constexpr double kLagStep = 50e-6, kLongest = 4e-3;  // [s]
constexpr double kUncertain = 1e-3;  // part of a lag's normal equation that holds it
/// Of mean squares: what lags may leave of r, what one more may of what they leave, and what r must
/// be of the noise of the position.
constexpr double kWorthIt = 0.5, kWorthOneMore = 0.25, kAboveNoise = 4;
constexpr std::size_t kAside = 5;  // samples to either side

using Lags = std::vector<LoopLag>;

Machine with_later(Machine machine, const std::vector<std::size_t>& axes, const LoopLag& lag) {
  for (const std::size_t axis : axes) machine.axes[axis].servo.*lag.value += kLagStep;
  return machine;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::isfinite(a[k]) && std::isfinite(b[k])) sum += a[k] * b[k];
  return sum;
}

/// Of a drive some lags, without that of a set-point which has no feed-forward to wait for.
Lags of_drive(const ServoParams& servo, Lags lags) {
  if (!(servo.velocity_ff > 0))
    std::erase_if(lags, [](const LoopLag& l) { return l.value == &ServoParams::setpoint_lag; });
  return lags;
}

/// Lags that leave least of r[0], of which r[1], ... take what each makes per second, from where
/// they are; little holds each to what is declared, so that two that do the same share what they
/// do. One that would leave its bounds stays there, and the others are fitted without it.
Eigen::VectorXd bounded_lags(const std::vector<std::vector<double>>& r, const Eigen::VectorXd& now,
                             const Eigen::VectorXd& declared) {
  const Eigen::Index lags = now.size();
  Eigen::MatrixXd a(lags, lags);
  Eigen::VectorXd b(lags);
  for (Eigen::Index i = 0; i < lags; ++i) {
    b[i] = product(r[static_cast<std::size_t>(i) + 1], r[0]);
    for (Eigen::Index j = 0; j < lags; ++j)
      a(i, j) = product(r[static_cast<std::size_t>(i) + 1], r[static_cast<std::size_t>(j) + 1]);
  }
  const Eigen::VectorXd hold = kUncertain * a.diagonal();
  b += a * now + Eigen::VectorXd(hold.cwiseProduct(declared));
  a.diagonal() += hold;
  Eigen::VectorXd to = now;
  std::vector<Eigen::Index> free(static_cast<std::size_t>(lags));
  std::iota(free.begin(), free.end(), Eigen::Index{0});
  while (!free.empty()) {
    to(free).setZero();
    const Eigen::VectorXd rest = b - a * to;
    const Eigen::MatrixXd part = a(free, free);
    if (!(part.diagonal().minCoeff() > 0)) return now;
    const Eigen::VectorXd inner = part.llt().solve(Eigen::VectorXd(rest(free)));
    to(free) = inner;
    std::vector<Eigen::Index> inside;
    for (const Eigen::Index i : free) {
      if (to[i] >= 0 && to[i] <= kLongest) inside.push_back(i);
      to[i] = std::clamp(to[i], 0.0, kLongest);
    }
    if (inside.size() == free.size()) break;
    free = std::move(inside);
  }
  return to;
}

/// A machine with some lags fitted, and mean squares of r; of an axis where r is noise, `before` is
/// nought.
struct WithLags {
  Machine machine;
  PerAxis<double> before{}, left{};
};

class LagFit {
 public:
  LagFit(const Record& record, const Machine& declared)
      : record_(record),
        declared_(declared),
        replica_(record, declared, std::nullopt),
        check_(record, replica_.channels(), declared),
        axes_(axes_with_forces(record, replica_)) {
    std::erase_if(axes_, [&](std::size_t axis) {
      const ServoParams& servo = declared.axes[axis].servo;
      return servo.controller != ServoParams::Controller::cascade ||
             std::any_of(kLoopLags.begin(), kLoopLags.end(),
                         [&](const LoopLag& lag) { return servo.*lag.value > kLongest; });
    });
  }

  const std::vector<std::size_t>& axes() const { return axes_; }

  WithLags fitted(const Lags& lags) const {
    WithLags now{declared_, {}, {}};
    for (int round = 0; round <= kLagRounds; ++round) {
      std::vector<Machine> machines{now.machine};
      for (const LoopLag& lag : lags) machines.push_back(with_later(now.machine, axes_, lag));
      std::vector<SeriesOfChannels> off;
      for (const Prediction& p : replica_.predict_all(machines))
        off.push_back(off_in_laps(record_, replica_.channels(), p));
      for (const std::size_t axis : axes_) {
        ServoParams& servo = now.machine.axes[axis].servo;
        const Lags own = of_drive(servo, lags);
        std::vector<std::vector<double>> r{check_.equation(axis, off[0])};
        for (std::size_t i = 0; i < lags.size(); ++i)
          if (std::any_of(own.begin(), own.end(),
                          [&](const LoopLag& l) { return l.value == lags[i].value; }))
            r.push_back(check_.equation(axis, off[i + 1]));
        now.left[axis] = mean_square(r[0]);
        if (round == 0) {
          const std::vector<double>& position =
              off[0][channel_of(replica_.channels(), SignalKind::position, axis)];
          if (now.left[axis] > kAboveNoise * mean_square_off_mean(position, kAside))
            now.before[axis] = now.left[axis];
        }
        if (round == kLagRounds) continue;
        // A later lag leaves r less what it makes.
        for (std::size_t i = 1; i < r.size(); ++i)
          for (std::size_t k = 0; k < r[i].size(); ++k) r[i][k] = (r[0][k] - r[i][k]) / kLagStep;
        const Eigen::VectorXd to =
            bounded_lags(r, of(servo, own), of(declared_.axes[axis].servo, own));
        for (std::size_t i = 0; i < own.size(); ++i)
          servo.*own[i].value = to[static_cast<Eigen::Index>(i)];
      }
    }
    return now;
  }

 private:
  static Eigen::VectorXd of(const ServoParams& servo, const Lags& lags) {
    Eigen::VectorXd all(static_cast<Eigen::Index>(lags.size()));
    for (std::size_t i = 0; i < lags.size(); ++i)
      all[static_cast<Eigen::Index>(i)] = servo.*lags[i].value;
    return all;
  }

  const Record& record_;
  const Machine& declared_;
  MachineReplica replica_;
  ControllerCheck check_;
  std::vector<std::size_t> axes_;
};

}  // namespace

std::string told_lags(const ServoParams& was, const ServoParams& is) {
  std::string told;
  for (const LoopLag& lag : kLoopLags)
    if (was.*lag.value != is.*lag.value)
      told += fmt::format("{}{} {:.0f} -> {:.0f} us{}", told.empty() ? "" : ", ", lag.of,
                          1e6 * was.*lag.value, 1e6 * is.*lag.value,
                          is.*lag.value < kLongest ? "" : " (none longer is sought)");
  return told;
}

Machine with_lags_of(const Record& healthy, const Machine& declared) {
  const Record record = of_drives(healthy);
  if (record.stretches.empty()) return declared;
  const LagFit fit(record, declared);
  if (fit.axes().empty()) return declared;
  const Lags all(kLoopLags.begin(), kLoopLags.end());
  Machine machine = declared;
  PerAxis<double> left{};
  for (std::ptrdiff_t without = 2; without >= 0; --without) {
    const WithLags with = fit.fitted(Lags(all.begin() + without, all.end()));
    for (const std::size_t axis : fit.axes()) {
      double& now = left[axis];
      const bool one_more = now > 0 && now < with.before[axis];
      if (now == 0) now = with.before[axis];
      // Never, where it is noise.
      if (!(with.left[axis] < (one_more ? kWorthOneMore : kWorthIt) * now)) continue;
      now = with.left[axis];
      machine.axes[axis].servo = with.machine.axes[axis].servo;
    }
  }
  return machine;
}

}  // namespace vcnc
