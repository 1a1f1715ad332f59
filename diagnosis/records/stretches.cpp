#include "diagnosis/records/stretches.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "diagnosis/records/commanded_motion.hpp"
#include "model/axes.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr double kSame = 5e-6;          // [m or rad] between commands of equal laps
constexpr double kSameRoughly = 50e-6;  // [m or rad] between stretches of one condition
constexpr double kSameForces =
    0.05;  // share of known forces that those of another lap may differ by
constexpr double kShortestStretch = 0.1;  // [s]
constexpr double kLeastTravel = 2e-3;     // [m or rad] of a lap
constexpr double kSearchStep = 20e-3;     // [s] between samples at which a lap may begin
constexpr std::size_t kShares = 16;       // at which stretches are compared
constexpr double kRemembered = 0.3;       // [s] that a drive remembers
// Of two laps that are apart by more than this part of their way, or by more than this [m or rad]
// where there is none, one does another motion.
constexpr double kOtherWay = 0.1, kNoWay = 1e-3;

/// The commanded motion as a curve in the space of the axes.
class Curve5 {
 public:
  explicit Curve5(const Record& record) : motion_(commanded_motion(record)), h_(record.period) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      if (motion_.told[i] == CommandedMotion::Told::command && !motion_.followed[i])
        axes_.push_back(i);
  }
  bool empty() const { return axes_.empty(); }
  double period() const { return h_; }
  const std::vector<std::size_t>& axes() const { return axes_; }
  double velocity(std::size_t axis, std::size_t i) const { return motion_.velocity[axis][i]; }
  bool known(std::size_t i) const { return motion_.known[i]; }

  double speed(std::size_t i) const {
    double fastest = 0;
    for (const std::size_t axis : axes_)
      fastest = std::max(fastest, std::abs(motion_.velocity[axis][i]));
    return fastest;
  }
  /// Largest difference of an axis between the sample i and the time `at` [samples].
  double distance(std::size_t i, double at) const {
    const auto j = static_cast<std::size_t>(at);
    const double part = at - static_cast<double>(j);
    double largest = 0;
    for (const std::size_t axis : axes_) {
      const std::vector<double>& x = motion_.position[axis];
      const double there = part == 0 ? x[j] : x[j] + part * (x[j + 1] - x[j]);
      largest = std::max(largest, std::abs(way(axis, x[i], there)));
    }
    return largest;
  }
  /// From one position of an axis to another, whole turns of a rotary axis being none.
  static double way(std::size_t axis, double from, double to) {
    const double off = to - from;
    return is_rotary(axis) && std::abs(off) > kPi ? std::remainder(off, 2 * kPi) : off;
  }
  /// Whether both run in the same direction.
  bool same_direction(std::size_t i, std::size_t j) const {
    double dot = 0, one = 0, two = 0;
    for (const std::size_t axis : axes_) {
      const double a = motion_.velocity[axis][i], b = motion_.velocity[axis][j];
      dot += a * b;
      one += a * a;
      two += b * b;
    }
    return dot > 0.9 * std::sqrt(one * two);
  }
  /// Where between j - 1 and j + 1 the curve is nearest to the sample i, on its tangent [samples].
  double nearest(std::size_t i, std::size_t j) const {
    double along = 0, square = 0;
    for (const std::size_t axis : axes_) {
      const double v = motion_.velocity[axis][j] * h_;
      along += v * way(axis, motion_.position[axis][j], motion_.position[axis][i]);
      square += v * v;
    }
    return static_cast<double>(j) + (square > 0 ? std::clamp(along / square, -1.0, 1.0) : 0);
  }
  /// Whether `count` samples from i and from j on know of the same forces.
  bool same_forces(std::size_t i, std::size_t j, std::size_t count) const {
    double off = 0, all = 0;
    for (const std::size_t axis : axes_) {
      if (motion_.force[axis].empty()) continue;
      for (std::size_t k = 0; k < count; ++k) {
        const KnownForce &a = motion_.force[axis][i + k], &b = motion_.force[axis][j + k];
        off += std::pow(a.added - b.added, 2) + std::pow(a.applied - b.applied, 2);
        all += std::pow(a.added, 2) + std::pow(a.applied, 2);
      }
    }
    return off <= kSameForces * kSameForces * all;
  }

 private:
  CommandedMotion motion_;
  double h_;
  std::vector<std::size_t> axes_;
};

struct Span {
  std::size_t begin = 0, end = 0;
};

struct Laps {
  std::size_t begin = 0;
  double length = 0;  ///< T [samples]
  std::size_t count = 0;
};

class Segmentation {
 public:
  explicit Segmentation(const Record& record) : curve_(record) {}

