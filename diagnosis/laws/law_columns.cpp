#include "diagnosis/laws/law_columns.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/parallel.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

using Series = std::vector<double>;

constexpr std::size_t kHats = 10;
constexpr double kPulse = 2e-3;           // half width of the pulse [s]
constexpr std::size_t kInstants = 64;     // at which a jump is sought first
constexpr std::size_t kNearInstants = 2;  // of these, the best, next to which it is sought
constexpr double kLongestJump = 5e-3;     // [s]

Law pulse(std::size_t axis, double at, double size) {
  Law law;
  law.axis = static_cast<Law::OfAxis>(axis);
  law.point = Law::Point::table_force;
  law.at = {at - kPulse, at, at + kPulse};
  law.value = {0, size, 0};
  return law;
}

Series convolved(const Series& y, const Series& h, std::size_t lead) {
  Series out(y.size(), 0.0);
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (y[k] == 0) continue;
    for (std::size_t j = 0; j < h.size() && k + j < y.size() + lead; ++j)
      if (k + j >= lead) out[k + j - lead] += y[k] * h[j];
  }
  return out;
}

}  // namespace

LawColumns::Course LawColumns::course_of(const Series& q, double period) {
  Course c{q, Series(q.size(), 0.0), Series(q.size(), 0.0)};
  for (std::size_t k = 1; k + 1 < q.size(); ++k) {
    c.velocity[k] = (q[k + 1] - q[k - 1]) / (2 * period);
    c.acceleration[k] = (q[k + 1] - 2 * q[k] + q[k - 1]) / (period * period);
  }
  return c;
}

LawColumns::LawColumns(const Evidence& evidence, const FittedMachine& at)
    : evidence_(evidence), at_(at), period_(evidence.record().period) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const MeasuredSignal* command = evidence.record().find(SignalKind::command, i);
    courses_.push_back(command ? course_of(command->value, period_) : Course{});
    const auto faster = [](double v) { return std::abs(v) > 0.2e-3; };
    moves_.push_back(std::any_of(courses_[i].velocity.begin(), courses_[i].velocity.end(), faster));
  }
  responses_.resize(kAxisCount);
  parallel_for(kAxisCount, [&](std::size_t i) {
    if (moves_[i]) responses_[i] = response_of(i);
  });
}

std::vector<Law> LawColumns::all() const {
  std::vector<Law> laws;
  using Point = Law::Point;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!moves_[i]) continue;
    const auto add = [&](Point point, Covariate over, std::size_t of, Covariate times) {
      if (!acts(i, point)) return;
      Law law;
      law.axis = static_cast<Law::OfAxis>(i);
      law.point = point;
      law.over = over;
      law.over_axis = static_cast<Law::OfAxis>(of);
      law.times = times;
      law.times_axis = static_cast<Law::OfAxis>(i);
      law.at = even_knots(law);
      if (law.at.size() == kHats) laws.push_back(law);
    };
    using enum Covariate;
    for (const Point point : {Point::table_force, Point::displacement}) {
      add(point, position, i, time);
      for (const Covariate way : {sign, forwards, backwards}) add(point, position, i, way);
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
      add(Point::displacement, position, j, position);
      for (const Covariate times : {time, sign}) add(Point::table_force, position, j, times);
    }
    if (!is_read(i)) continue;
    for (std::size_t j = 0; j < kAxisCount; ++j)
      if (moves_[j]) add(Point::reading, position, j, time);
    add(Point::reading, time, i, time);
  }
  return laws;
}

