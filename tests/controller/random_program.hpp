// Random but reproducible programs for the property tests of the player.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <string>

#include "model/math.hpp"

namespace vcnc {

/// Lines, arcs, point lists, pure turns and dwells with changing feeds, offsets and path modes.
class RandomProgram {
 public:
  explicit RandomProgram(unsigned seed) : random_(seed) {}

  std::string text() {
    rtcp_ = chance(0.5);
    std::string program = chance(0.25) ? "G61\n" : fmt::format("G64 P{:.4f}\n", tolerance());
    program += rtcp_ ? "G43.4 H1\n" : "G43 H1\n";
    go(random_point());
    program += "G0 " + words() + "\n";
    const int blocks = 4 + static_cast<int>(uniform(0, 8));
    for (int i = 0; i < blocks; ++i) program += block();
    return program + "M30\n";
  }

  bool rtcp() const { return rtcp_; }

 private:
  struct Point {
    double x = 0, y = 0, z = 100, a = 0, c = 0;
  };

  // The engine's sequence is the same everywhere; the library's distributions are not.
  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  bool chance(double probability) { return uniform(0, 1) < probability; }
  double tolerance() { return std::pow(10, uniform(-3, -1)); }  // 1 to 100 um

  Point random_point() {
    return {uniform(-90, 90), uniform(-90, 90), uniform(20, 180), uniform(-35, 35),
            uniform(-200, 200)};
  }
  void go(const Point& p) { p_ = p; }
  std::string words() const {
    return fmt::format("X{:.5f} Y{:.5f} Z{:.5f} A{:.5f} C{:.5f}", p_.x, p_.y, p_.z, p_.a, p_.c);
  }
  std::string feed() { return fmt::format(" F{:.1f}", std::pow(10, uniform(2.3, 4.3))); }

  std::string block() {
    switch (static_cast<int>(uniform(0, 10))) {
      case 0:
        go(random_point());
        return "G0 " + words() + "\n";
      case 1:
        return fmt::format("G4 P{:.4f}\n", uniform(0, 0.05));
      case 2:
        return turn();
      case 3:
        return inverse_time();
      case 4:
      case 5:
        return arc();
      case 6:
      case 7:
        return point_list();
      case 8:
        return corner_list();
      default:
        go(random_point());
        return "G1 " + words() + feed() + "\n";
    }
  }

  std::string turn() {
    p_.a = uniform(-35, 35);
    p_.c = uniform(-200, 200);
    return fmt::format("G1 A{:.5f} C{:.5f} F{:.1f}\n", p_.a, p_.c, uniform(200, 8000));
  }

  std::string inverse_time() {
    go(random_point());
    return fmt::format("G93 G1 {} F{:.3f}\nG94\n", words(), uniform(5, 60));
  }

  std::string arc() {
    const double radius = std::pow(10, uniform(-0.5, 1.7)), phase = uniform(-kPi, kPi);
    const double sweep = uniform(0.05, 2 * kPi), turn = chance(0.5) ? 1 : -1;
    const double ci = radius * std::cos(phase), cj = radius * std::sin(phase);
    const double cx = p_.x + ci, cy = p_.y + cj;
    p_.x = cx + radius * std::cos(phase + kPi + turn * sweep);
    p_.y = cy + radius * std::sin(phase + kPi + turn * sweep);
    p_.z += chance(0.3) ? uniform(-3, 3) : 0;
    std::string text = fmt::format("{} X{:.5f} Y{:.5f} Z{:.5f} I{:.5f} J{:.5f}",
                                   turn > 0 ? "G3" : "G2", p_.x, p_.y, p_.z, ci, cj);
    if (rtcp_ && chance(0.3)) {
      p_.a = uniform(-35, 35);
      text += fmt::format(" A{:.5f}", p_.a);
    }
    return text + feed() + "\n";
  }

  std::string point_list() {
    // Points along a smooth curve, 0.05 to 1 mm apart.
    const double step = std::pow(10, uniform(-1.3, 0)), radius = uniform(4, 60);
    const double lean = uniform(-0.3, 0.3), twist = uniform(-3, 3);
    const Point begin = p_;
    const double heading = uniform(-kPi, kPi);
    std::string text = "G1" + feed() + "\n";
    for (int i = 1; i <= 60; ++i) {
      const double angle = i * step / radius;
      const double along = radius * std::sin(angle), across = radius * (1 - std::cos(angle));
      p_.x = begin.x + along * std::cos(heading) - across * std::sin(heading);
      p_.y = begin.y + along * std::sin(heading) + across * std::cos(heading);
      p_.a = begin.a + 5 * lean * std::sin(angle * 3);
      p_.c = begin.c + twist * 10 * std::sin(angle);
      text += words() + "\n";
    }
    return text;
  }

  std::string corner_list() {
    std::string text = "G1" + feed() + "\n";
    const double size = std::pow(10, uniform(-2, 1));
    for (int i = 0; i < 8; ++i) {
      p_.x += uniform(-size, size);
      p_.y += uniform(-size, size);
      p_.z += uniform(-size, size) * 0.3;
      p_.c += uniform(-size, size);
      text += words() + "\n";
    }
    return text;
  }

  std::mt19937_64 random_;
  Point p_;
  bool rtcp_ = false;
};

}  // namespace vcnc
