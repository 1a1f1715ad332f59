#include "diagnosis/evidence/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "diagnosis/evidence/column_products.hpp"
#include "diagnosis/evidence/comparable.hpp"
#include "diagnosis/evidence/turning_weight.hpp"
#include "diagnosis/parallel.hpp"
#include "diagnosis/records/commanded_motion.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kShift = 10e-6;  // of a piece, to see what one does [m]
/// Times what encoders were reckoned to make of a reading that they may make of it.
constexpr double kUnderrated = 2;
/// Share of the variance of a noise from which on steps are most of it; steps that rounding is off
/// at most (half a one, a little more where what was rounded is rounded again); how much more
/// chi-square half a step makes than an even spread; and per sample, what beyond that is no chance.
constexpr double kMostlySteps = 0.5, kHalfAStep = 0.6, kMostOfSteps = 3, kSeenBeyondSteps = 0.005;
/// Part of the noise that there is at most where there is clearly less; times white noise that is
/// left where it is clearly not white.
constexpr double kQuieter = 0.8, kColoured = 1.1;
/// Times what encoders usually make of a signal, or laps differ by, from which on they decide what
/// an axis does; and how long before and after.
constexpr double kUndecided = 6, kUndecidedReach = 0.02;  // [s]
/// Below such a weight a reading tells nothing of noise.
constexpr float kTurnsOver = 0.5F;

/// Those columns that have something in a channel, and where they stand among all.
struct Present {
  ColumnRefs columns;
  std::vector<Eigen::Index> at;

  Present(const std::vector<const Column*>& all, std::size_t channel) {
    for (std::size_t i = 0; i < all.size(); ++i)
      if (const std::vector<float>& z = (*all[i])[channel]; !z.empty())
        columns.push_back(z.data()), at.push_back(static_cast<Eigen::Index>(i));
  }
  Eigen::MatrixXd none(const Present& across) const {
    return Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(at.size()),
                                 static_cast<Eigen::Index>(across.at.size()));
  }
};

/// Of every series, over what is known of it; of nothing nought.
std::vector<double> rms_of_all(const SeriesOfChannels& series) {
  std::vector<double> rms;
  for (const std::vector<double>& x : series) {
    double sum = 0, n = 0;
    for (const double v : x)
      if (std::isfinite(v)) sum += v * v, n += 1;
    rms.push_back(n > 0 ? std::sqrt(sum / n) : 0);
  }
  return rms;
}

/// Standard deviation by the median of the sizes, which few large ones do not change.
double usual_size(const std::vector<double>& series) {
  std::vector<double> sizes;
  for (const double v : series)
    if (std::isfinite(v)) sizes.push_back(std::abs(v));
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return 1.4826 * *middle;
}

/// Whose readings say where the ball is.
Machine without_slip(Machine machine) {
  machine.effects.get<PeriodSlip>() = {};
  return machine;
}

}  // namespace

Evidence::Evidence(const Record& record, Replica& replica, const Machine& declared,
                   std::vector<double> noise_scale, const std::vector<double>& form)
    : record_(with_bridged_commands(record)),
      replica_(replica),
      gathering_(replica),
      partition_(vcnc::partition(record)),
      declared_(replica.predict(declared)),
      noise_scale_(std::move(noise_scale)),
      form_(form) {
  for (const ComparedChannel& channel : replica.channels()) {
    const MeasuredSignal* signal = record.find(channel.kind, channel.axis);
    if (!signal) throw std::logic_error("a replica predicts a channel that the record has not");
    measured_.push_back(signal->value);
  }
  raw_valid_ = comparable_samples(record_, replica.channels(), measured_, declared_,
                                  replica.predict(without_slip(declared)));
  difference_ = measured_;
  for (std::size_t c = 0; c < difference_.size(); ++c)
    for (std::size_t k = 0; k < difference_[c].size(); ++k) difference_[c][k] -= declared_[c][k];
  mask(difference_);
  of_forces_ = replica.of_unknown_forces();
  per_shift_ = readings_per_shift(with_piece_shifted(declared, kShift));
  // A piece, an axis or a clock that drifts from lap to lap is no noise of the samples.
  if (partition_.repeated && !per_shift_.empty()) {
    std::vector<Machine> shifted = with_axes_shifted(declared, kShift);
    shifted.push_back(with_older_readings(declared));
    std::vector<SeriesOfChannels> all = readings_per_shift(shifted);
    all.insert(all.end(), per_shift_.begin(), per_shift_.end());
    take_out_shifts(partition_.stretches, all, difference_);
  }
  events_ = lap_events(partition_, record.period, replica.channels(), difference_);
  leave_out(events_);
  mask(difference_);
  reckon_with_rounding(declared);
}

