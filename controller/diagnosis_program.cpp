#include "controller/diagnosis_program.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "model/geometry/kinematics.hpp"

namespace vcnc {
namespace {

constexpr double kMains = 50, kGolden = 0.382;  // [Hz], share of a period
constexpr double kSmall = 0.5;                  // radius of the small circles over that of the ring
constexpr double kTraverse = 5000;              // [mm/min] in the air
constexpr double kTouch = 300;                  // [mm/min] towards the ring
constexpr double kSpinFeed = 3600, kTiltFeed = 1500;  // [deg/min]
constexpr double kSpin = 60, kTilt = 15;              // [deg] to either side
constexpr double kFaster[] = {1.0, 1.6, 2.5};         // feeds of the rings over the lowest
constexpr double kHeight = 0.2;                       // of the spins, over the height of the ring
constexpr double kPause = 0.15;                       // [s]

[[noreturn]] void refuse(const std::string& reason) { throw std::invalid_argument(reason); }

double zeroed(double value) { return std::abs(value) < 5e-9 ? 0 : value; }

/// Coordinates in mm.
std::string words_of(const Vec3& p) {
  return fmt::format("X{:.5f} Y{:.5f} Z{:.5f}", zeroed(p.x() * 1e3), zeroed(p.y() * 1e3),
                     zeroed(p.z() * 1e3));
}

/// Feed near `feed` at which a lap falls between periods of the mains.
double lap_feed(double radius, double feed) {
  const double way = 2 * kPi * radius * 1e3;
  const double lap = 60 * way / feed;
  return 60 * way * kMains / (std::max(1.0, std::floor(lap * kMains)) + kGolden);
}

class Writer {
 public:
  Writer(const Machine& machine, const Piece* piece, const ProgramOptions& o) : o_(o) {
    if (!(o.feed_mm_min > 0)) refuse("feed_mm_min must be greater than 0");
    if (!(o.tolerance_um > 0)) refuse("tolerance_um must be greater than 0");
    if (o.laps < 2 || o.laps > 100) refuse("laps must be 2 to 100: one lap tells nothing of noise");
    if (piece == nullptr) {
      if (!o.radius_mm) refuse("radius_mm is needed without a ring");
      radius_ = *o.radius_mm * 1e-3;
      const Kinematics kinematics(machine.kinematics, machine.tool_length(1),
                                  machine.setup.work_offset[0]);
      AxisVector q;
      for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = machine.axes[i].limits.start;
      centre_ = kinematics.forward(q).p_WT;
      return;
    }
    const PieceParams& ring = piece->params();
    if (ring.kind != PieceParams::Kind::ring || !ring.bore ||
        ring.direction.normalized().z() < 0.999)
      refuse("piece: the program needs a ring that is probed inside, its axis along z");
    const double interference =
        o.predeflection_mm ? *o.predeflection_mm * 1e-3 : machine.setup.predeflection;
    in_ring_ = true;
    radius_ = ring.radius - machine.probe.ball_radius + interference;
    if (!(radius_ > 5e-3)) refuse("piece: the ring is too small");
    centre_ = ring.centre;
    height_ = kHeight * ring.height;
    above_ = 0.5 * ring.height + o.clearance_mm * 1e-3;
  }

  std::string text(const Machine& machine) {
    add("%");
    add("(Diagnosis: rings, ladders, lines" + std::string(in_ring_ ? ", spins)" : ")"));
    add(fmt::format("(Machine: {}. Units: mm, deg, mm/min.)", machine.name));
    add("G54 G90 G17 G21 G94 G40 G49");
    add(fmt::format("G64 P{:.5f}", o_.tolerance_um * 1e-3));
    add("M19 (spindle oriented, at rest)");
    add("G0 A0 C0");
    add("G43 H1");
    if (in_ring_) add("G0 " + words_of(centre_ + Vec3(0, 0, above_)));
    go(centre_, kTraverse);
    add("G4 P0.5");
    for (const double share : kFaster)
      for (const int turn : {1, -1}) circle(radius_, turn, share * o_.feed_mm_min, in_ring_);
    for (const int turn : {1, -1}) circle(kSmall * radius_, turn, 2.5 * o_.feed_mm_min, false);
    for (const int axis : {0, 1, 2}) ladder(axis);
    for (const int axis : {0, 1}) lines(axis, centre_, 0.8 * kSmall * radius_);
    if (in_ring_) {
      go(centre_ + Vec3(0, 0, above_), kTraverse);
      lines(2, centre_ + Vec3(0, 0, above_), 10e-3);
      spins(-height_, 2);
      spins(height_, 1);
      add("G43 H1");
      go(centre_ + Vec3(0, 0, above_), kTraverse);
      go(centre_, kTraverse);
    } else {
      lines(2, centre_, 10e-3);
    }
    circle(radius_, 1, 2.5 * o_.feed_mm_min, in_ring_);
    if (in_ring_) add("G0 " + words_of(centre_ + Vec3(0, 0, above_)));
    add("G49\nG91\nG28 Z0\nG28 X0 Y0\nG28 A0 C0\nG90\nM30");
    return text_;
  }

