// G-code to typed blocks: the words of a line change the modal state, and what remains to be done
// is a Move, a Dwell, a spindle word, a stop or the end.
//
// Accepted
//   motion    G0 G1 G2 G3 (centre by I J K, incremental, or R; helical)    plane  G17 G18 G19
//   G4 P[s]   G28 (via point, then the reference = start positions of the machine file)
//   units     G20 G21      distance  G90 G91      feed  G93 G94
//   length    G43 Hn   G43.4 Hn (RTCP)   G49      cutter compensation  G40 (off)
//   offsets   G53 (one block, machine coordinates)   G54 .. G59
//   path      G61 (exact)  G64 [Pn, tolerance in length units]
//   M0 M1 M2 M3 M4 M5 M19 M30, F, S, N, O and % headers
// Everything else is refused with FILE:LINE, the word, and what is allowed.
//
// Coordinates. Without RTCP, X Y Z are axis positions in the active work offset: axis = word +
// offset (+ tool length on Z under G43). Under G43.4 they are the controlled point in the workpiece
// frame of the active offset. A and C are always positions of the rotary axes [deg].
// G91 is incremental in the same coordinates.
//
// At the start: G17 G21 G40 G49 G54 G64 G90 G94, no motion mode, no feed. M0 holds for
// kProgramStopSeconds (the operator of a virtual machine presses start at once); the switch for the
// optional stop M1 is off, so M1 only brings the axes to rest. What follows M2 or M30 is not read;
// a file without either is refused.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "controller/gcode_blocks.hpp"
#include "controller/gcode_line.hpp"

namespace vcnc {

inline constexpr double kProgramStopSeconds = 1.0;

/// Reads a program block by block with bounded memory.
class GcodeInterpreter {
 public:
  /// Throws ProgramError where the file cannot be read.
  GcodeInterpreter(const std::string& path, const Machine& machine);

  /// The next block; ProgramEnd is the last one and is repeated. Throws ProgramError.
  Block next();

 private:
  struct Modal {
    std::optional<int> motion;  ///< 0, 1, 2, 3
    std::size_t normal = kZ;
    double length_unit = 1e-3;
    bool absolute = true, inverse_time = false, exact = false;
    double tolerance = 0;
    std::size_t offset = 0;  ///< index of G54..G59
    enum class Length { none, along_z, rtcp } length = Length::none;
    double tool_length = 0;
    double linear_feed = 0, rotary_feed = 0;  ///< [m/s], [rad/s]; 0: no F yet
    double spindle_speed = 0;                 ///< [rad/s]
  };
  void read_line(const std::string& text);
  void set_modes(const GcodeLine& line);
  void set_tool_length(const GcodeLine& line, int code);
  void set_feed(const GcodeLine& line);
  void set_spindle(const GcodeLine& line);
  void emit_motion(const GcodeLine& line);
  void emit_reference_return(const GcodeLine& line);
  Coordinates target(const GcodeLine& line, bool machine_coordinates) const;
  Arc arc_to(const GcodeLine& line, const Coordinates& end) const;
  void set_move_feed(Move& move) const;
  void emit_move(Move move);
  void enter_frame();  ///< re-expresses the position after a change of offset or length
  MotionFrame frame() const;
  [[noreturn]] void fail(const std::string& reason) const;

  const Machine machine_;
  ProgramLines lines_;
  Modal modal_;
  MotionFrame frame_;
  FrameMap map_;
  Coordinates position_;  ///< in frame_
  std::deque<Block> ready_;
  bool ended_ = false;
};

}  // namespace vcnc
