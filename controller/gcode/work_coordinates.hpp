// From the words of a program to coordinates of a frame: work offsets, G92, rotation, tool offset.
//
//   without RTCP   axis   = Rz(rho) (c + Rz(theta) (word - c) + g92) + g5x + tool
//   with RTCP      point  = word + g92          in the workpiece at g5x
// rho: rotation of the work offset (G10 L2 R), theta about c: G68. Rotary axes: word + g92 + g5x +
// tool.
// Source of the order: LinuxCNC, emc/task/emccanon.cc, rotate_and_offset_pos.
#pragma once

#include <array>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

struct WorkOffset {
  Coordinates shift = Coordinates::Zero();  ///< [m, rad]
  double rotation = 0;                      ///< about Z [rad]
};

class WorkCoordinates {
 public:
  static constexpr std::size_t kSystems = 9;  ///< G54 .. G59, G59.1 .. G59.3

  std::array<WorkOffset, kSystems> systems;
  std::size_t active = 0;
  Coordinates g92 = Coordinates::Zero();
  Coordinates g92_kept = Coordinates::Zero();  ///< of G92.2, for G92.3
  Coordinates tool = Coordinates::Zero();      ///< offset of the active tool [m, rad]
  bool rtcp = false;                           ///< g5x and tool belong to the frame
  double g68_angle = 0;
  Eigen::Vector2d g68_centre = Eigen::Vector2d::Zero();

  /// Takes over the active system; its numbers may change without acting (parameters).
  void select(std::size_t system) {
    active = system;
    g5x_ = systems[system];
  }
  const WorkOffset& g5x() const { return g5x_; }

  bool rotated() const { return g68_angle != 0 || (!rtcp && g5x_.rotation != 0); }
  Coordinates to_frame(const Coordinates& word) const;
  Coordinates to_words(const Coordinates& x) const;
  /// One coordinate, where nothing is rotated.
  double to_frame(double word, Eigen::Index i) const {
    const double x = word + g92[i];
    if (i >= 3) return x + g5x_.shift[i] + tool[i];
    return rtcp ? x : x + g5x_.shift[i] + tool[i];
  }

 private:
  WorkOffset g5x_;
};

}  // namespace vcnc
