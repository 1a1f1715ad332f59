#include "diagnosis/records/bar_course.hpp"

#include <algorithm>
#include <cmath>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr double kBefore = 0.5, kRamp = 0.5, kSettled = 0.5, kRunOut = 0.1;  // [s]
constexpr double kShortestMove = 0.5;                                        // [s]

/// Share of a move after the share u of its time, from rest to rest.
double eased(double u) { return u * u * u * (10 + u * (-15 + 6 * u)); }

/// Share of `kRamp` at full speed that a rise has covered after the share u of it.
double risen(double u) { return u * u * u * (1 - 0.5 * u); }

/// An arc with how the axes come into it and go on: angles along its way from where it begins.
class ArcMotion {
 public:
  ArcMotion(const BarArc& arc, double speed) : arc_(arc), speed_(speed) {}

  double sign() const { return arc_.sweep < 0 ? -1 : 1; }
  double duration() const { return std::abs(arc_.sweep) / speed_; }
  static double lead() { return kRamp + kSettled; }
  static double tail() { return kRunOut + kRamp; }
  /// `t` from the beginning of the arc, from -lead() to duration() + tail().
  double angle(double t) const { return arc_.start + sign() * speed_ * way(t); }

 private:
  /// At full speed, this long [s].
  double way(double t) const {
    const double settled = -kSettled, end = duration() + kRunOut;
    if (t < settled) return settled - 0.5 * kRamp + kRamp * risen((t + lead()) / kRamp);
    if (t <= end) return t;
    return end + 0.5 * kRamp - kRamp * risen(std::max(0.0, 1 - (t - end) / kRamp));
  }

  BarArc arc_;
  double speed_;
};

}  // namespace

BarCourse bar_course(const std::vector<BarArc>& arcs, double speed, const std::vector<double>& time,
                     double period) {
  BarCourse course;
  course.sample.assign(time.size(), BarCourse::kNone);
  const auto now = [&] { return static_cast<double>(course.angle.size()) * period; };
  double at = 0, since = 0;  // where the axes stand, and since when
  for (BarArc arc : arcs) {
    const bool first = course.angle.empty();
    double sets_off = kBefore;
    if (first) {
      at = ArcMotion(arc, speed).angle(-ArcMotion::lead());
    } else {
      const auto way = [&] { return ArcMotion(arc, speed).angle(-ArcMotion::lead()) - at; };
      arc.start -= 2 * kPi * std::round(way() / (2 * kPi));  // the same place, the shorter way
      const double from = at, far = way();
      const double move = std::max(kShortestMove, 2 * std::abs(far) / speed);
      sets_off = since + move;
      while (now() < sets_off)
        course.angle.push_back(from + far * eased(std::max(0.0, now() - since) / move));
      at += far;
    }
    const ArcMotion motion(arc, speed);
    const auto row = static_cast<std::size_t>(
        std::lower_bound(time.begin(), time.end(), arc.from - 1e-9) - time.begin());
    // The rows of the table fall on samples, the first of them so long after the arc begins.
    const double offset = row < time.size() ? time[row] - arc.from : 0;
    const double soonest =
        std::max(sets_off + ArcMotion::lead(), first ? 0 : arc.from - course.begin);
    const auto sample = static_cast<std::size_t>(std::ceil((soonest + offset) / period - 1e-6));
    const double begins = static_cast<double>(sample) * period - offset;
    if (first) course.begin = arc.from - begins;
    course.later = std::max(course.later, begins - (arc.from - course.begin));
    const double ends = begins + motion.duration();
    while (now() < ends + ArcMotion::tail())
      course.angle.push_back(now() < begins - ArcMotion::lead() ? at
                                                                : motion.angle(now() - begins));
    since = now();
    at = motion.angle(motion.duration() + ArcMotion::tail());
    for (std::size_t i = row; i < time.size() && time[i] <= arc.from + motion.duration() + 1e-9;
         ++i)
      course.sample[i] =
          sample + static_cast<std::size_t>(std::lround((time[i] - time[row]) / period));
  }
  return course;
}

}  // namespace vcnc
