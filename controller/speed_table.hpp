// Speed law s(t) as a table: position, speed and acceleration at equal steps in time, quintic
// between them, so that s is C2 and its values cost the same everywhere.
#pragma once

#include <cstddef>
#include <vector>

namespace vcnc {

struct LawPoint {
  double s = 0, ds = 0, dds = 0;  ///< [m], [m/s], [m/s2]
};

class SpeedTable {
 public:
  /// `points` at k duration / (points.size() - 1).
  SpeedTable(std::vector<LawPoint> points, double duration);

  double duration() const { return duration_; }
  LawPoint at(double t) const;  ///< t is clamped to [0, duration]

 private:
  std::vector<LawPoint> points_;
  double duration_;
};

}  // namespace vcnc
