// The words of one line, sorted: which code of each group, which value of each letter.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/gcode_words.hpp"

namespace vcnc {

inline constexpr std::string_view kAxisLetters = "XYZAC";

struct GcodeLine {
  /// Codes of one group exclude each other in a line.
  enum class Group { motion, once, plane, units, cutter, length, offset, path, distance, feed };
  enum class MGroup { stop, spindle };

  std::map<Group, int> g;   ///< ten times the number: G43.4 = 434
  std::map<MGroup, int> m;  ///< the number
  std::array<std::optional<double>, 26> words;

  bool has(char letter) const { return words[static_cast<std::size_t>(letter - 'A')].has_value(); }
  double value(char letter) const { return *words[static_cast<std::size_t>(letter - 'A')]; }
  bool is(Group group, int code) const {
    const auto found = g.find(group);
    return found != g.end() && found->second == code;
  }
  bool any_axis() const {
    for (const char letter : kAxisLetters)
      if (has(letter)) return true;
    return false;
  }
};

/// Throws ProgramError ("`where`: reason") for an unknown code or letter, two codes of one group
/// and a letter given twice.
GcodeLine sort_words(const std::vector<Word>& words, const std::string& where);

/// A number that must be whole, or -1 where it is not, or negative.
int whole_number(double value);

}  // namespace vcnc