 private:
  void add(const std::string& line) { text_ += line + "\n"; }
  void pause() { add(fmt::format("G4 P{:g}", kPause)); }
  void go(const Vec3& p, double feed) { add(fmt::format("G1 {} F{:g}", words_of(p), feed)); }

  /// From the centre and back by half circles, an eighth of a turn to either side of the laps.
  void circle(double radius, int turn, double wanted, bool touching) {
    const double feed = lap_feed(radius, wanted);
    const auto at = [&](double angle) {
      return Vec3(centre_ + radius * Vec3(std::cos(turn * angle), std::sin(turn * angle), 0));
    };
    const auto arc = [&](const Vec3& from, const Vec3& to, const Vec3& middle, double f) {
      add(fmt::format("{} X{:.5f} Y{:.5f} I{:.5f} J{:.5f} F{:.3f}", turn > 0 ? "G3" : "G2",
                      zeroed(to.x() * 1e3), zeroed(to.y() * 1e3),
                      zeroed((middle.x() - from.x()) * 1e3), zeroed((middle.y() - from.y()) * 1e3),
                      f));
    };
    const Vec3 entry = at(-kPi / 4), zero = at(0), exit = at(kPi / 4);
    arc(centre_, entry, 0.5 * (centre_ + entry), touching ? std::min(feed, wanted) : feed);
    arc(entry, zero, centre_, feed);
    for (int lap = 0; lap < o_.laps; ++lap) arc(zero, zero, centre_, feed);
    arc(zero, exit, centre_, feed);
    arc(exit, centre_, 0.5 * (centre_ + exit), feed);
    pause();
  }

  void ladder(int axis) {
    for (const double size : {0.05e-3, 0.5e-3, 5e-3})
      for (int i = 0; i < 3; ++i) {
        go(centre_ + size * Vec3::Unit(axis), 1000);
        go(centre_, 1000);
      }
    pause();
  }

  void lines(int axis, const Vec3& middle, double reach) {
    for (const double feed : {o_.feed_mm_min, 2.5 * o_.feed_mm_min}) {
      go(middle - reach * Vec3::Unit(axis), feed);
      pause();
      for (int i = 0; i < 2; ++i) {
        go(middle + reach * Vec3::Unit(axis), feed);
        pause();
        go(middle - reach * Vec3::Unit(axis), feed);
        pause();
      }
    }
    go(middle, kTraverse);
    pause();
  }

  void spins(double height, int times) {
    const Vec3 inside = centre_ + Vec3(0, 0, height), on = inside + Vec3(radius_, 0, 0);
    add("G43 H1");
    go(centre_ + Vec3(0, 0, above_), kTraverse);
    go(inside, kTraverse);
    go(inside + Vec3(radius_ - 3e-3, 0, 0), kTraverse);
    add("G49");
    add("G43.4 H1");
    go(on, kTouch);
    pause();
    for (int i = 0; i < times; ++i) {
      for (const double c : {kSpin, -kSpin, 0.0}) turn("C", c, kSpinFeed);
      for (const double a : {kTilt, -kTilt, 0.0}) turn("A", a, kTiltFeed);
    }
    go(inside + Vec3(radius_ - 3e-3, 0, 0), kTouch);
    add("G49");
    add("G43 H1");
    go(inside, kTraverse);
    go(centre_ + Vec3(0, 0, above_), kTraverse);
    add("G49");
  }
  void turn(const char* axis, double angle, double feed) {
    add(fmt::format("G1 {}{:.6f} F{:g}", axis, angle, feed));
    pause();
  }

  const ProgramOptions& o_;
  bool in_ring_ = false;
  double radius_ = 0, height_ = 0, above_ = 0;
  Vec3 centre_ = Vec3::Zero();
  std::string text_;
};

}  // namespace

std::string diagnosis_program(const Machine& machine, const Piece* piece,
                              const ProgramOptions& options) {
  return Writer(machine, piece, options).text(machine);
}

}  // namespace vcnc
