// The programs on which the planner is measured, as G-code. Each is one run of cutting moves, after
// a rapid to its start where that is not the start of the machine.
#pragma once

#include <string>
#include <vector>

#include "model/machine.hpp"

namespace vcnc {

struct PlanProgram {
  std::string name, text;
  double tolerance = 0;  ///< G64 P [m]
  bool corners = false;  ///< lines that meet at corners, all of them
};

/// X, Y, Z: 500 mm/s, 5000 mm/s2, 50,000 mm/s3.
Machine three_axis_machine();
/// Lines and arcs with corners, points on curves and surfaces; G64 P0.01.
std::vector<PlanProgram> three_axis_programs();

/// A trunnion; A, C: 60 deg/s, 600 deg/s2, 6000 deg/s3; X, Y, Z as above.
Machine five_axis_machine();
/// Tip at rest, circle with C following, cones, poles, the S-shaped test piece.
std::vector<PlanProgram> five_axis_programs();

}  // namespace vcnc
