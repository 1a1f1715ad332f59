// Writes the test program of a diagnosis: one run that makes most effects of an axis, of the
// geometry and of the probe show, and most of it twice, so that the noise can be told from them.
//
//   rings      inside a ring gauge, both ways, at three feeds (1 : 1.6 : 2.5), each for some laps
//   small      circles of half the radius in the air, both ways, at the highest feed
//   ladders    X, Y, Z there and back by 0.05, 0.5 and 5 mm: friction at reversals
//   lines      X, Y there and back across the ring, Z above it, at two feeds
//   spins      the ball rests on the ring at two heights while C and A turn there and back (RTCP),
//              at the lower one twice
//   again      the fastest ring, so that what drifts can be told from what is always there
//
// Lap times are (n + 0.382) / 50 s: what swings with the mains falls on another place of every lap
// (the golden section is as far from repeating as can be). Without a piece the rings are free and
// there are no spins. 130 s in a ring of 55 mm with 2 laps at 2200 mm/min.
// Source: ISO 230-4 (circular tests), ISO 230-6 and ISO 10791-6 (lines, spins with RTCP).
#pragma once

#include <string>

#include "controller/program_writer.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// `piece` may be null; else it must be a ring that is probed inside. feed_mm_min is the lowest of
/// the rings; without a piece radius_mm is needed. Throws std::invalid_argument naming what is
/// wrong.
std::string diagnosis_program(const Machine& machine, const Piece* piece,
                              const ProgramOptions& options);

}  // namespace vcnc
