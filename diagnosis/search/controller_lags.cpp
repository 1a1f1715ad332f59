#include "diagnosis/search/controller_lags.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/search/controller_check.hpp"
#include "diagnosis/search/drive_misfit.hpp"

namespace vcnc {
namespace {

constexpr int kLagRounds = 3;
constexpr double kLagStep = 50e-6, kLongest = 2e-3;  // [s]
constexpr double kUncertain = 1e-3;  // part of a lag's normal equation that holds it
/// Of mean squares: what lags must take of r, and what r must be of the noise of the position.
constexpr double kWorthIt = 0.5, kAboveNoise = 4;
constexpr std::size_t kAside = 5;  // samples to either side

using Lag = double ServoParams::*;
constexpr std::array<Lag, 2> kLags{&ServoParams::position_lag, &ServoParams::velocity_lag};

Machine with_later(Machine machine, const std::vector<std::size_t>& axes, Lag lag) {
  for (const std::size_t axis : axes) machine.axes[axis].servo.*lag += kLagStep;
  return machine;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::isfinite(a[k]) && std::isfinite(b[k])) sum += a[k] * b[k];
  return sum;
}

}  // namespace

Machine with_lags_of(const Record& healthy, const Machine& declared) {
  const Record record = of_drives(healthy);
  if (record.stretches.empty()) return declared;
  const MachineReplica replica(record, declared, std::nullopt);
  const std::vector<ComparedChannel>& channels = replica.channels();
  const ControllerCheck check(record, channels, declared);
  std::vector<std::size_t> axes = axes_with_forces(record, replica);
  std::erase_if(axes, [&](std::size_t axis) {
    const ServoParams& servo = declared.axes[axis].servo;
    return servo.controller != ServoParams::Controller::cascade ||
           std::max(servo.position_lag, servo.velocity_lag) > kLongest;
  });
  if (axes.empty()) return declared;
  Machine now = declared;
  PerAxis<double> at_first{};
  for (int round = 0; round <= kLagRounds; ++round) {
    std::vector<Machine> machines{now};
    for (const Lag lag : kLags) machines.push_back(with_later(now, axes, lag));
    const std::vector<Prediction> predicted = replica.predict_all(machines);
    std::vector<SeriesOfChannels> off;
    for (const Prediction& p : predicted) off.push_back(off_in_laps(record, channels, p));
    for (const std::size_t axis : axes) {
      std::vector<std::vector<double>> r;
      for (const SeriesOfChannels& o : off) r.push_back(check.equation(axis, o));
      const double left = mean_square(r[0]);
      if (round == 0) {
        const std::vector<double>& position =
            off[0][channel_of(channels, SignalKind::position, axis)];
        if (left > kAboveNoise * mean_square_off_mean(position, kAside)) at_first[axis] = left;
      }
      ServoParams& servo = now.axes[axis].servo;
      if (round == kLagRounds) {
        if (left < kWorthIt * at_first[axis]) continue;  // never, where it is noise
        for (const Lag lag : kLags) servo.*lag = declared.axes[axis].servo.*lag;
        continue;
      }
      // A later lag leaves r less what it makes.
      for (std::size_t i = 1; i < r.size(); ++i)
        for (std::size_t k = 0; k < r[i].size(); ++k) r[i][k] = r[0][k] - r[i][k];
      Eigen::Matrix2d a;
      Eigen::Vector2d b;
      for (Eigen::Index i = 0; i < 2; ++i) {
        b[i] = product(r[static_cast<std::size_t>(i) + 1], r[0]);
        for (Eigen::Index j = 0; j < 2; ++j)
          a(i, j) = product(r[static_cast<std::size_t>(i) + 1], r[static_cast<std::size_t>(j) + 1]);
      }
      a.diagonal() *= 1 + kUncertain;
      if (!(a.determinant() > 0)) continue;
      const Eigen::Vector2d step = a.llt().solve(b);
      for (Eigen::Index i = 0; i < 2; ++i) {
        double& lag = servo.*kLags[static_cast<std::size_t>(i)];
        lag = std::clamp(lag + kLagStep * step[i], 0.0, kLongest);
      }
    }
  }
  return now;
}

}  // namespace vcnc