  std::vector<Stretch> run(std::size_t samples) {
    for (const Span& part : moving_parts(samples)) divide(part);
    number();
    return std::move(stretches_);
  }
  bool empty() const { return curve_.empty(); }

 private:
  std::vector<Span> moving_parts(std::size_t samples) const {
    const auto rest = static_cast<std::size_t>(kStandingTime / curve_.period());
    std::vector<Span> parts;
    std::size_t last = 0;
    bool in_part = false;
    for (std::size_t i = 0; i < samples; ++i) {
      const bool moves = curve_.known(i) && curve_.speed(i) >= kStandingSpeed;
      if (moves && !in_part) parts.push_back({i, i + 1});
      if (moves) last = i;
      in_part = moves || (in_part && i - last <= rest && curve_.known(i));
      if (moves) parts.back().end = i + 1;
    }
    return parts;
  }

  /// How many samples from `from` on come back after `length`, up to `end`.
  std::size_t run_of_same(std::size_t from, double length, std::size_t end) const {
    std::size_t i = from;
    while (static_cast<double>(i) + length + 1 < static_cast<double>(end) &&
           curve_.distance(i, static_cast<double>(i) + length) < kSame)
      ++i;
    return i - from;
  }

  double travel(std::size_t begin, std::size_t end) const {
    double way = 0;
    for (std::size_t i = begin; i < end; ++i) way += curve_.speed(i) * curve_.period();
    return way;
  }

  std::optional<Laps> laps_from(std::size_t begin, std::size_t end) const {
    const auto shortest = static_cast<std::size_t>(kShortestStretch / curve_.period());
    for (std::size_t j = begin + shortest; 2 * j < begin + end; ++j) {
      // Steps are as long as the curve cannot come back in.
      const double away = curve_.distance(begin, static_cast<double>(j));
      const double reach = 2 * curve_.speed(j) * curve_.period() + kSame;
      if (away > reach) {
        j += static_cast<std::size_t>(std::min(20.0, 0.2 * (away / reach - 1)));
        continue;
      }
      if (!curve_.same_direction(begin, j)) continue;
      const double at = curve_.nearest(begin, j);
      if (curve_.distance(begin, at) > kSame) continue;
      const double length = at - static_cast<double>(begin);
      const std::size_t same = run_of_same(begin, length, end);
      // The end of the last lap may be missing by what stopping takes.
      if (static_cast<double>(same) < 0.98 * length) continue;
      if (travel(begin, j) < kLeastTravel) continue;
      const double all = static_cast<double>(same) + length;
      return Laps{begin, length, static_cast<std::size_t>(all / length + 0.02)};
    }
    return std::nullopt;
  }

  void divide(const Span& part) {
    const auto step =
        std::max<std::size_t>(1, static_cast<std::size_t>(kSearchStep / curve_.period()));
    std::size_t from = part.begin;
    for (std::size_t at = part.begin; at < part.end;) {
      const std::optional<Laps> laps = laps_from(at, part.end);
      if (!laps) {
        at += step;
        continue;
      }
      add(from, at);
      for (std::size_t n = 0; n < laps->count; ++n)
        add(lap_begin(*laps, n, part.end), lap_begin(*laps, n + 1, part.end));
      at = from = lap_begin(*laps, laps->count, part.end);
    }
    add(from, part.end);
  }
  static std::size_t lap_begin(const Laps& laps, std::size_t n, std::size_t end) {
    const double at = static_cast<double>(laps.begin) + static_cast<double>(n) * laps.length;
    return std::min(static_cast<std::size_t>(std::lround(at)), end);
  }

  void add(std::size_t begin, std::size_t end) {
    if (static_cast<double>(end - begin) * curve_.period() < kStandingTime || end <= begin) return;
    stretches_.push_back({begin, end, 0, 0, ""});
  }

  bool same_condition(const Stretch& a, const Stretch& b) const {
    const auto length = [](const Stretch& s) { return static_cast<double>(s.end - s.begin); };
    if (std::abs(length(a) - length(b)) > 2 + 1e-3 * length(a)) return false;
    for (std::size_t n = 0; n <= kShares; ++n) {
      const double share = static_cast<double>(n) / kShares;
      const auto i = a.begin + static_cast<std::size_t>(share * (length(a) - 1));
      const double at = static_cast<double>(b.begin) + share * (length(b) - 1);
      const double blur = 2 * curve_.speed(i) * curve_.period();  // laps begin between samples
      if (curve_.distance(i, at) > kSameRoughly + blur) return false;
    }
    return curve_.same_forces(a.begin, b.begin, std::min(a.end - a.begin, b.end - b.begin));
  }

