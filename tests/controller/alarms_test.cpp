#include "controller/alarms.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

namespace vcnc::alarms_test {
namespace {

TEST(Alarms, EveryAlarmHasANumberATextACauseAndARemedy) {
  std::set<int> seen;
  int last = 0;
  for (const AlarmText& a : alarm_texts()) {
    const int number = static_cast<int>(a.code);
    EXPECT_TRUE(seen.insert(number).second) << number;
    EXPECT_GT(number, last) << "ascending";
    last = number;
    for (const char* text : {a.title, a.cause, a.remedy}) EXPECT_GT(std::string(text).size(), 4u);
    EXPECT_EQ(&alarm_text(a.code), &a);
  }
  EXPECT_GE(seen.size(), 14u);
}

TEST(Alarms, ThePageIsTheTable) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/docs/alarms.md");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), alarms_markdown())
      << "vcnc alarms > docs/alarms.md";
}

}  // namespace
}  // namespace vcnc::alarms_test