void Evidence::reckon_with_rounding(const Machine& machine) {
  SeriesOfChannels rounding = rounding_of(machine);
  leave_out_undecided(rounding);
  mask(rounding);
  mask(difference_);
  weight_.assign(difference_.size(), {});
  noise_ = audited(difference_, rounding, coloured_);
  if (weigh_turning()) {
    noise_ = audited(difference_, rounding, coloured_);
    weigh_turning();
  }
  for (std::size_t c = 0; c < noise_.channels.size(); ++c) {
    ChannelNoise& channel = noise_.channels[c];
    const double louder = c < form_.size() ? std::hypot(1, form_[c] / channel.rms) : 1;
    channel.filter.scale *= noise_scale(c) * louder;
    channel.once.scale *= noise_scale(c) * louder;
    channel.of_laps /= louder * louder;
  }
  count_valid();
  of_shifts_ = {};
  shifts_.clear();
  if (!rounding.empty() && !per_shift_.empty())
    shifts_ = whitened_shifts(rms_shift(partition_.stretches, per_shift_, rounding));
  for (const SeriesOfChannels& force : of_forces_) shifts_.push_back(whitened(force));
  if (!shifts_.empty()) of_shifts_ = ShiftWhitening(partition_.stretches, shifts_);
  if (rounding.empty()) return;
  rms_of_rounding_ = rms_of_all(rounding);
  chi2_of_rounding_ = chi2_of(whiten(rounding), Role::held_out);
}

std::vector<double> Evidence::rounding_reckoned() const {
  std::vector<double> all = chi2_of_rounding_;
  all.resize(noise_.channels.size(), 0.0);
  for (std::size_t c = 0; c < all.size(); ++c)
    all[c] += count(c, Role::held_out) * share_of_steps(c);
  return all;
}

double Evidence::share_of_steps(std::size_t channel) const {
  const double step = step_of(channel), noise = noise_.channels[channel].rms;
  return std::min(1.0, step * step / 12 / (noise * noise));
}

std::vector<double> Evidence::made_by_steps(const Prediction& prediction) const {
  std::vector<double> all(measured_.size(), 0.0);
  for (std::size_t c = 0; c < all.size(); ++c)
    if (is_within_steps(prediction, c))
      all[c] = kMostOfSteps * count(c, Role::held_out) * share_of_steps(c);
  return all;
}

bool Evidence::is_within_steps(const Prediction& prediction, std::size_t channel) const {
  const double step = step_of(channel), noise = noise_.channels[channel].rms;
  if (share_of_steps(channel) < kMostlySteps) return false;
  const double other = std::sqrt(std::max(0.0, noise * noise - step * step / 12)),
               rounded = (noise_scale_.empty() ? 1 : 2) * kHalfAStep * step,  // a difference: twice
      most = rounded + 3 * other;
  double beyond = 0;
  for (std::size_t k = 0; k < measured_[channel].size(); ++k) {
    const double off = std::abs(measured_[channel][k] - prediction[channel][k]);
    if (raw_valid_[channel][k] && off > most) beyond += (off - most) * (off - most);
  }
  return beyond < noise * noise * kSeenBeyondSteps * count(channel, Role::both);
}

double Evidence::step_of(std::size_t channel) const {
  const ComparedChannel& of = replica_.channels()[channel];
  return record_.find(of.kind, of.axis)->resolution;
}

void Evidence::take_noise_from(const Machine& machine) {
  difference_ = left_by(machine);
  coloured_ = Coloured::noise;
  reckon_with_rounding(machine);
}

bool Evidence::noise_is_another_with(const Machine& machine) const {
  const SeriesOfChannels left = left_by(machine);
  const NoiseAudit now = audited(left, rounding_of(machine), Coloured::noise);
  const std::vector<double> rms = rms_of_all(left);
  for (std::size_t c = 0; c < now.channels.size(); ++c) {
    const double sigma = noise_.channels[c].rms;
    if (now.channels[c].rms < kQuieter * sigma) return true;
    if (coloured_ == Coloured::deviation && rms[c] > kColoured * sigma) return true;
  }
  return false;
}

