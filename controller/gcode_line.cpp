#include "controller/gcode_line.hpp"

#include <fmt/format.h>

#include <cmath>

namespace vcnc {
namespace {

using Group = GcodeLine::Group;
using MGroup = GcodeLine::MGroup;

constexpr std::string_view kAllowedG =
    "G0 G1 G2 G3 G4 G17 G18 G19 G20 G21 G28 G40 G43 G43.4 G49 G53 G54..G59 G61 G64 G90 G91 G93 G94";
constexpr std::string_view kAllowedM = "M0 M1 M2 M3 M4 M5 M19 M30";
constexpr std::string_view kValueLetters = "ACFHIJKNOPRSXYZ";

const std::map<int, Group>& g_codes() {
  static const std::map<int, Group> codes{
      {0, Group::motion},     {10, Group::motion},    {20, Group::motion},  {30, Group::motion},
      {40, Group::once},      {280, Group::once},     {530, Group::once},   {170, Group::plane},
      {180, Group::plane},    {190, Group::plane},    {200, Group::units},  {210, Group::units},
      {400, Group::cutter},   {430, Group::length},   {434, Group::length}, {490, Group::length},
      {540, Group::offset},   {550, Group::offset},   {560, Group::offset}, {570, Group::offset},
      {580, Group::offset},   {590, Group::offset},   {610, Group::path},   {640, Group::path},
      {900, Group::distance}, {910, Group::distance}, {930, Group::feed},   {940, Group::feed}};
  return codes;
}

const std::map<int, MGroup>& m_codes() {
  static const std::map<int, MGroup> codes{
      {0, MGroup::stop},    {1, MGroup::stop},    {2, MGroup::stop},    {30, MGroup::stop},
      {3, MGroup::spindle}, {4, MGroup::spindle}, {5, MGroup::spindle}, {19, MGroup::spindle}};
  return codes;
}

/// Enters a G or M word into its group; returns what is wrong, or nothing.
template <class AnyGroup>
std::string enter(const Word& word, int number, const std::map<int, AnyGroup>& codes,
                  std::string_view allowed, std::map<AnyGroup, int>& groups) {
  const auto code = codes.find(number);
  if (code == codes.end()) return fmt::format("unknown {}; allowed are {}", word.text, allowed);
  if (!groups.emplace(code->second, code->first).second)
    return fmt::format("{} and another {} word of the same group in one block; allowed is one",
                       word.text, word.letter);
  return {};
}

}  // namespace

int whole_number(double value) {
  const double whole = std::round(value);
  return value >= 0 && std::abs(value - whole) < 1e-6 ? static_cast<int>(whole) : -1;
}

GcodeLine sort_words(const std::vector<Word>& words, const std::string& where) {
  GcodeLine line;
  for (const Word& word : words) {
    std::string wrong;
    if (word.letter == 'G') {
      wrong = enter(word, whole_number(10 * word.value), g_codes(), kAllowedG, line.g);
    } else if (word.letter == 'M') {
      wrong = enter(word, whole_number(word.value), m_codes(), kAllowedM, line.m);
    } else if (kValueLetters.find(word.letter) == std::string_view::npos) {
      wrong = fmt::format("unknown word {}; allowed letters are A C F G H I J K M N O P R S X Y Z",
                          word.text);
    } else {
      auto& slot = line.words[static_cast<std::size_t>(word.letter - 'A')];
      if (slot) wrong = fmt::format("{} given twice in one block; allowed is once", word.text);
      slot = word.value;
    }
    if (!wrong.empty()) throw ProgramError(fmt::format("{}: {}", where, wrong));
  }
  return line;
}

}  // namespace vcnc
