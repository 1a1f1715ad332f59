#include "analysis/curves.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr std::size_t kBuckets = 1200, kLissajousPoints = 1200, kCurvePoints = 2000;

/// ADC code to the signal before the amplifier, in units of the nominal amplitude: 1 Vpp is
/// amplified 2.5 times about the middle of a 3.3 V converter.
double normalised(double code, int bits) {
  return (code / std::ldexp(1.0, bits) * 3.3 - 1.65) / 1.25;
}

std::vector<FacePart> face_parts(const ScanLine& line) {
  std::vector<FacePart> parts;
  const auto& stations = line.stations();
  for (std::size_t i = 0; i + 1 < stations.size(); ++i) {
    if (parts.empty() || parts.back().face != line.face(i))
      parts.push_back({stations[i].s, stations[i].s, line.face(i)});
    parts.back().to = stations[i + 1].s;
  }
  return parts;
}

/// Mean error near each station of the line.
class PathMeans {
 public:
  explicit PathMeans(const ScanLine& line) : line_(line), bins_(line.stations().size()) {}
  void add(double s, double e_n) {
    const double at = s / line_.length() * static_cast<double>(bins_.size() - 1) + 0.5;
    Bin& bin = bins_[std::min(static_cast<std::size_t>(std::max(at, 0.0)), bins_.size() - 1)];
    bin.sum += e_n;
    ++bin.count;
  }
  std::vector<CurvePoint> points() const {
    std::vector<CurvePoint> result;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      // Stations are not quite evenly spaced, bins are: look up the station's own bin.
      const Station& st = line_.stations()[i];
      const double at = st.s / line_.length() * static_cast<double>(bins_.size() - 1) + 0.5;
      const Bin& bin = bins_[std::min(static_cast<std::size_t>(at), bins_.size() - 1)];
      const bool measured = bin.count > 0;
      result.push_back({st.centre, st.n, measured ? bin.sum / bin.count : 0, measured});
    }
    return result;
  }

 private:
  struct Bin {
    double sum = 0;
    int count = 0;
  };
  const ScanLine& line_;
  std::vector<Bin> bins_;
};

}  // namespace

Envelope::Envelope(double from, double to, std::size_t buckets)
    : from_(from),
      width_(std::max(to - from, 1e-12) / static_cast<double>(buckets)),
      buckets_(buckets) {}

void Envelope::add(double x, double y) {
  if (buckets_.empty()) return;
  const double at = std::clamp((x - from_) / width_, 0.0, static_cast<double>(buckets_.size() - 1));
  Bucket& b = buckets_[static_cast<std::size_t>(at)];
  if (b.count == 0 || y < b.y_min) b.x_min = x, b.y_min = y;
  if (b.count == 0 || y > b.y_max) b.x_max = x, b.y_max = y;
  ++b.count;
}

std::vector<Envelope::Point> Envelope::points() const {
  constexpr std::size_t kGap = 3;  // empty buckets that are shown as a gap
  std::vector<Point> result;
  std::size_t empty = kGap;
  for (const Bucket& b : buckets_) {
    if (b.count == 0) {
      ++empty;
      continue;
    }
    Point first{b.x_min, b.y_min, empty >= kGap}, second{b.x_max, b.y_max, false};
    if (b.x_max < b.x_min) {
      std::swap(first.x, second.x);
      std::swap(first.y, second.y);
    }
    empty = 0;
    result.push_back(first);
    if (second.x > first.x) result.push_back(second);
  }
  return result;
}

Curves collect_curves(const RecordingReader& recording, const Summary& summary) {
  Curves c;
  Evaluation evaluation(recording.begin());
  for (Envelope* e : {&c.e_n, &c.e_plan, &c.e_servo, &c.e_rest})
    *e = Envelope(0, std::max(summary.line_length, summary.last_station), kBuckets);
  const auto rows = static_cast<std::size_t>(summary.rows);
  const std::size_t lissajous_stride = rows / kLissajousPoints + 1,
                    path_stride = rows / kCurvePoints + 1;
  const double duration = seconds(summary.rows + static_cast<std::int64_t>(summary.missing_rows));
  const int bits = evaluation.machine().probe.adc_bits;
  std::optional<PathMeans> means;
  std::size_t k = 0;
  recording.for_each([&](const TelemetryRow& row) {
    const EvaluatedRow now = evaluation.row(row);
    const double t = seconds(now.error.tick);
    if (k == 0) {
      for (Envelope& e : c.following) e = Envelope(t, t + duration, kBuckets);
      c.bus_load = c.feed = Envelope(t, t + duration, kBuckets);
    }
    for (std::size_t j = 0; j < kAxisCount; ++j) c.following[j].add(t, now.error.following[j]);
    c.bus_load.add(t, row.bus_load);
    c.feed.add(t, row.feed);
    if (k % lissajous_stride == 0)
      for (std::size_t i = 0; i < 3; ++i)
        c.lissajous[i].push_back(
            {normalised(row.adc[2 * i], bits), normalised(row.adc[2 * i + 1], bits)});
    if (k % path_stride == 0) c.theoretical.push_back(now.error.theoretical);
    ++k;
    const bool in_whole_lap = now.lap >= 1 && now.lap <= summary.whole_laps;
    if (!now.counts() || (summary.whole_laps > 0 && !in_whole_lap)) return;
    c.path_feed = std::max(c.path_feed, row.feed);
    c.e_n.add(now.place.s, now.error.e_n);
    c.e_plan.add(now.place.s, now.error.e_plan);
    c.e_servo.add(now.place.s, now.error.e_servo);
    c.e_rest.add(now.place.s, now.error.e_rest);
    if (!now.place.on_line) return;
    if (!means) means.emplace(*evaluation.line());
    means->add(now.place.s, now.error.e_n);
  });
  if (means) c.path = means->points();
  if (evaluation.line() != nullptr) c.faces = face_parts(*evaluation.line());
  return c;
}

}  // namespace vcnc
