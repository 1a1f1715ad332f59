#include "bus/memory_slot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

namespace vcnc::memory_slot_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes state_of(std::size_t size, std::uint8_t seed) {
  Bytes state(size);
  for (std::size_t i = 0; i < size; ++i) state[i] = static_cast<std::uint8_t>(seed + 7 * i);
  return state;
}

TEST(MemorySlot, GoldenBytes) {
  const Bytes bytes = encode_slot({258, {0xaa, 0xbb}});
  const Bytes head{'V', 'C', 'N', 'C', 'S', 'L', 'O', 'T', 1, 0, 0, 0,    2,
                   0,   0,   0,   2,   1,   0,   0,   0,   0, 0, 0, 0xaa, 0xbb};
  ASSERT_EQ(bytes.size(), head.size() + 16);
  EXPECT_TRUE(std::equal(head.begin(), head.end(), bytes.begin()));
  std::string why;
  const auto slot = decode_slot(bytes, why);
  ASSERT_TRUE(slot) << why;
  EXPECT_EQ(slot->sequence, 258u);
  EXPECT_EQ(slot->state, (Bytes{0xaa, 0xbb}));
  EXPECT_THROW(encode_slot({0, Bytes(kLargestState + 1)}), std::length_error);
}

/// The two files of a module, written as a memory does it: the older one in place.
struct Files {
  std::array<Bytes, 2> file{encode_slot({0, {}}), encode_slot({1, {}})};
  std::uint64_t sequence = 1;

  std::size_t older() const { return newest_slot(file[0], file[1]).write_to; }
  void save(const Bytes& state) { file[older()] = encode_slot({++sequence, state}); }
};

// A write is torn at every byte: what was there before is followed by nothing, by what the file
// held further on, or by zeros. The state is the old one or, with the last byte, the new one.
TEST(MemorySlot, ATornWriteLeavesTheOldStateOrTheNew) {
  for (const std::size_t length : {0u, 2u, 60u, 211u}) {
    Files files;
    files.save(state_of(length, 1));
    files.save(state_of(length, 2));
    files.save(state_of(length / 2, 3));
    const Bytes old_state = state_of(length / 2, 3), new_state = state_of(length, 4);
    const Bytes written = encode_slot({files.sequence + 1, new_state});
    const std::size_t target = files.older();
    const Bytes before = files.file[target];
    for (std::size_t cut = 0; cut <= written.size(); ++cut)
      for (int rest = 0; rest < 3; ++rest) {
        Bytes torn(written.begin(), written.begin() + static_cast<std::ptrdiff_t>(cut));
        if (rest == 1 && before.size() > cut)
          torn.insert(torn.end(), before.begin() + static_cast<std::ptrdiff_t>(cut), before.end());
        if (rest == 2) torn.resize(written.size());
        files.file[target] = torn;
        const SlotChoice choice = newest_slot(files.file[0], files.file[1]);
        ASSERT_TRUE(choice.newest) << cut;
        const bool whole = torn == written;
        EXPECT_EQ(choice.newest->state, whole ? new_state : old_state) << cut << " " << rest;
        EXPECT_EQ(choice.write_to, whole ? 1 - target : target)
            << "the good one is not overwritten";
      }
  }
}

TEST(MemorySlot, EveryFlippedBitIsNoticed) {
  const Bytes good = encode_slot({7, state_of(50, 9)});
  std::string why;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Bytes bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decode_slot(bad, why)) << bit;
    EXPECT_FALSE(why.empty());
  }
  // Beside an intact older one it does not count.
  Bytes bad = good;
  bad[30] ^= 1;
  const SlotChoice choice = newest_slot(bad, encode_slot({6, {1}}));
  ASSERT_TRUE(choice.newest);
  EXPECT_EQ(choice.newest->sequence, 6u);
  EXPECT_EQ(choice.write_to, 0u);
  EXPECT_EQ(choice.why[0], "has a wrong checksum");
}

TEST(MemorySlot, DamageToBothIsToldAndHasNoDefault) {
  Bytes cut = encode_slot({3, {1, 2, 3}});
  cut.pop_back();
  const SlotChoice choice = newest_slot({}, cut);
  EXPECT_FALSE(choice.newest);
  EXPECT_EQ(choice.why[0], "is missing or empty");
  EXPECT_EQ(choice.why[1], "is cut off or half written");
  Bytes other(60, 'x');
  EXPECT_EQ(newest_slot(other, {}).why[0], "is not a memory slot");
}

// Any sequence of writes, any of them torn anywhere, then the next one whole.
TEST(MemorySlot, RandomTearsNeverGiveAMixture) {
  std::mt19937_64 random(5);
  Files files;
  Bytes last;
  for (int i = 0; i < 2000; ++i) {
    const Bytes state = state_of(random() % 300, static_cast<std::uint8_t>(i));
    const std::size_t target = files.older();
    const Bytes written = encode_slot({++files.sequence, state});
    const bool torn = random() % 3 == 0;
    files.file[target] = written;
    if (torn) files.file[target].resize(random() % written.size());
    const SlotChoice choice = newest_slot(files.file[0], files.file[1]);
    ASSERT_TRUE(choice.newest);
    if (!torn) last = state;
    ASSERT_EQ(choice.newest->state, last) << i;
  }
}

}  // namespace
}  // namespace vcnc::memory_slot_test
