// The words of one block, sorted: which code of each modal group, which value of each letter.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "controller/gcode/cursor.hpp"
#include "controller/gcode/modal_codes.hpp"

namespace vcnc {

/// What the program language calls the five axes.
inline constexpr std::string_view kAxisLetters = "XYZAC";

class BlockWords {
 public:
  void clear() { letters_ = used_ = g_groups_ = m_groups_ = 0; }

  /// Enters a word. Throws LineError for an unknown code, two codes of one group, a letter given
  /// twice.
  void enter(char letter, double value, int column);
  void enter_g(int tenths, int column);

  bool empty() const { return (letters_ | g_groups_ | m_groups_) == 0; }
  bool has(char letter) const { return letters_ & bit(letter); }
  double value(char letter) const { return value_[index(letter)]; }
  double value_or(char letter, double otherwise) const {
    return has(letter) ? value(letter) : otherwise;
  }
  /// Of the letter, the line as a whole if it is not there.
  int column(char letter) const { return has(letter) ? column_[index(letter)] : 0; }
  bool any_axis() const { return letters_ & kAxisBits; }
  bool any_of(std::string_view letters) const {
    for (const char c : letters)
      if (has(c)) return true;
    return false;
  }

  bool has(GGroup group) const { return g_groups_ & bit(group); }
  bool has(MGroup group) const { return m_groups_ & bit(group); }
  /// Code of the group, or -1: in tenths for G.
  int code(GGroup group) const { return has(group) ? g_[static_cast<std::size_t>(group)] : -1; }
  int code(MGroup group) const { return has(group) ? m_[static_cast<std::size_t>(group)] : -1; }
  int column(GGroup group) const { return has(group) ? g_at_[static_cast<std::size_t>(group)] : 0; }
  int column(MGroup group) const { return has(group) ? m_at_[static_cast<std::size_t>(group)] : 0; }

  /// Somebody has asked for the letter; at the end of the block none may be left over.
  void use(std::string_view letters) {
    for (const char c : letters) used_ |= bit(c);
  }
  bool used(char letter) const { return used_ & bit(letter); }
  bool all_used() const { return (letters_ & ~used_) == 0; }

 private:
  static constexpr std::size_t index(char letter) { return static_cast<std::size_t>(letter - 'A'); }
  static constexpr std::uint32_t bit(char letter) { return 1u << index(letter); }
  static constexpr std::uint32_t bit(GGroup group) { return 1u << static_cast<int>(group); }
  static constexpr std::uint32_t bit(MGroup group) { return 1u << static_cast<int>(group); }
  static constexpr std::uint32_t kAxisBits = 1u << 0 | 1u << 2 | 7u << 23;

  std::uint32_t letters_ = 0, used_ = 0, g_groups_ = 0, m_groups_ = 0;
  std::array<double, 26> value_;
  std::array<int, 26> column_;
  std::array<int, kGGroups> g_, g_at_;
  std::array<int, kMGroups> m_, m_at_;
};

}  // namespace vcnc