  void number() {
    std::vector<std::size_t> first;  // stretch that a condition was first seen in
    std::vector<int> seen;
    for (std::size_t i = 0; i < stretches_.size(); ++i) {
      Stretch& s = stretches_[i];
      const auto known = std::find_if(first.begin(), first.end(), [&](std::size_t f) {
        return same_condition(stretches_[f], s);
      });
      const auto condition = static_cast<std::size_t>(known - first.begin());
      if (known == first.end()) {
        first.push_back(i);
        seen.push_back(0);
      }
      s.condition = static_cast<int>(condition);
      s.repetition = seen[condition]++;
      s.label = label(s);
    }
  }

  /// "X Y 33.3 mm/s, 2.40 s"
  std::string label(const Stretch& s) const {
    std::string axes;
    double fastest = 0, turning = 0;
    for (const std::size_t axis : curve_.axes()) {
      double most = 0;
      for (std::size_t i = s.begin; i < s.end; ++i)
        most = std::max(most, std::abs(curve_.velocity(axis, i)));
      if (most < kStandingSpeed) continue;
      axes += std::string(kAxisNames[axis]) + " ";
      (is_rotary(axis) ? turning : fastest) = std::max(is_rotary(axis) ? turning : fastest, most);
    }
    std::string text = axes;
    if (fastest > 0) text += fmt::format("{:.3g} mm/s ", fastest * 1e3);
    if (turning > 0) text += fmt::format("{:.3g} deg/s ", turning / kDegree);
    return text + fmt::format("{:.2f} s", static_cast<double>(s.end - s.begin) * curve_.period());
  }

  Curve5 curve_;
  std::vector<Stretch> stretches_;
};

/// Whether the commands of so many samples before two laps are the same; before a record begins,
/// all axes stand.
bool came_from_the_same(const Curve5& curve, std::size_t a, std::size_t b, std::size_t samples) {
  for (std::size_t k = 1; k <= samples; ++k) {
    const std::size_t i = a > k ? a - k : 0, j = b > k ? b - k : 0;
    const double blur = 2 * curve.speed(i) * curve.period();  // laps begin between samples
    if (curve.distance(i, static_cast<double>(j)) > kSameRoughly + blur) return false;
  }
  return true;
}

/// 0 where there is nothing.
double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

/// Standard deviation; 0 where there is nothing.
double deviation(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(values.size(), 1)));
}

/// Where an axis was told to be, else where it was; null: neither is known.
const MeasuredSignal* way_of(const Record& record, std::size_t axis) {
  const MeasuredSignal* told = record.find(SignalKind::command, axis);
  return told ? told : record.find(SignalKind::position, axis);
}

}  // namespace

std::size_t run_in(const Record& record, const std::vector<Stretch>& laps) {
  const Curve5 curve(record);
  if (curve.empty() || laps.empty()) return 0;
  const Stretch& first = laps.front();
  const auto settling = static_cast<std::size_t>(kRemembered / record.period);
  const bool alike = std::all_of(laps.begin() + 1, laps.end(), [&](const Stretch& lap) {
    return came_from_the_same(curve, first.begin, lap.begin, settling);
  });
  return alike ? 0 : std::min(settling, (first.end - first.begin) / 2);
}

bool same_way(const Record& a, const Stretch& of_a, const Record& b, const Stretch& of_b,
              At place) {
  const std::size_t n = std::min(of_a.end - of_a.begin, of_b.end - of_b.begin);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const MeasuredSignal *way_a = way_of(a, axis), *way_b = way_of(b, axis);
    if (!way_a || !way_b) continue;
    std::vector<double> x, apart;
    for (std::size_t k = 0; k < n; ++k) {
      const double p = way_a->value[of_a.begin + k], q = way_b->value[of_b.begin + k];
      if (std::isfinite(p) && std::isfinite(q)) x.push_back(p), apart.push_back(q - p);
    }
    if (deviation(apart) > kOtherWay * deviation(x) + kNoWay) return false;
    if (place == At::the_same_place && std::abs(mean_of(apart)) > kNoWay) return false;
  }
  return true;
}

std::vector<char> moving(const Record& record, std::size_t axis) {
  const std::size_t n = record.samples();
  const CommandedMotion motion = commanded_motion(record);
  if (motion.told[axis] != CommandedMotion::Told::command) return std::vector<char>(n, true);
  std::vector<char> result(n, false);
  const auto rest = static_cast<std::size_t>(kStandingTime / record.period);
  std::size_t left = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (std::abs(motion.velocity[axis][i]) >= kStandingSpeed) left = rest + 1;
    if (left > 0) {
      result[i] = true;
      --left;
    }
  }
  return result;
}

std::vector<Stretch> stretches_of(const Record& record) {
  Segmentation segmentation(record);
  if (segmentation.empty() || record.samples() < 2) return {};
  return segmentation.run(record.samples());
}

}  // namespace vcnc
