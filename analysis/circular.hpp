// Circular test numbers after ISO 230-4 from radial deviations dR(phi) of one sense of rotation.
//
//   dR(phi) ~ a + b cos phi + c sin phi     least squares: a mean radius deviation, (b, c) centre
//   G = max - min of dR - (b cos + c sin)   circular deviation about the least-squares centre
//   F = max and min of the same             radial deviation from the nominal circle
//   second harmonic, least squares together with the terms above: p cos 2phi + q sin 2phi;
//   q = R S / 2 for a squareness error S (same in both senses), q = v (1/Kx - 1/Ky) / 2 up to sign
//   for unequal loop gains (changes sign with the sense), p a scale mismatch
//   step at a reversal phi_q = 0, 90, 180, 270 deg: straight lines through the points from 1 to 8
//   deg before and after it, their difference at phi_q (after minus before in the sense of travel);
//   backlash and lost motion appear here
// Source: ISO 230-4:2005, clause 3 (definitions); the harmonics follow from the error's geometry.
#pragma once

#include <array>
#include <optional>
#include <span>

namespace vcnc {

struct CircularPoint {
  double phi = 0;  ///< [rad], any turn
  double dR = 0;   ///< actual minus nominal radius [m]
};

struct CircularResult {
  double mean = 0;                            ///< a [m]
  double centre_x = 0, centre_y = 0;          ///< b, c [m]
  double G = 0, F_max = 0, F_min = 0;         ///< [m]
  double cos2 = 0, sin2 = 0;                  ///< second harmonic [m]
  std::array<std::optional<double>, 4> step;  ///< at 0, 90, 180, 270 deg [m]; empty: too few points
};

/// Empty when the points do not go around: fewer than 16, or a gap of more than 30 deg.
/// `direction` is +1 for counter-clockwise travel, -1 for clockwise.
std::optional<CircularResult> evaluate_circle(std::span<const CircularPoint> points, int direction);

}  // namespace vcnc
