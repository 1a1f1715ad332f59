// A program text as a file, and helpers to read it.
#pragma once

#include <string>
#include <vector>

#include "controller/gcode/interpreter.hpp"
#include "controller/player.hpp"
#include "tests/scratch.hpp"

namespace vcnc {

class ProgramFile : public TemporaryFile {
 public:
  explicit ProgramFile(const std::string& text) : TemporaryFile("program.nc", text) {}
};

/// All blocks before the end.
inline std::vector<Block> read_blocks(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  GcodeInterpreter interpreter(file.path(), machine);
  std::vector<Block> blocks;
  for (Block block = interpreter.next(); !std::holds_alternative<ProgramEnd>(block);
       block = interpreter.next())
    blocks.push_back(block);
  return blocks;
}

/// All moves of a program.
inline std::vector<Move> read_moves(const std::string& text, const Machine& machine) {
  std::vector<Move> moves;
  for (const Block& block : read_blocks(text, machine))
    if (const Move* move = std::get_if<Move>(&block)) moves.push_back(*move);
  return moves;
}

/// Why the program is refused before anything moves; empty: it is not.
inline std::string refusal(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  try {
    Player(file.path(), machine);
  } catch (const ProgramError& e) {
    return e.what();
  }
  return "";
}

}  // namespace vcnc
