#include "analysis/lap_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcnc {
namespace {

constexpr double kEntryTravel = 0.5e-3, kEntryBand = 2e-6;   ///< [m]
constexpr double kExitBand = 50e-6;                          ///< [m]
constexpr double kExitSlope = 0.05, kSlopeTravel = 0.25e-3;  ///< drift of D per travel
constexpr double kPassBand = 3e-6, kPassTravel = 20e-3;      ///< [m]; a later pass is so far behind
constexpr double kNoTravel = 1e-9;                           ///< travel of a cycle at rest [m]
constexpr double kAdvance = 0.5;   ///< least share of the travel that must advance the station
constexpr double kOffLine = 1e-3;  ///< a line farther away is not the one followed [m]

}  // namespace

double station_step(const ScanLine& line, double a, double b) {
  const double d = b - a;
  if (!line.closed()) return d;
  return d - line.length() * std::round(d / line.length());
}

bool LapTracker::settle(const ErrorSample& sample) {
  const double d = sample.distance;
  if (d >= ball_radius_) {
    window_travel_ = -1;
    return false;
  }
  const double low = std::min(window_min_, d), high = std::max(window_max_, d);
  if (window_travel_ < 0 || high - low > kEntryBand) {
    window_min_ = window_max_ = d;
    window_travel_ = 0;
    return false;
  }
  window_min_ = low;
  window_max_ = high;
  window_travel_ += sample.travel;
  return window_travel_ >= kEntryTravel;
}

void LapTracker::enter(const ErrorSample& sample) {
  tracking_ = true;
  window_travel_ = -1;
  slope_from_ = sample.distance;
  slope_travel_ = 0;
  if (!entered_) {
    distance_ref_ = sample.distance;
    try {
      line_.emplace(piece_, ball_radius_, interference(), piece_.scan_height(sample.theoretical));
      kept_.resize(line_->stations().size());
    } catch (const std::invalid_argument&) {
      // The piece has no scan path at this height: the program follows some other path.
    }
  }
  entered_ = true;
  on_line_ = false;
  if (!line_) return;
  projection_ = line_->project(sample.theoretical);
  on_line_ = projection_.distance < kOffLine;
}

bool LapTracker::left(const ErrorSample& sample) {
  if (!sample.near_piece || std::abs(sample.distance - distance_ref_) > kExitBand) return true;
  slope_travel_ += sample.travel;
  if (slope_travel_ < kSlopeTravel) return false;
  const double slope = (sample.distance - slope_from_) / slope_travel_;
  slope_from_ = sample.distance;
  slope_travel_ = 0;
  return std::abs(slope) > kExitSlope;
}

bool LapTracker::differs_from_first_pass(std::size_t segment, double distance) {
  Kept& kept = kept_[segment];
  if (kept.at >= 0 && total_travel_ - kept.at > kPassTravel)
    return distance < kept.min - kPassBand || distance > kept.max + kPassBand;
  kept.min = kept.at < 0 ? distance : std::min(kept.min, distance);
  kept.max = kept.at < 0 ? distance : std::max(kept.max, distance);
  kept.at = total_travel_;
  return false;
}

LapTracker::Place LapTracker::track(const ErrorSample& sample) {
  total_travel_ += sample.travel;
  const bool gap = sample.tick != last_tick_ + 1;
  last_tick_ = sample.tick;
  if (!tracking_) {
    if (!sample.near_piece) window_travel_ = -1;
    if (!sample.near_piece || !settle(sample)) return {};
    enter(sample);
    return {};
  }
  if (left(sample)) {
    tracking_ = false;
    return {};
  }
  Place place;
  if (!on_line_) {
    place.from = travelled_;
    travelled_ += sample.travel;
    place.s = travelled_;
    place.direction = 1;
    place.on_path = sample.travel > kNoTravel;
    return place;
  }
  const double from = projection_.s;
  projection_ = line_->project(sample.theoretical, projection_);
  if (projection_.distance > kOffLine ||
      differs_from_first_pass(projection_.segment, sample.distance)) {
    tracking_ = false;
    return {};
  }
  const double step = station_step(*line_, from, projection_.s);
  place.on_line = true;
  place.s = projection_.s;
  place.from = gap ? place.s : from;
  place.direction = step > 0 ? 1 : -1;
  place.face = line_->face(projection_.segment);
  place.on_path = sample.travel > kNoTravel && std::abs(step) > kAdvance * sample.travel;
  return place;
}

}  // namespace vcnc
