#include "diagnosis/replica/readings_time.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/signal_name.hpp"
#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {

namespace {

constexpr double kMostLate = 0.2;        ///< [s] either way
constexpr double kToldAsLatency = 5e-3;  ///< [s] that an effect of the library explains
constexpr double kSurelyLate = 6e-3;     ///< [s]
constexpr double kLeavesLess = 25;       // times, of chi-square
constexpr double kExplains = 0.9;        ///< share, of what is certainly understood
constexpr double kSpeedOver = 10e-3;     ///< [s] of a mean
constexpr double kHalvesAgree = 2e-3;    ///< [s]
constexpr long kFiner = 20;              // steps of time in one of 2 ms
constexpr std::size_t kMostPoints = 5000;
constexpr std::size_t kFewestPoints = 100;

using Values = std::vector<double>;

/// Speed over 2 reach + 1 samples, of means over as many; NaN where it is not known.
Values smooth_speed(const Values& x, std::size_t reach, double period) {
  const std::size_t n = x.size(), width = 2 * reach + 1;
  Values mean(n, kMissing), result(n, kMissing);
  double sum = 0;
  std::size_t there = 0;
  for (std::size_t k = 0; k < n; ++k) {
    if (std::isfinite(x[k])) sum += x[k], ++there;
    if (k >= width && std::isfinite(x[k - width])) sum -= x[k - width], --there;
    if (k + 1 >= width && there == width) mean[k - reach] = sum / static_cast<double>(width);
  }
  for (std::size_t k = reach; k + reach < n; ++k)
    result[k] = (mean[k + reach] - mean[k - reach]) / (2 * static_cast<double>(reach) * period);
  return result;
}

/// The fit of one reading at any time, over a part of the record.
class TimeFit {
 public:
  TimeFit(const MeasuredSignal& signal, const Record& record, const std::vector<Values>& predicted)
      : period_(record.period),
        reach_(std::max<std::size_t>(
            1, static_cast<std::size_t>(std::lround(kSpeedOver / 2 / record.period)))) {
    const std::size_t n = record.samples();
    reading_ = smooth_speed(signal.value, reach_, period_);
    Values pushed(n, 0.0);
    for (const Values& p : predicted) {
      shifted_.push_back(smooth_speed(p, reach_, period_));
      for (std::size_t k = 0; k < n; ++k) pushed[k] += p[k] * p[k];
    }
    std::vector<Values> speeds;
    Values of_path(n, 0.0);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const MeasuredSignal* at = record.find(SignalKind::position, axis);
      if (!at) at = record.find(SignalKind::command, axis);
      if (!at) continue;
      Values v = smooth_speed(at->value, reach_, period_);
      double fastest = 0;
      for (const double x : v)
        if (std::isfinite(x)) fastest = std::max(fastest, std::abs(x));
      if (!(fastest > 0)) continue;
      Values sense(n, kMissing);
      for (std::size_t k = 0; k < n; ++k) sense[k] = std::tanh(v[k] / (kStands * fastest));
      for (std::size_t k = 0; axis <= kZ && k < n; ++k) of_path[k] += v[k] * v[k];
      fixed_.push_back(smooth_speed(v, reach_, period_));
      fixed_.push_back(smooth_speed(sense, reach_, period_));
      if (axis == signal.axis) speeds.push_back(v);
    }
    for (Values& v : speeds) {
      for (std::size_t k = 0; k < n; ++k)
        v[k] = of_path[k] > 0 ? v[k] / std::sqrt(of_path[k]) * std::sqrt(pushed[k]) : 0;
      fixed_.push_back(smooth_speed(v, reach_, period_));
    }
    // Columns of one size, so that the least of them counts, too.
    for (std::vector<Values>* all : {&shifted_, &fixed_})
      for (Values& column : *all) normalise(column);
  }

  /// Share that is left of samples [begin, end) at a time of `shift` samples; 1: nothing is known.
  double left(long shift, std::size_t begin, std::size_t end) const {
    const auto columns = static_cast<Eigen::Index>(shifted_.size() + fixed_.size());
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(columns), row(columns);
    double square = 0;
    std::size_t count = 0;
    const std::size_t stride =
        std::max<std::size_t>(std::max<std::size_t>(1, reach_ / 2), (end - begin) / kMostPoints);
    // The same samples at all times, so that what is left can be compared.
    const auto margin = static_cast<std::size_t>(most_shift());
    for (std::size_t k = begin + margin; k + margin < end; k += stride) {
      const double y = reading_[k];
      const auto from = static_cast<std::size_t>(static_cast<long>(k) - shift);
      Eigen::Index c = 0;
      for (const Values& s : shifted_) row[c++] = s[from];
      for (const Values& f : fixed_) row[c++] = f[k];
      if (!std::isfinite(y) || !row.allFinite()) continue;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
      right += y * row;
      square += y * y;
      ++count;
    }
    if (count < kFewestPoints || !(square > 0)) return 1;
    normal.diagonal().array() += kRidge * static_cast<double>(count);
    const Eigen::VectorXd x = normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    return std::clamp(1 - x.dot(right) / square, 0.0, 1.0);
  }

