#include "controller/gcode/tool_table.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "controller/gcode/cursor.hpp"
#include "controller/gcode/program_text.hpp"

namespace vcnc {
namespace {

/// One line "T1 P1 Z.. D.. ; comment"; returns the tool's number, or -1 for an empty line.
int read_tool(std::string_view line, double length_unit, ToolEntry& tool) {
  Cursor at(line);
  int number = -1;
  for (at.skip_blanks(); !at.at_end() && at.peek() != ';'; at.skip_blanks()) {
    const int column = at.column();
    const char letter = upper(at.peek());
    if (!is_letter(letter))
      throw LineError(
          fmt::format("unexpected '{}'; a word is a letter followed by a number", at.peek()),
          column);
    at.advance();
    at.skip_blanks();
    const double value = at.number();
    switch (letter) {
      case 'T':
        number = whole_number(value);
        if (number < 0 || number > ToolTable::kLast)
          throw LineError(fmt::format("T{:g}: allowed is 0 to {}", value, ToolTable::kLast),
                          column);
        break;
      case 'X':
      case 'Y':
      case 'Z':
        tool.offset[letter - 'X'] = value * length_unit;
        break;
      case 'A':
        tool.offset[kA] = value * kDegree;
        break;
      case 'C':
        tool.offset[kC] = value * kDegree;
        break;
      case 'D':
        tool.diameter = value * length_unit;
        break;
      default:
        if (std::string_view("PBUVWIJQ").find(letter) == std::string_view::npos)
          throw LineError(
              fmt::format("unknown word {}; a tool has T P X Y Z A B C U V W D I J Q", letter),
              column);
    }
  }
  return number;
}

}  // namespace

ToolTable::ToolTable(const Machine& machine) {
  for (int h = 1;; ++h) {
    try {
      tools_[h].offset[kZ] = machine.tool_length(h);
    } catch (const std::out_of_range&) {
      tools_.erase(h);
      break;
    }
  }
  const std::vector<double>& diameters = machine.setup.tool_diameter;
  for (std::size_t d = 0; d < diameters.size(); ++d)
    tools_[static_cast<int>(d) + 1].diameter = diameters[d];
  if (diameters.empty()) tools_[1].diameter = 2 * machine.probe.ball_radius;
}

ToolTable ToolTable::read(const std::string& path, double length_unit) {
  ToolTable table;
  ProgramText text(path);
  for (std::string_view line; text.next(line);) {
    ToolEntry tool;
    try {
      const int number = read_tool(line, length_unit, tool);
      if (number < 0) continue;
      if (!table.tools_.emplace(number, tool).second)
        throw LineError(fmt::format("T{} given twice; allowed is once", number), 1);
    } catch (const LineError& error) {
      throw ProgramError(
          fmt::format("{}:{}:{}: {}", path, text.last().line, error.column, error.what()));
    }
  }
  return table;
}

std::string ToolTable::to_text(double length_unit) const {
  std::string text;
  for (const auto& [number, tool] : tools_) {
    text += fmt::format("T{} P{}", number, number);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const double x = tool.offset[static_cast<Eigen::Index>(i)];
      if (x != 0 || i == kZ)
        text += fmt::format(" {}{:.9g}", kAxisNames[i], x / (is_rotary(i) ? kDegree : length_unit));
    }
    text += fmt::format(" D{:.9g}\n", tool.diameter / length_unit);
  }
  return text;
}

const ToolEntry* ToolTable::find(int number) const {
  static const ToolEntry none;
  if (number == 0) return &none;
  const auto found = tools_.find(number);
  return found == tools_.end() ? nullptr : &found->second;
}

std::string ToolTable::known() const {
  if (tools_.empty()) return "0 (the tool table is empty)";
  std::string text = "0";
  int count = 0;
  for (const auto& [number, tool] : tools_) {
    if (number == 0) continue;
    if (++count > 20) return text + " ...";
    text += fmt::format(" {}", number);
  }
  return text;
}

}  // namespace vcnc
