// The closed path that a scan of a piece follows, as arc-length stations with what stands where:
// faces, end caps, and the open/closed crossings where the ruling changes its lean.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "model/geometry/piece.hpp"

namespace vcnc {

/// Part of a ruled piece a station lies on; other pieces have one face.
enum class Face { plus, end_cap, minus, start_cap, whole };
inline constexpr std::array<std::string_view, 5> kFaceNames{"side +", "cap at u max", "side -",
                                                            "cap at u min", "surface"};

class ScanLine {
 public:
  /// The line at height z on which the ball centre keeps `interference` less than its radius
  /// from the surface. Throws std::invalid_argument where the piece has none.
  ScanLine(const Piece& piece, double ball_radius, double interference, double z);

  struct Projection {
    double s = 0;         ///< station, 0 <= s < length on a closed line [m]
    double distance = 0;  ///< of the point from the line [m]
    std::size_t segment = 0;
  };
  /// Nearest point of the line, looked for everywhere.
  Projection project(const Vec3& p) const;
  /// Nearest point of the line, walking from the previous one.
  Projection project(const Vec3& p, const Projection& previous) const;

  double length() const { return stations_.back().s; }
  bool closed() const { return closed_; }
  double z() const { return z_; }
  Face face(std::size_t segment) const { return faces_[segment]; }
  const std::vector<Station>& stations() const { return stations_; }

  struct Crossing {
    double s = 0;
    Face face = Face::whole;
  };
  const std::vector<Crossing>& crossings() const { return crossings_; }

 private:
  Projection on_segment(const Vec3& p, std::size_t segment) const;

  std::vector<Station> stations_;
  std::vector<Face> faces_;  ///< per segment
  std::vector<Crossing> crossings_;
  bool closed_ = false;
  double z_ = 0;
};

}  // namespace vcnc
