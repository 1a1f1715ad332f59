#include "controller/gcode/work_coordinates.hpp"

#include <cmath>

namespace vcnc {
namespace {

void turn(Coordinates& x, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double u = x[0], v = x[1];
  x[0] = c * u - s * v;
  x[1] = s * u + c * v;
}

}  // namespace

Coordinates WorkCoordinates::to_frame(const Coordinates& word) const {
  Coordinates x = word;
  if (shifted_) {
    if (turned_) x.head<3>() = program_.linear * word.head<3>();
    x += program_.shift;
  }
  if (g68_angle != 0) {
    x.head<2>() -= g68_centre;
    turn(x, g68_angle);
    x.head<2>() += g68_centre;
  }
  x += g92;
  if (!rtcp && g5x_.rotation != 0) turn(x, g5x_.rotation);
  if (rtcp) {
    x.tail<2>() += g5x_.shift.tail<2>() + tool.tail<2>();
  } else {
    x += g5x_.shift;
    x += tool;
  }
  return x;
}

Coordinates WorkCoordinates::to_words(const Coordinates& frame) const {
  Coordinates x = frame;
  if (rtcp) {
    x.tail<2>() -= tool.tail<2>();
    x.tail<2>() -= g5x_.shift.tail<2>();
  } else {
    x -= tool;
    x -= g5x_.shift;
  }
  if (!rtcp && g5x_.rotation != 0) turn(x, -g5x_.rotation);
  x -= g92;
  if (g68_angle != 0) {
    x.head<2>() -= g68_centre;
    turn(x, -g68_angle);
    x.head<2>() += g68_centre;
  }
  if (shifted_) {
    x -= program_.shift;
    if (turned_) x.head<3>() = program_.linear.inverse() * Vec3(x.head<3>());
  }
  return x;
}

Mat3 WorkCoordinates::linear() const {
  const double angle = g68_angle + (rtcp ? 0 : g5x_.rotation);
  return Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix() * program_.linear;
}

}  // namespace vcnc
