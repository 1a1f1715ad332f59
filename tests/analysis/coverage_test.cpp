#include "analysis/coverage.hpp"

#include <gtest/gtest.h>

namespace vcnc::coverage_test {
namespace {

using Bin = Coverage::Bin;

void walk(Coverage& c, double from, double to, Contact contact, double step = 1e-4) {
  const int n = static_cast<int>(std::abs(to - from) / step + 0.5);
  for (int i = 0; i < n; ++i) c.add(from + (to - from) * i / n, (to - from) / n, contact);
}

TEST(Coverage, BinsDivideTheLineEvenly) {
  const Coverage c(10.4e-3, 1e-3);
  EXPECT_EQ(c.size(), 10u);
  EXPECT_DOUBLE_EQ(c.bin_length(), 1.04e-3);
  EXPECT_EQ(c.count(Bin::not_visited), 10);
  EXPECT_EQ(c.percent(), 0);
}

TEST(Coverage, WalkInEitherDirectionCovers) {
  for (const bool forward : {true, false}) {
    Coverage c(10e-3, 1e-3);
    walk(c, forward ? 0 : 10e-3, forward ? 10e-3 : 0, Contact::ok);
    EXPECT_EQ(c.percent(), 100);
  }
}

TEST(Coverage, StepsLongerThanABinCoverAllBinsBetween) {
  Coverage c(10e-3, 1e-3);
  for (int i = 0; i < 4; ++i) c.add(i * 2.5e-3, 2.5e-3, Contact::ok);
  EXPECT_EQ(c.percent(), 100);
}

TEST(Coverage, WrapsOverTheClosingPoint) {
  Coverage c(10e-3, 1e-3);
  walk(c, 7e-3, 13e-3, Contact::ok);
  EXPECT_EQ(c.bin(9), Bin::ok);
  EXPECT_EQ(c.bin(0), Bin::ok);
  EXPECT_EQ(c.bin(2), Bin::ok);
  EXPECT_EQ(c.bin(3), Bin::not_visited);
  EXPECT_EQ(c.bin(6), Bin::not_visited);
}

TEST(Coverage, LessThanHalfABinIsNotCovered) {
  Coverage c(10e-3, 1e-3);
  walk(c, 0, 0.4e-3, Contact::ok);
  EXPECT_EQ(c.bin(0), Bin::not_visited);
  walk(c, 0.4e-3, 0.7e-3, Contact::ok);
  EXPECT_EQ(c.bin(0), Bin::ok);
}

TEST(Coverage, WorstOfAPassCountsAndALaterCleanPassReplacesIt) {
  Coverage c(10e-3, 1e-3);
  walk(c, 0, 10e-3, Contact::ok);
  Coverage bad(10e-3, 1e-3);
  walk(bad, 0, 3.5e-3, Contact::ok);
  walk(bad, 3.5e-3, 3.7e-3, Contact::no_contact);
  walk(bad, 3.7e-3, 3.8e-3, Contact::invalid);
  walk(bad, 3.8e-3, 10e-3, Contact::ok);
  EXPECT_EQ(bad.bin(3), Bin::invalid);
  EXPECT_EQ(bad.count(Bin::ok), 9);
  walk(bad, 2.5e-3, 4.5e-3, Contact::ok);  // local rescan
  EXPECT_EQ(bad.percent(), 100);
}

TEST(Coverage, LaterBadPassDoesNotTakeAwayWhatWasMeasured) {
  Coverage c(10e-3, 1e-3);
  walk(c, 0, 10e-3, Contact::ok);
  walk(c, 0, 10e-3, Contact::out_of_range);
  EXPECT_EQ(c.percent(), 100);
}

}  // namespace
}  // namespace vcnc::coverage_test
