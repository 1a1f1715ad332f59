// A program text as a file, and helpers to read it.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "controller/gcode/interpreter.hpp"
#include "controller/player.hpp"

namespace vcnc {

/// Exists as long as the object does.
class ProgramFile {
 public:
  explicit ProgramFile(const std::string& text) {
    static int count = 0;
    const std::string name =
        "program_" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".nc";
    path_ = (std::filesystem::temp_directory_path() / name).string();
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~ProgramFile() { std::remove(path_.c_str()); }
  ProgramFile(const ProgramFile&) = delete;
  ProgramFile& operator=(const ProgramFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
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
