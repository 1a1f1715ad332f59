// A scenario made ready to run: machine, workpiece and program.
//
// The built-in kinds put the ball of a ready machine `run_up` before a surface it touches at the
// point p0 (workpiece frame) and drive it along the way w. With n the outward surface normal there:
//   program_error, not_retracted  the program ends at p0 + depth w
//   wrong_offset   it ends `setup.predeflection` behind the surface where the piece is believed to
//                  be; the piece stands s = depth - predeflection nearer: true offset = offset - s
//                  w
//   wrong_length   the same with a stylus that is s longer; w points along the tool
//   rotary         the ball is swung about the A axis without RTCP; n is opposite to the way of the
//                  ball where it touches, the angle of the swing is depth over its radius
//   scan           p0 - run_up n, to the predeflection, sideways along the surface, and back
// Sphere and bore touch with their normal along the way. What is deflected then follows from the
// physics; nothing here says what the protection makes of it.
#pragma once

#include <optional>
#include <string>

#include "bus/fault.hpp"
#include "configs/scenario.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct LockoutCase {
  Machine machine;  ///< its start positions are those of the scenario
  std::optional<PieceParams> piece;
  std::string program;
  BusFaults faults{};        ///< those at contact not yet resolved
  bool within_limit = true;  ///< as the scenario says
};

/// Throws InputError where the scenario cannot be made.
LockoutCase make_case(const Scenario& scenario);

}  // namespace vcnc
