// A run of the whole machine for tests that know nothing of programs.
#pragma once

#include <optional>

#include "diagnosis/records/record.hpp"

namespace vcnc {

struct RunOfMachine {
  Record record;
  Machine declared;
  std::optional<PieceParams> piece;
};

/// X there and back in the air, on a machine with `effects` that declares none of them.
RunOfMachine reversals_in_the_air(const Effects& effects);
/// Circles of the ball in a ring at several feeds, on a machine likewise.
RunOfMachine circles_in_a_ring(const Effects& effects);
/// One lap of S-EQ1.
RunOfMachine lap_of_the_s_piece(const Effects& effects);

}  // namespace vcnc
