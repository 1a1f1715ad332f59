#include "diagnosis/healthy/controller_lags.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "diagnosis/healthy/controller_check.hpp"
#include "diagnosis/healthy/drive_misfit.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {
namespace {

constexpr int kLagRounds = 3;
constexpr double kLagStep = 50e-6, kLongest = 4e-3;  // [s]
constexpr double kUncertain = 1e-3;  // part of a lag's normal equation that holds it
/// Of mean squares: what lags may leave of r, what one more may of what they leave, and what r must
/// be of the noise of the position.
constexpr double kWorthIt = 0.5, kWorthOneMore = 0.25, kAboveNoise = 4;
constexpr double kBetter = 0.95;   // of what another explanation leaves
constexpr std::size_t kAside = 5;  // samples to either side

/// What is late: a lag of the loops, or the whole command.
struct Lateness {
  const LoopLag* lag = nullptr;  ///< null: the command

  double of(const Machine& m, std::size_t axis) const {
    return lag ? m.axes[axis].servo.*lag->value : m.effects.axis[axis].get<CommandDelay>().delay;
  }
  void put(Machine& m, std::size_t axis, double value) const {
    (lag ? m.axes[axis].servo.*lag->value : m.effects.axis[axis].get<CommandDelay>().delay) = value;
  }
  bool is_beside_feedforward() const { return !lag || lag->value == &ServoParams::setpoint_lag; }
};
using Lags = std::vector<Lateness>;

constexpr const LoopLag *kPosition = &kLoopLags[0], *kSetpoint = &kLoopLags[1],
                        *kVelocity = &kLoopLags[2], *kFeedforward = &kLoopLags[3];

Machine with_later(Machine machine, const std::vector<std::size_t>& axes, const Lateness& late) {
  for (const std::size_t axis : axes) late.put(machine, axis, late.of(machine, axis) + kLagStep);
  return machine;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::isfinite(a[k]) && std::isfinite(b[k])) sum += a[k] * b[k];
  return sum;
}

/// Of a drive some lags: without feed-forward no set-point waits for it, and a command that is late
/// is much as a gain that is lower.
Lags of_drive(const ServoParams& servo, Lags lags) {
  if (!(servo.velocity_ff > 0))
    std::erase_if(lags, [](const Lateness& l) { return l.is_beside_feedforward(); });
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
      for (const Lateness& late : lags) machines.push_back(with_later(now.machine, axes_, late));
      std::vector<SeriesOfChannels> off;
      for (const Prediction& p : replica_.predict_all(machines))
        off.push_back(off_in_laps(record_, replica_.channels(), p));
      for (const std::size_t axis : axes_) {
        const Lags own = of_drive(now.machine.axes[axis].servo, lags);
        std::vector<std::vector<double>> r{check_.equation(axis, off[0])};
        for (std::size_t i = 0; i < lags.size(); ++i)
          if (std::any_of(own.begin(), own.end(),
                          [&](const Lateness& l) { return l.lag == lags[i].lag; }))
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
            bounded_lags(r, of(now.machine, axis, own), of(declared_, axis, own));
        for (std::size_t i = 0; i < own.size(); ++i)
          own[i].put(now.machine, axis, to[static_cast<Eigen::Index>(i)]);
      }
    }
    return now;
  }

 private:
  static Eigen::VectorXd of(const Machine& machine, std::size_t axis, const Lags& lags) {
    Eigen::VectorXd all(static_cast<Eigen::Index>(lags.size()));
    for (std::size_t i = 0; i < lags.size(); ++i)
      all[static_cast<Eigen::Index>(i)] = lags[i].of(machine, axis);
    return all;
  }

  const Record& record_;
  const Machine& declared_;
  MachineReplica replica_;
  ControllerCheck check_;
  std::vector<std::size_t> axes_;
};

}  // namespace

std::string told_lags(const Machine& was, const Machine& is, std::size_t axis) {
  std::string told;
  const auto tell = [&](const Lateness& late, std::string_view of) {
    const double before = late.of(was, axis), now = late.of(is, axis);
    if (before != now)
      told += fmt::format("{}{} {:.0f} -> {:.0f} us{}", told.empty() ? "" : ", ", of, 1e6 * before,
                          1e6 * now, now < kLongest ? "" : " (none longer is sought)");
  };
  for (const LoopLag& lag : kLoopLags) tell({&lag}, lag.of);
  tell({}, "the command");
  return told;
}

Machine with_lags_of(const Record& healthy, const Machine& declared) {
  const Record record = of_drives(healthy);
  if (record.stretches.empty()) return declared;
  const LagFit fit(record, declared);
  if (fit.axes().empty()) return declared;
  Machine machine = declared;
  PerAxis<double> left{};  // nought where none was kept
  const auto keep_where_better = [&](const Lags& lags, const Lags& instead) {
    const WithLags these = fit.fitted(lags), those = instead.empty() ? these : fit.fitted(instead);
    for (const std::size_t axis : fit.axes()) {
      const WithLags& best = those.left[axis] < kBetter * these.left[axis] ? those : these;
      const double now = left[axis] > 0 ? left[axis] : best.before[axis];  // nought where noise
      if (!(best.left[axis] < (left[axis] > 0 ? kWorthOneMore : kWorthIt) * now)) continue;
      left[axis] = best.left[axis];
      machine.axes[axis].servo = best.machine.axes[axis].servo;
      machine.effects.axis[axis].get<CommandDelay>() =
          best.machine.effects.axis[axis].get<CommandDelay>();
    }
  };
  const Lateness command, position{kPosition}, setpoint{kSetpoint}, velocity{kVelocity},
      feedforward{kFeedforward};
  keep_where_better({velocity, feedforward}, {});
  keep_where_better({setpoint, velocity, feedforward}, {command, velocity, feedforward});
  keep_where_better({position, setpoint, velocity, feedforward}, {});
  return machine;
}

}  // namespace vcnc
