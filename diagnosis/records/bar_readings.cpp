#include "diagnosis/records/bar_readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnosis/records/bar_course.hpp"

namespace vcnc {
namespace {

constexpr double kMostOfArc = 0.9;  // of its readings must be there
constexpr double kBreak = 0.1;      // [s] without readings
constexpr double kOfArc = 1e-3;     // by which readings and an arc may end elsewhere
constexpr double kBarRange = 5e-3;  // [m]; of bars there are, 1 to 2 mm

class BarImport {
 public:
  BarImport(const MapColumns& columns, const MeasuredColumn& column, const TimeBase& base,
            Record& record)
      : columns_(columns), map_(columns.map()), column_(column), base_(base), record_(record) {}

  void add() {
    const ImportMap::Bar& bar = map_.bar;
    std::vector<BarArc> arcs;
    for (const ImportMap::Arc& a : map_.arcs) arcs.push_back({a.from, a.start, a.sweep});
    std::vector<double> time;
    for (const std::size_t index : base_.index)
      time.push_back(base_.begin + static_cast<double>(index) * base_.period);
    check_bar_length(columns_, signal_, column_);
    check_arcs(time);
    const BarCourse course = bar_course(arcs, bar.feed / bar.radius, time, base_.period);
    if (course.later > base_.period)
      record_.warnings.push_back(
          fmt::format("an arc comes {:.3g} s later than the table says: an axis must stop, "
                      "turn round and be at its feed between two arcs",
                      course.later));
    record_.begin = course.begin;
    MeasuredSignal length{SignalKind::bar, 0, column_.name,
                          std::vector<double>(course.angle.size(), kMissing)};
    for (std::size_t i = 0; i < base_.index.size(); ++i)
      if (course.sample[i] != BarCourse::kNone)
        length.value[course.sample[i]] = to_si(signal_, column_.value[i]);
    using Plane = ImportMap::Bar::Plane;
    const std::size_t one = bar.plane == Plane::ZX   ? kZ
                            : bar.plane == Plane::YZ ? kY
                                                     : kX,
                      other = bar.plane == Plane::ZX   ? kX
                              : bar.plane == Plane::YZ ? kZ
                                                       : kY;
    for (const std::size_t axis : {kX, kY, kZ}) {
      MeasuredSignal command{SignalKind::command, axis, "arcs", {}};
      for (const double angle : course.angle)
        command.value.push_back(bar.centre[static_cast<Eigen::Index>(axis)] +
                                (axis == one     ? bar.radius * std::cos(angle)
                                 : axis == other ? bar.radius * std::sin(angle)
                                                 : 0));
      record_.signals.push_back(std::move(command));
    }
    record_.signals.push_back(std::move(length));
  }

 private:
  /// Readings of an arc and around it, up to the next break.
  struct Block {
    double first = 0, last = 0;      ///< reading of the arc [s]
    double begin = 0, end = 0;       ///< with those before and after it
    double there = 0, expected = 0;  ///< readings within the arc
  };

  /// `time`: of every reading; `from` to `to`: the arc.
  Block block_of(const std::vector<double>& time, double from, double to) const {
    const double edge = 0.5 * base_.period, broken = kBreak + 2 * base_.period;
    auto begin = std::lower_bound(time.begin(), time.end(), from - edge),
         end = std::upper_bound(time.begin(), time.end(), to + edge);
    Block b{.there = static_cast<double>(end - begin), .expected = (to - from) / base_.period + 1};
    if (begin == end) return b;
    b.first = *begin;
    b.last = *(end - 1);
    while (begin != time.begin() && *begin - *(begin - 1) < broken) --begin;
    while (end != time.end() && *end - *(end - 1) < broken) ++end;
    b.begin = *begin;
    b.end = *(end - 1);
    return b;
  }

