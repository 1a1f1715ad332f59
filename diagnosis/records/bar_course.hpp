// How an axis pair moved while a ball bar was read on arcs, where nobody recorded the commands.
//
// Arcs are run at constant feed, so their angle is known at every moment; the axes came into them
// and went on from them along the same circle, so that the drives are settled in each. How exactly,
// nobody says; taken is, for the angular speed w = feed / radius,
//
//   0.5 s standing, then the speed rises as w (3 u^2 - 2 u^3) over 0.5 s and stays for 0.5 s,
//   the arc, 0.1 s more of it, the speed falls in the same way over 0.5 s
//
// and from there to where the next one begins a polynomial of the fifth degree at w / 2 on the
// mean. Where the table leaves less time between two arcs than that takes, the later ones come so
// much later.
#pragma once

#include <cstddef>
#include <vector>

namespace vcnc {

struct BarArc {
  double from = 0;   ///< [s] in the time of the table
  double start = 0;  ///< [rad]
  double sweep = 0;  ///< [rad]; negative: clockwise
};

struct BarCourse {
  std::vector<double> angle;        ///< of every sample [rad]
  std::vector<std::size_t> sample;  ///< of each row of the table; none: it lies in no arc
  double begin = 0;                 ///< of the first sample, in the time of the first arc [s]
  double later = 0;                 ///< that an arc comes than the table says, at most [s]

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
};

/// `time` of each row [s], `period` between samples [s], `speed` of the arcs [rad/s]. The arcs are
/// in order of time and do not overlap.
BarCourse bar_course(const std::vector<BarArc>& arcs, double speed, const std::vector<double>& time,
                     double period);

}  // namespace vcnc