  long most_shift() const { return std::lround(kMostLate / period_); }
  long samples_of(double time) const { return std::lround(time / period_); }

 private:
  static constexpr double kStands = 0.01;  ///< share of the fastest, where a sense turns over
  static constexpr double kRidge = 1e-9;

  static void normalise(Values& x) {
    double square = 0, n = 0;
    for (const double v : x)
      if (std::isfinite(v)) square += v * v, ++n;
    if (!(square > 0)) return;
    const double factor = std::sqrt(n / square);
    for (double& v : x) v *= factor;
  }

  double period_;
  std::size_t reach_;
  Values reading_;
  std::vector<Values> shifted_, fixed_;
};

struct BestTime {
  long shift = 0;
  double left = 1;        ///< there
  double left_known = 1;  ///< at the best time that an effect explains
};

BestTime best_time(const TimeFit& fit, std::size_t begin, std::size_t end) {
  const long most = fit.most_shift(), known = fit.samples_of(kToldAsLatency);
  const long coarse = std::max(1L, fit.samples_of(2e-3));
  BestTime best;
  const auto look = [&](long shift) {
    const double left = fit.left(shift, begin, end);
    if (left < best.left) best.left = left, best.shift = shift;
    if (std::abs(shift) <= known) best.left_known = std::min(best.left_known, left);
  };
  for (long s = -most; s <= most; s += coarse) look(s);
  const long about = best.shift;
  const long fine = std::max(1L, coarse / kFiner);
  for (long s = about - coarse; s <= about + coarse; s += fine)
    if (std::abs(s) <= most) look(s);
  for (const long s : {-known, known}) look(s);
  return best;
}

}  // namespace

std::optional<double> lateness_of(const MeasuredSignal& signal, const Record& record,
                                  const std::vector<std::vector<double>>& predicted) {
  const TimeFit fit(signal, record, predicted);
  const std::size_t n = record.samples();
  const auto seconds = [&](long shift) { return static_cast<double>(shift) * record.period; };
  const BestTime all = best_time(fit, 0, n);
  if (std::abs(all.shift) >= fit.most_shift() || std::abs(seconds(all.shift)) < kSurelyLate ||
      all.left > 1 - kExplains || kLeavesLess * all.left > all.left_known)
    return std::nullopt;
  for (const auto& [begin, end] : {std::pair<std::size_t, std::size_t>{0, n / 2}, {n / 2, n}}) {
    const BestTime half = best_time(fit, begin, end);
    if (std::abs(seconds(half.shift - all.shift)) > kHalvesAgree) return std::nullopt;
  }
  return seconds(all.shift);
}

std::vector<std::string> check_reading_times(const Record& record, const Machine& declared,
                                             const std::optional<PieceParams>& piece) {
  Record moved = record;
  bool measured = true;
  std::erase_if(moved.signals, [&](const MeasuredSignal& s) {
    if (s.kind == SignalKind::command) {
      const bool position = record.find(SignalKind::position, s.axis) != nullptr;
      measured = measured && position;
      return position;
    }
    return s.kind != SignalKind::position && !is_reading(s.kind);
  });
  const MachineReplica replica(moved, declared, piece);
  std::vector<const MeasuredSignal*> readings;
  std::vector<std::vector<double>> predicted;
  const Prediction all = replica.predict(declared);
  for (std::size_t c = 0; c < all.size(); ++c) {
    const auto& [kind, axis] = replica.channels()[c];
    if (!is_reading(kind)) continue;
    readings.push_back(record.find(kind, axis));
    predicted.push_back(all[c]);
  }
  std::string late;
  for (const MeasuredSignal* s : readings)
    if (const std::optional<double> by = lateness_of(*s, record, predicted))
      late += fmt::format("{}\"{}\" ({}) is {:.0f} ms {}", late.empty() ? "" : ", ", s->source,
                          signal_name(s->kind, s->axis), 1e3 * std::abs(*by),
                          *by > 0 ? "late" : "early");
  if (late.empty()) return {};
  const std::string told = fmt::format(
      "{}: readings are not those of their time, by the {} of the axes: {}; put the "
      "time stamps right (up to 5 ms late is told as sample_latency)",
      record.source, measured ? "positions" : "commands", late);
  if (measured) throw MeasurementError(told);
  return {told + "; or the drives are late: record the positions, too"};
}

}  // namespace vcnc
