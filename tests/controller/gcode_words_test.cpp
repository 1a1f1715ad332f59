#include "controller/gcode_words.hpp"

#include <gtest/gtest.h>

#include "tests/controller/program_file.hpp"

namespace vcnc {
namespace {

std::string message_of(const std::string& line) {
  try {
    split_words(line, "P:7");
  } catch (const ProgramError& error) {
    return error.what();
  }
  return "";
}

TEST(SplitWords, ReadsLettersAndNumbersInAnySpelling) {
  const auto words = split_words(" n10 g1X-1.5 Y +.25(comment)z2. ; rest G99", "P:1");
  ASSERT_EQ(words.size(), 5u);
  const std::vector<std::pair<char, double>> expected{
      {'N', 10}, {'G', 1}, {'X', -1.5}, {'Y', 0.25}, {'Z', 2}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(words[i].letter, expected[i].first);
    EXPECT_EQ(words[i].value, expected[i].second);
  }
  EXPECT_EQ(words[3].text, "Y+.25");
}

TEST(SplitWords, TakesHeadersAndEmptyLinesAsNothing) {
  for (const char* line : {"", "   ", "%", " %1234 anything /$", "(all comment)", "; G1"})
    EXPECT_TRUE(split_words(line, "P:1").empty()) << line;
}

TEST(SplitWords, DoesNotReadExponents) {
  const auto words = split_words("X1e3", "P:1");
  ASSERT_EQ(words.size(), 2u);
  EXPECT_EQ(words[1].letter, 'E');
}

TEST(SplitWords, RefusesWhatIsNoWord) {
  for (const char* line : {"X", "X+-1", "X--1", "X1.2.3", "X.", "X-", "G1 X1-2", "X++1"})
    EXPECT_NE(message_of(line).find("P:7: malformed number"), std::string::npos) << line;
  for (const char* line : {"12", "/G1", "G1 #1", "\"", "\xC3\xA9", "X1 2", "*"})
    EXPECT_NE(message_of(line).find("P:7: unexpected"), std::string::npos) << line;
  EXPECT_NE(message_of("X99999999").find("too large"), std::string::npos);
  EXPECT_NE(message_of("G1 (open").find("without closing"), std::string::npos);
}

TEST(ProgramLines, StripsLineEndsAndByteOrderMark) {
  const ProgramFile file("\xEF\xBB\xBFG1\r\nX2\n\nlast");
  ProgramLines lines(file.path());
  std::string line;
  std::vector<std::string> all;
  while (lines.next(line)) all.push_back(line);
  EXPECT_EQ(all, (std::vector<std::string>{"G1", "X2", "", "last"}));
  EXPECT_EQ(lines.number(), 4);
}

TEST(ProgramLines, RefusesWhatIsNoText) {
  std::string line;
  const ProgramFile nul(std::string("G1\nG\0 1\n", 8));
  ProgramLines with_nul(nul.path());
  EXPECT_TRUE(with_nul.next(line));
  EXPECT_THROW(with_nul.next(line), ProgramError);

  const ProgramFile longest(std::string(ProgramLines::kLongestLine, ' ') + "\n");
  EXPECT_TRUE(ProgramLines(longest.path()).next(line));
  const ProgramFile too_long(std::string(ProgramLines::kLongestLine + 1, ' ') + "\n");
  EXPECT_THROW(ProgramLines(too_long.path()).next(line), ProgramError);

  EXPECT_THROW(ProgramLines("no_such_program.nc"), ProgramError);
  EXPECT_THROW(ProgramLines("."), ProgramError);
}

}  // namespace
}  // namespace vcnc
