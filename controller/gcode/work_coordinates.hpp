// From the words of a program to coordinates of a frame: work offsets, G92, rotation, tool offset.
//
//   without RTCP   axis   = Rz(rho) (c + Rz(theta) (w - c) + g92) + g5x + tool
//   with RTCP      point  = w + g92          in the workpiece at g5x
// w = F word: the program's own frame, see ProgramFrame. rho: rotation of the work offset (G10 L2
// R), theta about c: G68. Rotary axes: word + g92 + g5x + tool. Source of the order: LinuxCNC,
// emc/task/emccanon.cc, rotate_and_offset_pos.
#pragma once

#include <array>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

/// Maps the words of a program before everything else: x = linear word + shift.
/// Scaling, mirroring and rotation by its own words (G51, G51.1; TRANS, ROT, SCALE, MIRROR).
struct ProgramFrame {
  Mat3 linear = Mat3::Identity();
  Coordinates shift = Coordinates::Zero();  ///< [m, rad]

  bool shifts_only() const { return linear == Mat3::Identity(); }
  bool none() const { return shifts_only() && shift.isZero(0); }
  /// `inner` acts on the words first.
  ProgramFrame then(const ProgramFrame& inner) const {
    ProgramFrame both{linear * inner.linear, shift + inner.shift};
    both.shift.head<3>() = linear * inner.shift.head<3>() + shift.head<3>();
    return both;
  }
};

struct WorkOffset {
  Coordinates shift = Coordinates::Zero();  ///< [m, rad]
  double rotation = 0;                      ///< about Z [rad]
};

class WorkCoordinates {
 public:
  static constexpr std::size_t kSystems = 9;  ///< G54 .. G59, G59.1 .. G59.3
  static constexpr std::size_t kMore = 48;    ///< G54.1 P1 .. P48 behind them

  std::array<WorkOffset, kSystems + kMore> systems;
  std::size_t active = 0;
  Coordinates g92 = Coordinates::Zero();
  Coordinates g92_kept = Coordinates::Zero();  ///< of G92.2, for G92.3
  Coordinates tool = Coordinates::Zero();      ///< offset of the active tool [m, rad]
  bool rtcp = false;                           ///< g5x and tool belong to the frame
  double g68_angle = 0;
  Eigen::Vector2d g68_centre = Eigen::Vector2d::Zero();
  const ProgramFrame& program() const { return program_; }
  void program(const ProgramFrame& frame) {
    program_ = frame;
    shifted_ = !frame.none();
    turned_ = !frame.shifts_only();
  }

  /// Takes over the active system; its numbers may change without acting (parameters).
  void select(std::size_t system) {
    active = system;
    g5x_ = systems[system];
  }
  const WorkOffset& g5x() const { return g5x_; }

  bool rotated() const { return g68_angle != 0 || (!rtcp && g5x_.rotation != 0) || turned_; }
  /// How directions of the words lie in the frame.
  Mat3 linear() const;
  Coordinates to_frame(const Coordinates& word) const;
  Coordinates to_words(const Coordinates& x) const;
  /// One coordinate, where nothing is rotated.
  double to_frame(double word, Eigen::Index i) const {
    const double x = word + program_.shift[i] + g92[i];
    if (i >= 3) return x + g5x_.shift[i] + tool[i];
    return rtcp ? x : x + g5x_.shift[i] + tool[i];
  }

 private:
  WorkOffset g5x_;
  ProgramFrame program_;
  bool shifted_ = false, turned_ = false;  ///< by it
};

}  // namespace vcnc
