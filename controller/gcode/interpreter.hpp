// G-code to typed blocks: the words of a line change the modal state, and what remains to be done
// is a Move, a Dwell, a spindle word, a stop or the end. What is understood: docs/gcode.md.
//
// Dialects: NGC (LinuxCNC) and the words of Fanuc and Huazhong beside it, macros of Fanuc where the
// program uses them, Siemens where it is asked for (interpreter_siemens.cpp).
//
// Coordinates. Without RTCP, X Y Z are axis positions in the active work offset. Under G43.4
// (G43.5, TRAORI) they are the controlled point in the workpiece frame of the active offset, under
// G68.2 in a plane tilted in it. A and C are always positions of the rotary axes [deg].
//
// At the start: G17 G21 G40 G49 G54 G64 G80 G90 G91.1 G94 G97 G98, no feed. M0 holds for
// kProgramStopSeconds (the operator of a virtual machine presses start at once); the switch for the
// optional stop M1 is off, so M1 only brings the axes to rest. What follows M2, M30 or the second %
// is not read; a file without an end is refused.
//
// A probing move counts as having come to the contact at its end, unless `touches` knows better or
// probed() says so before the next block is asked for.
//
// Memory does not grow with the program (but with its O words), and a program that computes
// without end is refused: kMostPasses of loops, calls and jumps.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/gcode/block_search.hpp"
#include "controller/gcode/nc_data.hpp"
#include "controller/gcode/probe_touch.hpp"
#include "controller/gcode/tool_table.hpp"
#include "controller/gcode_blocks.hpp"

namespace vcnc {

inline constexpr double kProgramStopSeconds = 1.0;

struct InterpreterOptions {
  enum class Dialect { automatic, ngc, fanuc, siemens };
  Dialect dialect = Dialect::automatic;
  std::optional<ToolTable> tools;  ///< instead of those of the machine
  bool block_delete = false;       ///< lines that begin with / are skipped
  bool bare = false;               ///< no machine: any spindle speed, no tools, no probe
  NcData data{};                   ///< what earlier programs have changed at the control
  /// What the probing moves of this program have come to before, in its order.
  std::vector<ProbeTouch> touches{};
};

class ProgramRun;

/// Reads a program block by block with bounded memory.
class GcodeInterpreter {
 public:
  static constexpr long kMostPasses = 2'000'000;

  /// Throws ProgramError where the file cannot be read or its O words do not fit together.
  GcodeInterpreter(const std::string& path, const Machine& machine,
                   InterpreterOptions options = {});
  ~GcodeInterpreter();

  /// The next block; ProgramEnd is the last one and is repeated. Throws ProgramError
  /// ("FILE:LINE:COLUMN: reason").
  Block next();
  /// Runs through to the first time that a line of the program's own file is about to be read; the
  /// next block is its first one. Throws ProgramError where the program cannot begin there.
  BlockStart run_to(int line);
  /// What the probing move that next() gave last is taken to have come to, ...
  const ProbeTouch& probing() const;
  /// ... and what it has.
  void probed(const ProbeTouch& touch);
  /// From here on `touches` is not looked at.
  void forget_touches();
  /// How often it is read; runs to the end.
  long passes_of(int line);
  /// What of it is kept when the machine is switched off now, as far as the program has been read.
  NcData data() const;
  /// The program is in inches (G20) where the last block came from.
  bool inches() const;
  /// The switch, for the lines that have not been read yet.
  void block_delete(bool on);

 private:
  std::unique_ptr<ProgramRun> run_;
};

}  // namespace vcnc
