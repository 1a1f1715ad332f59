#include "controller/gcode/block_words.hpp"

#include <fmt/format.h>

#include <cmath>

namespace vcnc {

void BlockWords::enter_g(int tenths, int column) {
  const GGroup group = g_group(tenths);
  if (group == GGroup::unknown)
    throw LineError(fmt::format("unknown {}; allowed are {}", code_name(tenths), kKnownG), column);
  if (group == GGroup::motion && has(group) && (code(group) == 800) != (tenths == 800)) {
    // G80 G0: the cycle ends and the other word moves.
    if (tenths != 800) g_[static_cast<std::size_t>(group)] = tenths;
    return;
  }
  if (has(group)) {
    const int other = code(group);
    throw LineError(fmt::format("{} and {} in one block; allowed is one of a modal group",
                                code_name(other), code_name(tenths)),
                    column);
  }
  g_groups_ |= bit(group);
  g_[static_cast<std::size_t>(group)] = tenths;
  g_at_[static_cast<std::size_t>(group)] = column;
}

void BlockWords::enter(char letter, double value, int column) {
  if (letter == 'G') {
    const int tenths = whole_number(10 * value);
    if (tenths < 0 || tenths == kCircleThroughPoint || tenths == kTangentialCircle)
      throw LineError(fmt::format("unknown G{:g}; allowed are {}", value, kKnownG), column);
    enter_g(tenths, column);
  } else if (letter == 'M') {
    const int number = whole_number(value);
    const MGroup group = m_group(number);
    if (group == MGroup::unknown)
      throw LineError(fmt::format("unknown M{:g}; allowed are {}", value, kKnownM), column);
    if (has(group))
      throw LineError(fmt::format("M{} and M{} in one block; allowed is one of a modal group",
                                  code(group), number),
                      column);
    if (number == 9 ? has(MGroup::mist) : group == MGroup::mist && code(MGroup::flood) == 9)
      throw LineError("M7 and M9 in one block; allowed is one of both", column);
    m_groups_ |= bit(group);
    m_[static_cast<std::size_t>(group)] = number;
    m_at_[static_cast<std::size_t>(group)] = column;
  } else {
    if (has(letter))
      throw LineError(fmt::format("{} given twice in one block; allowed is once", letter), column);
    letters_ |= bit(letter);
    value_[index(letter)] = value;
    column_[index(letter)] = column;
  }
}

}  // namespace vcnc