  /// An arc is where its readings are: that one begins or ends elsewhere is a mistake in its time,
  /// sweep, radius or feed, and shifts the angle of every reading.
  void check_arcs(const std::vector<double>& time_of_row) {
    std::vector<double> time;
    for (std::size_t i = 0; i < base_.index.size(); ++i)
      if (std::isfinite(column_.value[i])) time.push_back(time_of_row[i]);
    for (const ImportMap::Arc& arc : map_.arcs) {
      const double to = arc.from + std::abs(arc.sweep) * map_.bar.radius / map_.bar.feed;
      const double near = std::max(3 * base_.period, kOfArc * (to - arc.from));
      const Block b = block_of(time, arc.from, to);
      const auto no = [&](const std::string& reason) {
        columns_.refuse(arc.lines, "arcs.", "from_s", reason);
      };
      if (b.there < kMostOfArc * b.expected)
        no(
            fmt::format("from {:.3f} to {:.3f} s there are {:.0f} of {:.0f} readings; check times, "
                        "angles, radius and feed",
                        arc.from, to, b.there, b.expected));
      if (b.first > arc.from + near)
        no(
            fmt::format("the first reading of this arc is at {:.3f} s, later than {:.3f} s; give "
                        "the time and the angle of that",
                        b.first, arc.from));
      if (b.last < to - near)
        no(fmt::format(
            "the last reading of this arc is at {:.3f} s, but by sweep, radius and feed "
            "it ends at {:.3f} s",
            b.last, to));
      const bool begins = b.begin > arc.from - near, ends = b.end < to + near;
      if (begins && !ends)
        no(fmt::format(
            "this arc begins with its readings and ends by sweep, radius and feed at "
            "{:.3f} s, but they go on without a break to {:.3f} s; if these are of it a "
            "feed of {:.6g} mm/min fits, else leave them out of the table",
            to, b.end, map_.bar.feed * 6e4 * (to - arc.from) / (b.end - arc.from)));
      if (ends && !begins)
        no(
            fmt::format("this arc ends with its readings and begins at {:.3f} s, but they come "
                        "without a break from {:.3f} s on; check from_s and feed, or leave out of "
                        "the table what is not of it",
                        arc.from, b.begin));
      if (b.there < b.expected - 1.5)
        record_.warnings.push_back(
            fmt::format("from {:.3f} to {:.3f} s {:.0f} of {:.0f} readings are missing and stay "
                        "missing",
                        arc.from, to, b.expected - b.there, b.expected));
    }
  }

  const MapColumns& columns_;
  const ImportMap& map_;
  const ImportMap::Signal& signal_ = map_.signals.front();
  const MeasuredColumn& column_;
  const TimeBase& base_;
  Record& record_;
};

}  // namespace

void check_bar_length(const MapColumns& columns, const ImportMap::Signal& signal,
                      const MeasuredColumn& column) {
  double sum = 0, most = 0;
  std::size_t there = 0, at = 0;
  for (std::size_t i = 0; i < column.value.size(); ++i) {
    const double v = to_si(signal, column.value[i]);
    if (!std::isfinite(v)) continue;
    sum += v, ++there;
    if (std::abs(v) > most) most = std::abs(v), at = i;
  }
  if (there == 0)
    throw MeasurementError(
        fmt::format("{}: \"{}\" has no value at all", columns.table().source, column.name));
  if (most <= kBarRange) return;
  const bool whole =
      std::abs(sum / static_cast<double>(there) - columns.map().bar.radius) < kBarRange;
  throw MeasurementError(
      fmt::format("{}: \"{}\" (bar) is {:.4g} mm, and no ball bar moves by more than {:.0f} mm; {}",
                  columns.table().place(at), column.name, 1e3 * most, 1e3 * kBarRange,
                  whole ? "this is its whole length: take its radius off by offset"
                        : "check its unit and scale"));
}

void add_bar_on_arcs(const MapColumns& columns, const MeasuredColumn& column, const TimeBase& base,
                     Record& record) {
  BarImport(columns, column, base, record).add();
}

}  // namespace vcnc