SeriesOfChannels Evidence::left_by(const Machine& machine) const {
  const Prediction prediction = predict(machine);
  SeriesOfChannels left = measured_;
  for (std::size_t c = 0; c < left.size(); ++c)
    for (std::size_t k = 0; k < left[c].size(); ++k) left[c][k] -= prediction[c][k];
  mask(left);
  return left;
}

bool Evidence::underrates_rounding(const Machine& machine) const {
  if (rms_of_rounding_.empty()) return false;
  const std::vector<double> now = rms_of_all(rounding_of(machine));
  for (std::size_t c = 0; c < now.size(); ++c)
    if (is_reading(replica_.channels()[c].kind) && now[c] > kUnderrated * rms_of_rounding_[c] &&
        now[c] > noise_.channels[c].rms)
      return true;
  return false;
}

std::vector<double> Evidence::rounding_beyond_reckoned(const Machine& machine) const {
  if (chi2_of_rounding_.empty()) return {};
  std::vector<double> beyond = chi2_of(whiten(rounding_of(machine)), Role::held_out);
  for (std::size_t c = 0; c < beyond.size(); ++c)
    beyond[c] = std::max(0.0, beyond[c] - chi2_of_rounding_[c]);
  return beyond;
}

SeriesOfChannels Evidence::rounding_of(const Machine& machine) const {
  SeriesOfChannels rounding = replica_.rounding(machine);
  mask(rounding);
  return rounding;
}

void Evidence::leave_out(const std::vector<LapEvent>& events) {
  for (const LapEvent& e : events)
    for (std::size_t c = 0; c < raw_valid_.size(); ++c) {
      const ComparedChannel& channel = replica_.channels()[c];
      if (is_reading(channel.kind) || channel.axis == e.axis)
        std::fill(raw_valid_[c].begin() + static_cast<std::ptrdiff_t>(e.begin),
                  raw_valid_[c].begin() + static_cast<std::ptrdiff_t>(e.end), 0);
    }
}

void Evidence::leave_out_undecided(const SeriesOfChannels& rounding) {
  const auto reach = static_cast<std::size_t>(kUndecidedReach / record_.period);
  for (std::size_t c = 0; c < rounding.size(); ++c) {
    const std::vector<double>& x = rounding[c];
    const double usual =
        std::max(usual_size(x), lap_scatter(partition_, difference_[c]).value_or(0));
    for (std::size_t k = 0; k < x.size(); ++k) {
      if (!(std::abs(x[k]) > kUndecided * usual)) continue;
      const std::size_t begin = k > reach ? k - reach : 0, end = std::min(x.size(), k + reach + 1);
      std::fill(raw_valid_[c].begin() + static_cast<std::ptrdiff_t>(begin),
                raw_valid_[c].begin() + static_cast<std::ptrdiff_t>(end), 0);
    }
  }
}

NoiseAudit Evidence::audited(SeriesOfChannels series, const SeriesOfChannels& rounding,
                             Coloured coloured) const {
  for (std::size_t c = 0; c < series.size(); ++c)
    for (std::size_t k = 0; k < weight_[c].size(); ++k)
      if (weight_[c][k] < kTurnsOver) series[c][k] = kMissing;
  return audit_noise(record_, partition_, replica_.channels(), series, rounding, coloured);
}

bool Evidence::weigh_turning() {
  const std::vector<ComparedChannel>& channels = replica_.channels();
  if (!std::all_of(channels.begin(), channels.end(),
                   [](const ComparedChannel& c) { return is_reading(c.kind); }))
    return false;
  for (std::size_t c = 0; c < weight_.size(); ++c)
    weight_[c] = turning_weight(difference_[c], noise_.channels[c].rms, record_.period);
  return true;
}

void Evidence::count_valid() {
  valid_.clear();
  fitted_count_.clear();
  held_out_count_.clear();
  for (std::size_t c = 0; c < raw_valid_.size(); ++c) {
    valid_.emplace_back(record_.samples(), 0);
    const ChannelNoise& noise = noise_.channels[c];
    const std::size_t order = std::max(noise.filter.a.size(), noise.once.a.size());
    fitted_count_.push_back(0);
    held_out_count_.push_back(0);
    for (const RecordBlock& block : partition_.blocks) {
      double& count = block.held_out ? held_out_count_[c] : fitted_count_[c];
      std::size_t run = 0;  // valid samples before k
      for (std::size_t k = block.begin; k-- > 0 && run < order && raw_valid_[c][k];) ++run;
      for (std::size_t k = block.begin; k < block.end; ++k) {
        valid_[c][k] = raw_valid_[c][k] && run >= order;
        const double w = weight_[c].empty() ? 1 : static_cast<double>(weight_[c][k]);
        if (valid_[c][k]) count += w * w;
        run = raw_valid_[c][k] ? run + 1 : 0;
      }
    }
  }
}