std::vector<Law> LawColumns::jumps(const std::function<double(const Law&)>& gain) const {
  std::vector<Law> all;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (moves_[i] && acts(i, Law::Point::displacement))
      all.push_back(jump(i, Law::Point::displacement, 1));
    if (is_read(i)) all.push_back(jump(i, Law::Point::reading, 1));
  }
  parallel_for(all.size(), [&](std::size_t i) {
    const auto at = [&](std::size_t sample) {
      return jump(all[i].axis_index(), all[i].point, sample);
    };
    const std::size_t samples = evidence_.record().samples();
    struct Instant {
      double gain = 0;
      std::size_t sample = 1;
    };
    const auto better = [](const Instant& a, const Instant& b) { return a.gain > b.gain; };
    const auto at_sample = [&](std::size_t sample) {
      return Instant{sample < 1 || sample + 1 >= samples ? 0 : gain(at(sample)), sample};
    };
    std::vector<Instant> instants;
    for (std::size_t k = 1; k < kInstants; ++k)
      instants.push_back(at_sample(k * (samples / kInstants)));
    std::stable_sort(instants.begin(), instants.end(), better);
    instants.resize(kNearInstants);
    // Between two of them the gain may rise steeply: the best one of all need not be next to it.
    for (Instant& best : instants)
      for (std::size_t step = samples / kInstants; best.gain > 0 && step > 1;) {
        step = (step + 1) / 2;
        const std::size_t middle = best.sample;
        for (const std::size_t sample : {middle - std::min(step, middle), middle + step})
          best = std::min(best, at_sample(sample), better);
      }
    const Instant& best = *std::min_element(instants.begin(), instants.end(), better);
    all[i] = at(best.gain > 0 ? best.sample : 1);
  });
  return all;
}

bool LawColumns::acts(std::size_t axis, Law::Point point) const {
  constexpr double kSeen = 0.01;                   // of a displacement
  const double lever = is_rotary(axis) ? 0.1 : 1;  // [m/rad]
  if (point != Law::Point::displacement) return true;
  const SeriesOfChannels& seen = responses_[axis].displacement;
  return std::any_of(seen.begin(), seen.end(), [&](const Series& channel) {
    return std::any_of(channel.begin(), channel.end(),
                       [&](double part) { return std::abs(part) > kSeen * lever; });
  });
}

bool LawColumns::is_read(std::size_t component) const {
  const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
  return std::any_of(channels.begin(), channels.end(), [&](const ComparedChannel& c) {
    return is_reading(c.kind) && c.axis == component;
  });
}

Column LawColumns::column(const Law& law) const { return evidence_.whiten(change(law)); }

std::vector<Column> LawColumns::columns(const Law& law) const {
  std::vector<Column> all;
  for (std::size_t h = 0; h < law.at.size(); ++h) {
    Law hat = law;
    hat.value.assign(law.at.size(), 0.0);
    hat.value[h] = 1;
    all.push_back(column(hat));
  }
  return all;
}

double LawColumns::covariate(Covariate c, Law::OfAxis axis, std::size_t k) const {
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
    case Covariate::forwards:
      return of.velocity[k] > 0 ? 1 : 0;
    case Covariate::backwards:
      return of.velocity[k] < 0 ? 1 : 0;
    case Covariate::time:
      break;
  }
  return static_cast<double>(k) * period_;
}

Series LawColumns::even_knots(const Law& law) const {
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
Law LawColumns::jump(std::size_t axis, Law::Point point, std::size_t sample) const {
  Law law;
  law.axis = law.over_axis = law.times_axis = static_cast<Law::OfAxis>(axis);
  law.point = point;
  const double time = static_cast<double>(sample) * period_;
  law.at = {time - std::min(period_, kLongestJump), time};
  return law;
}

LawColumns::Response LawColumns::response_of(std::size_t i) const {
  Response r;
  const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
  Law constant;
  constant.axis = static_cast<Law::OfAxis>(i);
  constant.point = Law::Point::displacement;
  const double shift = 1e-6;
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

SeriesOfChannels LawColumns::difference(const Law& law, double scale) const {
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
Series LawColumns::strength(const Law& law) const {
  Series y(evidence_.record().samples());
  for (std::size_t k = 0; k < y.size(); ++k) {
    const double m = law.times == Covariate::time ? 1 : covariate(law.times, law.times_axis, k);
    y[k] = m * law.function(covariate(law.over, law.over_axis, k));
    if (!std::isfinite(y[k])) y[k] = 0;
  }
  return y;
}

/// What a law changes; channels that it does not change are empty.
SeriesOfChannels LawColumns::change(const Law& law) const {
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

}  // namespace vcnc
