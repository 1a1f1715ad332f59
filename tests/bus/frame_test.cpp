#include "bus/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "toy_machine.hpp"

namespace vcnc::frame_test {
namespace {

TEST(Frame, ValidLengthsAreThoseOfTheStandard) {
  const std::vector<int> fd_only{12, 16, 20, 24, 32, 48, 64};
  for (int len = -1; len <= 70; ++len) {
    const bool classical = len >= 0 && len <= 8;
    EXPECT_EQ(valid_length(len, false), classical) << len;
    EXPECT_EQ(valid_length(len, true),
              classical || std::find(fd_only.begin(), fd_only.end(), len) != fd_only.end())
        << len;
  }
}

TEST(Frame, EqualityLooksAtThePayloadOnly) {
  Frame a, b;
  a.len = b.len = 3;
  b.data[3] = 1;  // behind the payload
  EXPECT_EQ(a, b);
  b.data[2] = 1;
  EXPECT_NE(a, b);
  Frame fd = a;
  fd.fd = true;
  EXPECT_NE(a, fd);
}

TEST(Frame, SortIsStableAndAgreesWithTheLibrary) {
  toy::Random random(1);
  for (int run = 0; run < 500; ++run) {
    Frames frames(random.next() % 40);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].id = static_cast<std::uint16_t>(random.next() % 12);
      frames[i].len = 1;
      frames[i].data[0] = static_cast<std::uint8_t>(i);
    }
    Frames expected = frames;
    std::stable_sort(expected.begin(), expected.end(),
                     [](const Frame& a, const Frame& b) { return a.id < b.id; });
    sort_by_id(frames);
    EXPECT_EQ(frames, expected);
  }
}

}  // namespace
}  // namespace vcnc::frame_test
