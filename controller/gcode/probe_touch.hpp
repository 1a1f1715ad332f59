// What a probing move (G31, G38.n) has come to: for the parameters of the program, and for going on
// with it in its middle as if the probing had just been done.
#pragma once

#include "model/axes.hpp"

namespace vcnc {

struct ProbeTouch {
  int line = 0;
  bool touched = false;  ///< or, for G38.4 and G38.5, let go
  double at = 0;         ///< when it ended, on the path of the move [s]
  AxisVector target{};   ///< its end as the program says it, in its coordinates [m, rad]
  AxisVector found{};    ///< axis positions at the contact; without one where the axes stand
  AxisVector rest{};     ///< where the axes have come to rest
  friend bool operator==(const ProbeTouch&, const ProbeTouch&) = default;
};

}  // namespace vcnc