std::vector<Column::Channels> Evidence::whitened_shifts(const Eigen::Vector3d& shift) const {
  std::vector<Column::Channels> all;
  for (std::size_t j = 0; j < per_shift_.size(); ++j) {
    SeriesOfChannels change = per_shift_[j];
    for (std::vector<double>& channel : change)
      for (double& d : channel) d *= shift[static_cast<Eigen::Index>(j)];
    all.push_back(whitened(change));
  }
  return all;
}

void Evidence::leave_out_drive(std::size_t axis) {
  for (std::size_t c = 0; c < valid_.size(); ++c) {
    const ComparedChannel& channel = replica_.channels()[c];
    if (channel.axis != axis || is_reading(channel.kind)) continue;
    std::fill(valid_[c].begin(), valid_[c].end(), 0);
    fitted_count_[c] = held_out_count_[c] = 0;
    for (Column::Channels& shift : shifts_) shift[c].clear();
  }
  if (!shifts_.empty()) of_shifts_ = ShiftWhitening(partition_.stretches, shifts_);
}

std::vector<SeriesOfChannels> Evidence::readings_per_shift(
    const std::vector<Machine>& shifted) const {
  const std::vector<ComparedChannel>& channels = replica_.channels();
  const auto reads = [](const ComparedChannel& c) { return is_reading(c.kind); };
  if (std::none_of(channels.begin(), channels.end(), reads)) return {};
  std::vector<SeriesOfChannels> all;
  for (const Prediction& answer : predict_all(shifted)) {
    SeriesOfChannels& change = all.emplace_back(channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c)
      for (std::size_t k = 0; reads(channels[c]) && k < record_.samples(); ++k)
        change[c].push_back((answer[c][k] - declared_[c][k]) / kShift);
    mask(change);
  }
  return all;
}

void Evidence::mask(SeriesOfChannels& series) const {
  for (std::size_t c = 0; c < series.size(); ++c)
    for (std::size_t k = 0; k < series[c].size(); ++k)
      if (!raw_valid_[c][k]) series[c][k] = kMissing;
}

Prediction Evidence::predict(const Machine& hypothesis) const {
  return std::move(predict_all({hypothesis})[0]);
}

std::vector<Prediction> Evidence::predict_all(const std::vector<Machine>& hypotheses) const {
  if (stop_ && stop_()) throw Stopped();
  return gathering_.predict_all(hypotheses);
}

std::vector<float> Evidence::whiten(std::size_t channel, const std::vector<double>& series) const {
  constexpr std::size_t kAtATime = 256;
  const ChannelNoise& noise = noise_.channels[channel];
  const std::vector<char>& valid = valid_[channel];
  const std::vector<float>& weight = weight_[channel];
  std::vector<float> z(series.size(), 0.0F);
  double v[kAtATime];
  for (const RecordBlock& block : partition_.blocks) {
    const WhiteningFilter& filter = block.once ? noise.once : noise.filter;
    const double per_scale = 1 / filter.scale;
    for (std::size_t k = block.begin; k < block.end;) {
      if (!valid[k]) {
        ++k;
        continue;
      }
      std::size_t n = 1;
      while (n < kAtATime && k + n < block.end && valid[k + n]) ++n;
      std::copy_n(&series[k], n, v);
      for (std::size_t j = 0; j < filter.a.size(); ++j) {
        const double a = filter.a[j];
        const double* const before = &series[k - 1 - j];
        for (std::size_t i = 0; i < n; ++i) v[i] -= a * before[i];
      }
      for (std::size_t i = 0; i < n; ++i) z[k + i] = static_cast<float>(v[i] * per_scale);
      for (std::size_t i = 0; i < n && !weight.empty(); ++i) z[k + i] *= weight[k + i];
      k += n;
    }
  }
  return z;
}

Column Evidence::residual(const Prediction& prediction) const {
  Column::Channels column(prediction.size());
  parallel_for(prediction.size(), [&](std::size_t c) {
    std::vector<double> r(prediction[c].size(), 0.0);
    for (std::size_t k = 0; k < r.size(); ++k) {
      if (!raw_valid_[c][k]) continue;
      // A hypothesis that says nothing where the declared machine does gains nothing by it.
      const double predicted = std::isfinite(prediction[c][k]) ? prediction[c][k] : declared_[c][k];
      r[k] = measured_[c][k] - predicted;
    }
    column[c] = whiten(c, r);
  });
  of_shifts_.apply(column);
  return column;
}

