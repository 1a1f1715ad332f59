// A program file: interpreter, checks of the player, and the first cycles of what passes them.
// The first byte chooses the machine.
#include <variant>

#include "controller/gcode/interpreter.hpp"
#include "controller/player.hpp"
#include "fuzz.hpp"

namespace {

using namespace vcnc;

Machine machine_of(std::uint8_t choice) {
  Machine machine;
  if (choice & 1) machine.kinematics.type = KinematicsParams::Type::head;
  if (choice & 2) machine.probe.in_spindle = false;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisLimits& limits = machine.axes[i].limits;
    if (is_rotary(i)) continue;
    limits.min = -0.5;
    limits.max = 0.5;
  }
  machine.setup.work_offset[0] = {0.01, -0.02, 0.05};
  machine.setup.tool_length = {0.15, 0.1};
  return machine;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static fuzz::MemoryFile file;
  file.hold(fuzz::text_of(data + 1, size - 1));
  const Machine machine = machine_of(data[0]);
  try {
    Player player(file.path(), machine);
    // Planning takes time in proportion to the run's length; here the inputs shall be many.
    double seconds = 0, way = 0;
    int moves = 0;
    GcodeInterpreter blocks(file.path(), machine);
    for (Block block = blocks.next(); !std::holds_alternative<ProgramEnd>(block);
         block = blocks.next()) {
      const Move* move = std::get_if<Move>(&block);
      if (!move) continue;
      const double length = (move->end - move->start).norm();
      ++moves;
      way += length + std::abs(move->arc.sweep) * (move->start.head<3>() - move->arc.centre).norm();
      if (move->feed_mode == Move::Feed::time) seconds += move->feed;
      if (move->feed > 0 && move->feed_mode != Move::Feed::time) seconds += length / move->feed;
    }
    if (moves > 30 || seconds > 3 || way > 2) return 0;
    for (int cycle = 0; cycle < 3000; ++cycle) {
      const PlayerStep step = player.step();
      for (const double q : step.position) fuzz::require(std::isfinite(q));
      for (const double v : step.velocity) fuzz::require(std::isfinite(v));
      if (step.done) break;
      if (cycle == 1500) player.hold();
      if (cycle == 2000) player.go_on();
    }
  } catch (const ProgramError&) {
  }
  return 0;
}
