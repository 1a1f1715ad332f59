// How the NC unit rides out a loss of the mains while a program runs.
//
//   holding     feed hold: the axes come to rest on the path
//   settling    0.1 s, until the probe's reading is that of axes at rest
//   retracting  the probe is taken off what it touches (controller/retract.hpp)
//   waiting     for the mains, and for leave to go on
//   spindle     it turns or stands as the program has it, which it did not since settling
//   returning   back to the path (controller/path_return.hpp)
//   rising      the feed rises (Player::go_on); after that the program goes on as if nothing had
//   been
//
// A loss while the feed rises is a feed hold again; one on the way back is met on the path, which
// is no farther than the probe's length of retraction, by another retraction.
#pragma once

#include <optional>

#include "controller/path_return.hpp"
#include "controller/player.hpp"
#include "controller/retract.hpp"
#include "model/machine.hpp"

namespace vcnc {

class Outage {
 public:
  enum class Phase { none, holding, settling, retracting, waiting, spindle, returning, rising };

  /// `player` outlives this one.
  Outage(const Machine& machine, Player& player);

  /// The mains have failed. Only while the program is being played.
  void begin();
  /// The machine has been switched on again, its axes standing here; the player has been sought.
  void go_on_from(const AxisVector& position);

  /// What is known in a cycle.
  struct Situation {
    bool failing = false;  ///< the power-fail signal
    bool go_on = false;    ///< the program may go on
    Vec3 deflection = Vec3::Zero();
  };
  /// What the axes do in the next cycle. Not in phase `none`.
  PlayerStep step(const Situation& now);

  Phase phase() const { return phase_; }
  bool active() const { return phase_ != Phase::none; }
  /// On the path, at its feed or less.
  bool on_path() const { return phase_ == Phase::holding || phase_ == Phase::rising; }
  /// Away from the path: a feed hold has no meaning.
  bool off_path() const { return phase_ >= Phase::retracting && phase_ <= Phase::returning; }

 private:
  void enter(Phase phase);
  bool touches(const Vec3& deflection) const;
  double spindle_seconds() const;

  const Machine& machine_;
  Player& player_;
  Phase phase_ = Phase::none;
  Tick cycles_ = 0;     ///< in this phase
  PlayerStep held_;     ///< the path's step at rest
  AxisVector place_{};  ///< where the axes are told to stand
  std::optional<Retract> retract_;
  std::optional<PathReturn> return_;
};

}  // namespace vcnc
