// Cutter compensation: moves of the tool's edge to moves of its centre (G41 left, G42 right).
//
// In the plane the path is shifted by the tool's radius r along its normal n (left of the
// direction of motion), s = +r for G41 and -r for G42:  centre = p + s n.
//   entry      straight from where the tool stands to  p1 + s n  of the first move's end
//   outside    an arc of radius r about the corner joins the shifted moves
//   inside     the shifted moves are cut where they meet
//   flat       (below 5 mrad) both end on the bisector
//   arcs       keep centre and angle; radius R - s (counter-clockwise), R + s (clockwise)
//   exit       straight from  p + s n  to the programmed end of the next move
// A move that would have to run backwards, an arc not larger than the tool on its inside, and an
// entry not longer than r are refused: the tool would cut into what it shall leave standing. So is
// a move of the centre that crosses one of the kWalls before it from the tool's side to that of the
// piece, kDeep behind its line: a neck narrower than the tool. Entry and exit are no walls; a rapid
// and a move along the plane's normal begin anew, since what follows may run above what stands; a
// contour that crosses itself as it is programmed is not looked at any further. Each move waits for
// the next one in the plane.
//
// Source: LinuxCNC user manual, "Cutter compensation", whose entry and exit these are.
#pragma once

#include <array>
#include <vector>

#include "controller/gcode/arc_geometry.hpp"
#include "controller/gcode_blocks.hpp"

namespace vcnc {

class CutterCompensation {
 public:
  static constexpr std::size_t kMostWaiting = 1000, kWalls = 1000;
  static constexpr double kDeep = 5e-6;  ///< [m]; programs round to less

  bool active() const { return state_ != State::off; }
  void begin(double radius, bool left, std::size_t normal);
  void end();  ///< the next move in the plane leaves

  /// Takes a block, gives what has become certain. Throws LineError (without column).
  void add(Block block, std::vector<Block>& ready);
  /// Gives everything; the last move ends perpendicular to its programmed end.
  void flush(std::vector<Block>& ready);

 private:
  enum class State { off, entry, on, leaving };
  /// A move in the plane: where it begins and ends, its directions there.
  struct Element {
    Move move;
    bool arc = false, entry = false;
    Vec2 from, to, centre;         ///< of the tool's centre
    Vec2 corner;                   ///< programmed end
    Vec2 leaves, arrives;          ///< programmed directions at begin and end
    double bend = 0;               ///< programmed curvature [1/m], positive to the left
    double sweep = 0, radius = 0;  ///< of the tool's centre
  };

  /// The way of the tool's centre in a move; with its box, and for a circle the whole one's.
  struct Way {
    bool arc = false;
    Vec2 from, to, centre;
    double radius = 0, sweep = 0;
    int line = 0;
    Vec2 least, most;
  };

  Way way_of(const Move& move) const;
  void watch(const Move& move);
  void look_at_programmed(const Move& move);
  void begin_anew();
  static void set_box(Way& way);
  static bool near(const Way& a, const Way& b);
  static void keep(std::vector<Way>& ways, Way way);
  static Vec2 direction(const Way& way, const Vec2& p);
  Way wall_of(Way way) const;
  static int crossings(const Way& way, const Way& other, std::array<Vec2, 2>& points);
  bool enters(const Way& way, const Way& wall) const;
  Element shifted(Move move) const;
  void join(Element& next, std::vector<Block>& ready);
  void mitre(Element& next, double turn);
  void cut(Element& next);
  void add_corner(const Element& next, double turn);
  void release(std::vector<Block>& ready);
  void place(Move& move, const Vec2& from, const Vec2& to) const;
  Vec2 planar(const Coordinates& x) const { return {x[u_], x[v_]}; }

  State state_ = State::off;
  double s_ = 0;  ///< signed radius
  std::size_t normal_ = kZ;
  Eigen::Index u_ = 0, v_ = 1;
  bool held_ = false;  ///< last_ waits for its successor
  Element last_;
  std::vector<Block> behind_;    ///< follow last_, without motion in the plane
  std::vector<Move> corner_;     ///< between last_ and the next element
  std::vector<Way> walls_;       ///< moved to the side of the piece by kDeep
  std::vector<Way> programmed_;  ///< without compensation
  bool crossed_ = false;         ///< by the program itself
};

}  // namespace vcnc