Column Evidence::sensitivity(const Prediction& base, const Prediction& changed, double step) const {
  Column::Channels column(base.size());
  std::vector<double> change;
  for (std::size_t c = 0; c < base.size(); ++c) {
    if (changed[c].shares(base[c])) continue;
    const std::vector<double>&after = changed[c], &before = base[c];
    change.resize(before.size());
    for (std::size_t k = 0; k < change.size(); ++k) change[k] = (after[k] - before[k]) / step;
    if (keep_comparable(c, change)) column[c] = whiten(c, change);
  }
  of_shifts_.apply(column);
  return column;
}

/// Puts zero where a change cannot be compared; whether anything is left.
bool Evidence::keep_comparable(std::size_t channel, std::vector<double>& change) const {
  double any = 0;
  for (std::size_t k = 0; k < change.size(); ++k) {
    const double d = change[k];
    change[k] = raw_valid_[channel][k] && std::isfinite(d) ? d : 0;
    any = std::max(any, std::abs(change[k]));
  }
  return any != 0;
}

Column::Channels Evidence::whitened(const SeriesOfChannels& change) const {
  Column::Channels column(change.size());
  for (std::size_t c = 0; c < change.size(); ++c) {
    if (change[c].empty()) continue;
    std::vector<double> d = change[c];
    if (keep_comparable(c, d)) column[c] = whiten(c, d);
  }
  return column;
}

Column Evidence::whiten(const SeriesOfChannels& change) const {
  Column::Channels column = whitened(change);
  of_shifts_.apply(column);
  return column;
}

double Evidence::share_of_turning(std::size_t channel) const {
  double turns = 0, all = 0;
  for (std::size_t k = 0; k < weight_[channel].size(); ++k)
    if (valid_[channel][k]) all += 1, turns += weight_[channel][k] < kTurnsOver;
  return all > 0 ? turns / all : 0;
}

double Evidence::count(std::size_t channel, Role role) const {
  return (role == Role::held_out ? 0 : fitted_count_[channel]) +
         (role == Role::fitted ? 0 : held_out_count_[channel]);
}

double Evidence::count(Role role) const {
  double n = 0;
  for (std::size_t c = 0; c < valid_.size(); ++c) n += count(c, role);
  return n;
}

double Evidence::scatter(std::size_t channel, Role role) const {
  return noise_.from_repetitions ? count(channel, role) * noise_.channels[channel].of_laps : 0;
}

double Evidence::chi2(const Column& column, std::size_t channel, Role role) const {
  double sum = 0;
  if (column[channel].empty()) return 0;
  for (const RecordBlock& block : partition_.blocks) {
    if (!takes(block, role)) continue;
    for (std::size_t k = block.begin; k < block.end; ++k) {
      const double z = static_cast<double>(column[channel][k]);
      sum += z * z;
    }
  }
  return sum;
}

double Evidence::chi2(const Column& column, Role role) const {
  double sum = 0;
  for (std::size_t c = 0; c < column.size(); ++c) sum += chi2(column, c, role);
  return sum;
}

std::vector<double> Evidence::chi2_of(const Column& column, Role role) const {
  std::vector<double> all;
  for (std::size_t c = 0; c < column.size(); ++c) all.push_back(chi2(column, c, role));
  return all;
}

double Evidence::rms_of(const std::vector<double>& series, std::size_t channel, Role role,
                        const std::vector<float>& weight) const {
  double sum = 0, n = 0;
  for (const RecordBlock& block : partition_.blocks) {
    if (!takes(block, role)) continue;
    for (std::size_t k = block.begin; k < block.end; ++k) {
      if (!raw_valid_[channel][k] || !std::isfinite(series[k])) continue;
      const double w = weight.empty() ? 1 : static_cast<double>(weight[k]);
      sum += w * w * series[k] * series[k];
      n += w * w;
    }
  }
  return n > 0 ? std::sqrt(sum / n) : 0;
}

double Evidence::rms(const Prediction& prediction, std::size_t channel, Role role) const {
  std::vector<double> off = measured_[channel];
  for (std::size_t k = 0; k < off.size(); ++k) off[k] -= prediction[channel][k];
  return rms_of(off, channel, role);
}

