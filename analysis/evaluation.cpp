#include "analysis/evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "configs/config.hpp"

namespace vcnc {
namespace {

constexpr double kCrossingReach = 5e-3;          ///< statistics around a crossing [m]
constexpr double kInterferenceStep = 1e-6;       ///< histogram of the interference [m]
constexpr double kInterferenceMismatch = 20e-6;  ///< that is worth a warning [m]
constexpr std::size_t kMostAlarms = 10000;       ///< memory stays bounded

std::unique_ptr<Piece> piece_of(const RunBegin& begin) {
  if (begin.piece_toml.empty()) return nullptr;
  return make_piece(parse_piece(begin.piece_toml, "piece of the run"));
}

}  // namespace

Evaluation::Evaluation(const RunBegin& begin)
    : begin_(begin),
      machine_(declared(parse_machine(begin.declared_toml, "machine of the run"))),
      piece_(piece_of(begin)),
      dynamic_error_(machine_, piece_.get()),
      interference_(kInterferenceBins, 0) {
  if (!piece_) return;
  tracker_.emplace(*piece_, machine_.probe.ball_radius);
  if (piece_->params().kind != PieceParams::Kind::ring) return;
  const Vec3 axis = piece_->params().direction.normalized();
  const Vec3 x = std::abs(axis.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  circle_x_ = (x - x.dot(axis) * axis).normalized();
  circle_y_ = axis.cross(circle_x_);
}

EvaluatedRow Evaluation::row(const TelemetryRow& row) {
  EvaluatedRow result;
  const auto countable = [](double v) { return v >= 0 && v < 0x1p53; };  // not NaN either
  if (!countable(row.tick) || !countable(row.state) || row.state > 100) {
    ++damaged_;  // of a damaged file
    return result;
  }
  result.error = dynamic_error_.evaluate(row);
  const Tick tick = result.error.tick;
  if (rows_ > 0) {
    if (tick > last_tick_ + 1) missing_ += static_cast<std::uint64_t>(tick - last_tick_ - 1);
    if (tick <= last_tick_) ++disordered_;
  }
  last_tick_ = tick;
  ++rows_;
  const auto state = static_cast<NcState>(static_cast<int>(row.state));
  if (state == NcState::running || state == NcState::dwell || state == NcState::hold)
    for (std::size_t j = 0; j < kAxisCount; ++j)
      following_[j].add(result.error.following[j], seconds(tick));
  if (!tracker_ || state == NcState::hold) return result;  // held: it comes back to where it was
  result.place = tracker_->track(result.error);
  if (tracker_->line() != nullptr && coverage_.size() == 0) start_line();
  on_path(result);
  result.lap = lap_number_;
  return result;
}

void Evaluation::start_line() {
  const ScanLine& line = *tracker_->line();
  coverage_ = Coverage(line.length(), machine_.setup.bin_length);
  for (std::size_t i = 0; i < line.crossings().size(); ++i)
    crossing_names_.push_back(fmt::format(
        "crossing {}, {}", i + 1, kFaceNames[static_cast<std::size_t>(line.crossings()[i].face)]));
}

/// Closes the lap being run when its length has been travelled, and the run-in likewise.
void Evaluation::count_laps(double step) {
  if (!last_on_path_) {  // entering: what was begun before stays without its end
    rest_.merge(lap_);
    lap_ = {};
    lap_number_ = 0;
    lap_travel_ = 0;
  }
  lap_travel_ += std::abs(step);
  const double length = lap_number_ == 0 ? kRunIn : tracker_->line()->length();
  if (lap_travel_ < length) return;
  if (lap_number_ > 0) ++whole_laps_;
  (lap_number_ > 0 ? laps_ : rest_).merge(lap_);
  lap_ = {};
  lap_travel_ -= length;
  ++lap_number_;
}

void Evaluation::on_path(const EvaluatedRow& row) {
  const ErrorSample& e = row.error;
  const LapTracker::Place& place = row.place;
  if (!place.on_path) {
    last_on_path_ = false;
    over_samples_ = 0;
    over_arc_ = 0;
    return;
  }
  ++on_path_rows_;
  last_station_ = std::max(last_station_, place.s);
  const double depth = machine_.probe.ball_radius - e.distance;
  const double bin = depth / kInterferenceStep + 0.5;
  if (bin >= 0 && bin < kInterferenceBins) ++interference_[static_cast<std::size_t>(bin)];

  double step = 0;
  if (place.on_line) {
    step = station_step(*tracker_->line(), place.from, place.s);
    if (tracker_->line()->closed()) count_laps(step);
    coverage_.add(place.from, step, last_on_path_ ? std::max(e.contact, last_contact_) : e.contact);
  } else {
    ++off_line_rows_;
    step = place.s - place.from;
  }
  last_contact_ = e.contact;
  last_on_path_ = true;
  watch_tolerance(row, step);
  if (!row.counts()) return;

  live_e_n_.add(e.e_n, place.s);
  lap_.add(e, place.s, place.face);
  if (place.on_line) {
    const ScanLine& line = *tracker_->line();
    for (std::size_t i = 0; i < line.crossings().size(); ++i)
      if (std::abs(station_step(line, line.crossings()[i].s, place.s)) <= kCrossingReach)
        lap_.add_crossing(i, e, place.s);
  }
  if (piece_->params().kind == PieceParams::Kind::ring) collect_circle(row);
}

void Evaluation::watch_tolerance(const EvaluatedRow& row, double step) {
  if (!row.counts() || std::abs(row.error.e_n) <= machine_.setup.tolerance) {
    over_samples_ = 0;
    over_arc_ = 0;
    return;
  }
  if (over_samples_ > 0) over_arc_ += std::abs(step);
  const ToleranceFailure here{row.place.s, row.error.e_n};
  if (over_samples_ == 0 || here.worse_than(over_worst_)) over_worst_ = here;
  ++over_samples_;
  if (over_samples_ < kFailSamples || over_arc_ < kFailArc) return;
  if (!lap_.failure || over_worst_.worse_than(*lap_.failure)) lap_.failure = over_worst_;
}

void Evaluation::collect_circle(const EvaluatedRow& row) {
  const Vec3 r = row.error.theoretical - piece_->params().centre;
  const double phi = std::atan2(r.dot(circle_y_), r.dot(circle_x_));
  const double turn = std::remainder(phi - last_phi_, 2 * kPi);
  last_phi_ = phi;
  if (turn == 0 || std::abs(turn) > 0.1) return;  // the first sample after an interruption
  // Away from the material is inwards in a bore.
  lap_.add_circle(phi, turn > 0, piece_->params().bore ? -row.error.e_n : row.error.e_n);
}

void Evaluation::alarm(const Alarm& alarm) {
  if (alarms_.size() < kMostAlarms) alarms_.push_back(alarm);
}

double Evaluation::median_interference() const {
  std::uint64_t total = 0, seen = 0;
  for (const auto n : interference_) total += n;
  for (std::size_t i = 0; i < interference_.size(); ++i) {
    seen += interference_[i];
    if (2 * seen >= total) return static_cast<double>(i) * kInterferenceStep;
  }
  return 0;
}

Summary Evaluation::finish(const RunEnd& end) const {
  PathStatistics all = figures();
  if (whole_laps_ == 0) all.merge(lap_);
  Summary s;
  s.run_id = begin_.run_id;
  s.program_name = begin_.program_name;
  s.machine_name = machine_.name;
  if (piece_) s.piece_name = piece_->params().name;
  s.seed = begin_.seed;
  s.end = end;
  s.rows = rows_;
  s.missing_rows = missing_;
  s.alarms = alarms_;
  s.following = following_;
  s.following_on_path = all.following;
  s.share = all.share;
  s.lag = all.lag;
  s.cross = all.cross;
  s.whole_laps = whole_laps_;
  s.tolerance = machine_.setup.tolerance;
  s.predeflection = machine_.setup.predeflection;
  const auto add_group = [&](ErrorGroup group, std::string_view name) {
    group.name = name;
    s.groups.push_back(std::move(group));
  };
  add_group(all.whole, "whole path");
  for (std::size_t i = 0; i < all.faces.size(); ++i)
    if (all.faces[i].e_n.count > 0 && all.faces[i].e_n.count < all.whole.e_n.count)
      add_group(all.faces[i], kFaceNames[i]);
  all.crossings.resize(crossing_names_.size());
  for (std::size_t i = 0; i < crossing_names_.size(); ++i)
    add_group(all.crossings[i], crossing_names_[i]);
  for (std::size_t d = 0; d < all.circle.size(); ++d) {
    std::vector<CircularPoint> points;
    for (std::size_t i = 0; i < all.circle[d].size(); ++i)
      if (const AngleBin& b = all.circle[d][i]; b.count > 0)
        points.push_back({(static_cast<double>(i) + 0.5) / PathStatistics::kAngleBins * 2 * kPi,
                          b.sum / b.count});
    const int direction = d == 0 ? 1 : -1;
    if (const auto result = evaluate_circle(points, direction))
      s.circles.push_back({direction, *result});
  }
  if (on_path_rows_ > 0) s.interference = median_interference();
  if (const ScanLine* line = this->line()) {
    s.line_length = line->length();
    s.line_z = line->z();
    s.line_closed = line->closed();
    for (std::size_t i = 0; i < crossing_names_.size(); ++i)
      s.crossings.push_back({line->crossings()[i].s, crossing_names_[i]});
    for (std::size_t i = 0; i < coverage_.size(); ++i) s.bins.push_back(coverage_.bin(i));
    s.bin_length = coverage_.bin_length();
    s.coverage_percent = coverage_.percent();
  }
  s.last_station = last_station_;
  judge(s, all.failure);
  warn(s);
  return s;
}

void Evaluation::judge(Summary& s, const std::optional<ToleranceFailure>& failure) const {
  const Statistics& e_n = s.groups.front().e_n;
  const double worst_um = e_n.max_abs() * 1e6, tolerance_um = s.tolerance * 1e6;
  const bool complete = !s.bins.empty() && s.count(Coverage::Bin::ok) == std::ssize(s.bins);
  if (failure) {
    s.verdict = Verdict::fail;
    s.verdict_reason = fmt::format(
        "e_n = {:+.1f} um at s = {:.1f} mm, at its worst, exceeds the tolerance of {:.1f} um on at "
        "least {} samples and {:.1f} mm of the path",
        failure->e_n * 1e6, failure->s * 1e3, tolerance_um, kFailSamples, kFailArc * 1e3);
  } else if (!piece_) {
    s.verdict_reason = "the run has no workpiece";
  } else if (e_n.count == 0) {
    s.verdict_reason = "the probe never scanned the piece";
  } else if (!complete) {
    s.verdict_reason = fmt::format("only {:.1f} % of the path is measured", s.coverage_percent);
  } else if (e_n.max_abs() > s.tolerance) {
    s.verdict_reason =
        fmt::format("single samples of up to {:.1f} um exceed the tolerance of {:.1f} um", worst_um,
                    tolerance_um);
  } else {
    s.verdict = Verdict::pass;
    s.verdict_reason =
        fmt::format("the whole path is measured and |e_n| <= {:.1f} um stays within {:.1f} um",
                    worst_um, tolerance_um);
  }
}

void Evaluation::warn(Summary& s) const {
  if (s.interference && std::abs(*s.interference - s.predeflection) > kInterferenceMismatch)
    s.warnings.push_back(fmt::format(
        "the program drives the ball {:.3f} mm into the piece, but setup.predeflection_mm "
        "is {:.3f}: e_n and e_plan contain the difference",
        *s.interference * 1e3, s.predeflection * 1e3));
  if (missing_ > 0) s.warnings.push_back(fmt::format("{} rows are missing", missing_));
  if (damaged_ > 0) s.warnings.push_back(fmt::format("{} rows are damaged and left out", damaged_));
  if (disordered_ > 0)
    s.warnings.push_back(fmt::format("{} rows arrived twice or out of order", disordered_));
  if (s.end.gaps > 0)
    s.warnings.push_back(
        fmt::format("{} frames or rows were lost before the analysis", s.end.gaps));
  if (!s.end.complete)
    s.warnings.push_back(fmt::format("the run did not come to its end: {}", s.end.reason));
  if (off_line_rows_ > 0)
    s.warnings.push_back(
        fmt::format("{} samples lie off the scan line of the piece at the height first scanned; "
                    "they count in the "
                    "statistics, not in the coverage",
                    off_line_rows_));
  if (piece_ && on_path_rows_ == 0)
    s.warnings.push_back(
        "the program never scans the piece with a constant interference: no dynamic error");
}

}  // namespace vcnc
