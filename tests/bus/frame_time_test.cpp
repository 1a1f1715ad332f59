#include "bus/frame_time.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bus/messages.hpp"
#include "bus/timed_bus.hpp"
#include "toy_machine.hpp"

namespace vcnc::frame_time_test {
namespace {

constexpr BitRates k1And5{1e6, 5e6}, k1And8{1e6, 8e6};

// ------------------------------------------------------------------ a second, bit-by-bit encoder
using Bits = std::vector<int>;

void append(Bits& bits, unsigned value, int count) {
  for (int i = count - 1; i >= 0; --i) bits.push_back(static_cast<int>(value >> i & 1));
}

/// Stuff bits inserted into bits[0, end); the ones at or after `from` are counted apart.
struct Stuffing {
  int before = 0, after = 0;
};
Stuffing stuff(const Bits& bits, std::size_t from, bool also_behind_last) {
  Stuffing count;
  int run = 0, last = -1;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    run = bits[i] == last ? run + 1 : 1;
    last = bits[i];
    if (run < 5) continue;
    if (i + 1 == bits.size() && !also_behind_last) break;
    ++(i < from ? count.before : count.after);
    last = 1 - last;
    run = 1;
  }
  return count;
}

unsigned code_of(int len) {
  for (unsigned code = 0; code < 16; ++code) {
    constexpr int kLengths[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    if (kLengths[code] == len) return code;
  }
  return 99;
}

unsigned crc15(const Bits& bits) {
  unsigned crc = 0;
  for (const int bit : bits) {
    const unsigned next = static_cast<unsigned>(bit) ^ (crc >> 14 & 1);
    crc = crc << 1 & 0x7fff;
    if (next) crc ^= 0x4599;
  }
  return crc;
}

FrameBits reference(const Frame& frame) {
  Bits bits;
  append(bits, 0, 1);
  append(bits, frame.id, 11);
  if (!frame.fd) {
    append(bits, 0, 3);  // RTR, IDE, r0
    append(bits, code_of(frame.len), 4);
    for (const auto byte : frame.payload()) append(bits, byte, 8);
    append(bits, crc15(bits), 15);
    const int all = static_cast<int>(bits.size()) + stuff(bits, bits.size(), true).before;
    return {all + 1 + 2 + 7 + 3, 0};
  }
  append(bits, 0b00101, 5);  // RRS, IDE, FDF, res, BRS
  const std::size_t fast = bits.size();
  append(bits, 0, 1);  // ESI
  append(bits, code_of(frame.len), 4);
  for (const auto byte : frame.payload()) append(bits, byte, 8);
  const Stuffing stuffed = stuff(bits, fast, false);
  const int crc = frame.len <= 16 ? 4 + 17 + 6 : 4 + 21 + 7;
  return {static_cast<int>(fast) - 1 + 1 + stuffed.before + 2 + 7 + 3,
          1 + static_cast<int>(bits.size() - fast) + stuffed.after + crc};
}

Frame random_frame(toy::Random& random, bool fd) {
  constexpr int kLengths[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  Frame frame;
  frame.fd = fd;
  frame.id = static_cast<std::uint16_t>(random.next() % 2048);
  frame.len = static_cast<std::uint8_t>(kLengths[random.next() % (fd ? 16 : 9)]);
  // Long runs of equal bits are where stuffing happens.
  const std::uint64_t kind = random.next() % 4;
  for (int i = 0; i < frame.len; ++i) {
    const auto byte = static_cast<std::uint8_t>(random.next());
    constexpr std::uint8_t kRuns[8] = {0x00, 0xff, 0x0f, 0xf0, 0x1f, 0xe0, 0x78, 0x87};
    frame.data[static_cast<std::size_t>(i)] = kind == 0   ? byte
                                              : kind == 1 ? 0
                                              : kind == 2 ? kRuns[byte % 8]
                                                          : kRuns[byte % 2];
  }
  return frame;
}

TEST(FrameTime, WorstCasesOfTheFdTable) {
  const std::vector<std::pair<int, int>> us_at_1_5{{0, 39},   {8, 55},   {16, 71},
                                                   {32, 104}, {48, 136}, {64, 168}};
  for (const auto& [len, us] : us_at_1_5)
    EXPECT_EQ(std::llround(static_cast<double>(worst_duration_ns(len, true, k1And5)) / 1000), us)
        << len;
  const std::vector<std::pair<int, int>> us_at_1_8{{0, 36},  {8, 46},  {16, 56},
                                                   {32, 77}, {48, 97}, {64, 117}};
  for (const auto& [len, us] : us_at_1_8)
    EXPECT_EQ(std::llround(static_cast<double>(worst_duration_ns(len, true, k1And8)) / 1000), us)
        << len;
}

TEST(FrameTime, ClassicalFramesOfEightBytesTakeAtMost135Bits) {
  EXPECT_EQ(worst_bits(8, false).nominal, 135);
  EXPECT_EQ(worst_bits(0, false).nominal, 55);
  EXPECT_EQ(worst_duration_ns(8, false, k1And5), 135000);
}

TEST(FrameTime, ArbitrationFieldHasAtMostThreeStuffBits) {
  int most = 0;
  for (int id = 0; id < 2048; ++id) {
    Frame frame;
    frame.id = static_cast<std::uint16_t>(id);
    frame.fd = true;
    most = std::max(most, exact_bits(frame).nominal - 29);
  }
  EXPECT_EQ(most, 3);
}

TEST(FrameTime, ExactAgreesWithABitByBitEncoderAndStaysBelowTheWorstCase) {
  toy::Random random(2024);
  for (int i = 0; i < 20000; ++i) {
    const Frame frame = random_frame(random, i % 2 == 0);
    const FrameBits exact = exact_bits(frame), expected = reference(frame);
    ASSERT_EQ(exact.nominal, expected.nominal) << "id " << frame.id << " len " << int(frame.len);
    ASSERT_EQ(exact.data, expected.data) << "id " << frame.id << " len " << int(frame.len);
    const FrameBits worst = worst_bits(frame.len, frame.fd);
    ASSERT_LE(exact.nominal, worst.nominal);
    ASSERT_LE(exact.data, worst.data);
  }
}

TEST(FrameTime, OurCycleFitsInTheWorstCase) {
  double total_ns = static_cast<double>(worst_duration_ns(1, false, k1And5));  // SYNC
  for (const Frame& frame :
       {encode(GroupCommand{}), encode(ProbeSample{}), encode(OvertravelState{})})
    total_ns += static_cast<double>(worst_duration_ns(frame.len, frame.fd, k1And5));
  for (int node = 1; node <= kSpindleNode; ++node) {
    const Frame status = encode(DriveStatus{.node = node});
    total_ns += static_cast<double>(worst_duration_ns(status.len, status.fd, k1And5));
  }
  const double share = total_ns * 1e-9 / kCycle;
  EXPECT_LE(share, 0.85);
  EXPECT_GE(share, 0.75);  // and it is not a bus with nothing on it
}

TEST(FrameTime, LoadIsTheSumOfTheFrames) {
  toy::Random random(9);
  Frames frames;
  double total = 0;
  for (int i = 0; i < 12; ++i) {
    frames.push_back(random_frame(random, i % 3 != 0));
    const FrameBits bits = reference(frames.back());
    total += bits.nominal / 1e6 + bits.data / 5e6;
  }
  EXPECT_NEAR(bus_load(frames, k1And5), total / kCycle, 1e-12);
  EXPECT_EQ(bus_load({}, k1And5), 0);
}

}  // namespace
}  // namespace vcnc::frame_time_test