SeriesOfChannels Evidence::off_in_blocks(const Prediction& prediction, bool once) const {
  SeriesOfChannels off = measured_;
  for (std::size_t c = 0; c < off.size(); ++c)
    for (std::size_t k = 0; k < off[c].size(); ++k) off[c][k] -= prediction[c][k];
  mask(off);
  if (!once && !per_shift_.empty() && partition_.repeated)
    take_out_shifts(partition_.stretches, per_shift_, off, Shifts::constant);
  for (const RecordBlock& block : partition_.blocks)
    for (std::size_t c = 0; block.once != once && c < off.size(); ++c)
      std::fill(off[c].begin() + static_cast<std::ptrdiff_t>(block.begin),
                off[c].begin() + static_cast<std::ptrdiff_t>(block.end), kMissing);
  return off;
}

std::vector<double> Evidence::rms_within_laps(const Prediction& prediction, Role role) const {
  const SeriesOfChannels off = off_in_blocks(prediction, false);
  std::vector<double> all;
  for (std::size_t c = 0; c < off.size(); ++c) all.push_back(rms_of(off[c], c, role, weight_[c]));
  return all;
}

std::vector<double> Evidence::rms_run_once(const Prediction& prediction) const {
  const SeriesOfChannels off = off_in_blocks(prediction, true);
  std::vector<double> all;
  for (std::size_t c = 0; c < off.size(); ++c)
    all.push_back(rms_of(off[c], c, Role::both, weight_[c]));
  return all;
}

BlockGrams Evidence::grams(const std::vector<const Column*>& columns) const {
  const auto m = static_cast<Eigen::Index>(columns.size());
  BlockGrams all(partition_.blocks.size(), Eigen::MatrixXd::Zero(m, m));
  for (std::size_t c = 0; c < valid_.size(); ++c) {
    const Present x(columns, c);
    parallel_for(all.size(), [&](std::size_t b) {
      Eigen::MatrixXd sums = x.none(x);
      add_products(x.columns, partition_.blocks[b].begin, partition_.blocks[b].end, sums);
      all[b](x.at, x.at) += sums;
    });
  }
  return all;
}

/// Sums what `add` adds of each block and channel, each role for itself.
template <class Add>
RoleGrams Evidence::summed(const std::vector<const Column*>& a, const std::vector<const Column*>& b,
                           const Add& add) const {
  RoleGrams all = RoleGrams::none(static_cast<Eigen::Index>(a.size()),
                                  static_cast<Eigen::Index>(b.size()), valid_.size());
  parallel_for(valid_.size(), [&](std::size_t c) {
    const Present x(a, c), y(b, c);
    if (x.at.empty() || y.at.empty()) return;
    Eigen::MatrixXd fitted = x.none(y), held_out = fitted;
    for (const RecordBlock& block : partition_.blocks)
      add(x, y, block, block.held_out ? held_out : fitted);
    all.fitted_of[c](x.at, y.at) = fitted;
    all.held_out_of[c](x.at, y.at) = held_out;
  });
  for (std::size_t c = 0; c < valid_.size(); ++c) {
    all.fitted += all.fitted_of[c];
    all.held_out += all.held_out_of[c];
  }
  return all;
}

RoleGrams Evidence::products(const std::vector<const Column*>& columns) const {
  const RecentProducts::Known known = recent_.most_of(columns);
  RoleGrams all;
  if (2 * known.old.size() > columns.size()) {
    std::vector<const Column*> others;
    for (const Eigen::Index i : known.others)
      others.push_back(columns[static_cast<std::size_t>(i)]);
    all = completed(known.made->grams, known.from, known.old, cross(others, columns), known.others);
  } else {
    all = summed(columns, columns,
                 [](const Present& x, const Present&, const RecordBlock& block,
                    Eigen::MatrixXd& to) { add_products(x.columns, block.begin, block.end, to); });
  }
  recent_.keep(columns, all);
  return all;
}

RoleGrams Evidence::cross(const std::vector<const Column*>& a,
                          const std::vector<const Column*>& b) const {
  return summed(
      a, b, [](const Present& x, const Present& y, const RecordBlock& block, Eigen::MatrixXd& to) {
        add_products(x.columns, y.columns, block.begin, block.end, to);
      });
}

Eigen::MatrixXd Evidence::sum(const BlockGrams& grams, Role role) const {
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(grams.front().rows(), grams.front().cols());
  for (std::size_t b = 0; b < grams.size(); ++b)
    if (takes(partition_.blocks[b], role)) total += grams[b];
  return total;
}

}  // namespace vcnc
