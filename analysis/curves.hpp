// The curves a report shows, thinned so that no extreme is lost: per bucket of the abscissa the
// least and the largest value.
#pragma once

#include <array>
#include <vector>

#include "analysis/evaluation.hpp"
#include "analysis/recording.hpp"

namespace vcnc {

class Envelope {
 public:
  Envelope() = default;
  Envelope(double from, double to, std::size_t buckets);

  void add(double x, double y);
  struct Point {
    double x = 0, y = 0;
    bool starts = false;  ///< the curve has a gap before this point
  };
  std::vector<Point> points() const;  ///< at most two per bucket, in order of x

 private:
  struct Bucket {
    std::size_t count = 0;
    double x_min = 0, y_min = 0, x_max = 0, y_max = 0;
  };
  double from_ = 0, width_ = 1;
  std::vector<Bucket> buckets_;
};

/// A station of the scan line with the mean error measured there.
struct CurvePoint {
  Vec3 centre, n;
  double e_n = 0;
  bool measured = false;
};

struct FacePart {
  double from = 0, to = 0;  ///< stations [m]
  Face face = Face::whole;
};

struct Curves {
  Envelope e_n, e_plan, e_servo, e_rest;  ///< over the station [m]
  PerAxis<Envelope> following;            ///< over time [s]
  Envelope bus_load, feed;                ///< over time [s]
  double path_feed = 0;                   ///< largest commanded feed on the path [m/s]
  std::vector<CurvePoint> path;           ///< the scan line; empty: none was followed
  std::vector<Vec3> theoretical;          ///< commanded path, thinned, where there is no line
  std::vector<FacePart> faces;
  /// Raw signals of x, y, z as (cos, sin), 1 = nominal amplitude.
  std::array<std::vector<std::array<double, 2>>, 3> lissajous;
};

/// Runs the evaluation over the recording once more. Memory does not grow with the run.
Curves collect_curves(const RecordingReader& recording, const Summary& summary);

}  // namespace vcnc
