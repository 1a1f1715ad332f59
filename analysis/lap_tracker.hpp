// Decides, live, which samples belong to the scan of the piece and where on the path they lie.
//
// Searching: the ball is commanded into the piece (D < r_b) and D stays within kEntryBand over
// kEntryTravel of commanded travel: the program has left its approach behind. The distance kept
// there tells the interference the program really has, the height tells the scan line.
// Tracking: a sample is on the path when D is within kExitBand of that distance and the station
// advances by most of the travel; so an approach, a retreat along the normal and a stand-still do
// not count. Tracking ends when D leaves the band or drifts by more than kExitSlope (a ramp). Where
// the lap overlaps itself the first pass is the measure: as soon as D differs from it by more than
// kPassBand the program is on its way out, so that a tangential exit does not count as error.
//
// A program that keeps its distance but not on the piece's scan line at one height (a circle on a
// sphere, say) is tracked too, with the commanded travel as station; it has no coverage.
#pragma once

#include <optional>
#include <vector>

#include "analysis/dynamic_error.hpp"
#include "analysis/scan_line.hpp"

namespace vcnc {

class LapTracker {
 public:
  LapTracker(const Piece& piece, double ball_radius) : piece_(piece), ball_radius_(ball_radius) {}

  struct Place {
    bool on_path = false;
    bool on_line = false;  ///< s is a station of line(), else the travel so far
    double s = 0;          ///< station [m]: on a closed line within its length
    double from = 0;       ///< station before this sample; from == s when tracking just began
    int direction = 0;     ///< +1: with the line, -1: against it
    Face face = Face::whole;
  };
  Place track(const ErrorSample& sample);

  /// The scan line; null until the first entry or when the program follows none.
  const ScanLine* line() const { return line_ ? &*line_ : nullptr; }
  bool entered() const { return entered_; }
  double interference() const { return ball_radius_ - distance_ref_; }  ///< of the program [m]

 private:
  bool settle(const ErrorSample& sample);
  void enter(const ErrorSample& sample);
  bool left(const ErrorSample& sample);
  bool differs_from_first_pass(std::size_t segment, double distance);

  const Piece& piece_;
  double ball_radius_;
  bool entered_ = false, tracking_ = false, on_line_ = false;
  double travelled_ = 0;                                         ///< since tracking began first [m]
  double window_min_ = 0, window_max_ = 0, window_travel_ = -1;  ///< search; -1: no window
  double distance_ref_ = 0;
  double slope_from_ = 0, slope_travel_ = 0;
  Tick last_tick_ = 0;
  /// What the first pass over a segment of the line kept as distance.
  struct Kept {
    double min = 0, max = 0;
    double at = -1;  ///< commanded travel when last seen; -1: never
  };
  std::vector<Kept> kept_;
  double total_travel_ = 0;
  std::optional<ScanLine> line_;
  ScanLine::Projection projection_;
};

/// Signed way from station a to station b of a line, the short way round when it is closed.
double station_step(const ScanLine& line, double a, double b);

}  // namespace vcnc
