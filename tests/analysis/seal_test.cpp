#include "analysis/seal.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <iterator>

#include "analysis/recording.hpp"
#include "tests/scratch.hpp"

namespace vcnc::seal_test {
namespace {

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void put_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The bytes of a closed recording of 1200 rows.
std::string recorded(const Scratch& dir) {
  {
    RecordingWriter writer(dir / "original.h5", {"run", "part.nc", "", "", 1});
    TelemetryRow row;
    for (int k = 0; k < 1200; ++k) {
      row.tick = k;
      writer.row(row);
    }
    writer.finish({true, "program end", 1200, "ab", 1, 0.5, 0});
  }
  return bytes_of(dir / "original.h5");
}

/// What the reader says, or nothing.
std::string refusal(const std::filesystem::path& path) {
  try {
    RecordingReader(path).for_each([](const TelemetryRow&) {});
  } catch (const RecordingError& e) {
    return e.what();
  }
  return "";
}

// XXH3-128 of "abc" with seed 0: 06b05ab6733a618578af5f94892f3950 (computed by xxhsum -H2).
TEST(Seal, LayoutIsSizeHashAndMagic) {
  const Scratch dir;
  put_bytes(dir / "f", "abc");
  EXPECT_EQ(seal_of(dir / "f"), Seal::none);
  ASSERT_TRUE(put_seal(dir / "f"));
  EXPECT_EQ(bytes_of(dir / "f"), std::string("abc\x03\0\0\0\0\0\0\0", 11) +
                                     "\x06\xb0\x5a\xb6\x73\x3a\x61\x85\x78\xaf\x5f\x94\x89\x2f\x39"
                                     "\x50"
                                     "VCNCSEAL");
  EXPECT_EQ(seal_of(dir / "f"), Seal::intact);
  EXPECT_EQ(seal_of(dir / "none"), Seal::none);
}

TEST(Seal, EveryChangedByteOfAFileIsNoticed) {
  const Scratch dir;
  put_bytes(dir / "f", "some content of a file");
  ASSERT_TRUE(put_seal(dir / "f"));
  const std::string sealed = bytes_of(dir / "f");
  for (std::size_t i = 0; i < sealed.size(); ++i) {
    std::string changed = sealed;
    changed[i] = static_cast<char>(changed[i] ^ 0x10);
    put_bytes(dir / "f", changed);
    EXPECT_NE(seal_of(dir / "f"), Seal::intact) << i;
  }
}

TEST(Recording, ChangedAfterItWasClosedIsRefused) {
  const Scratch dir;
  const std::string bytes = recorded(dir);
  EXPECT_EQ(refusal(dir / "original.h5"), "");
  for (const std::size_t at : {std::size_t{30}, std::size_t{700}, bytes.size() / 2}) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] + 1);
    put_bytes(dir / "changed.h5", changed);
    EXPECT_NE(refusal(dir / "changed.h5").find("was changed after it was closed"),
              std::string::npos);
  }
}

// As another HDF5 tool leaves it; also files of earlier versions.
TEST(Recording, WithoutASealOpensAndSaysSo) {
  const Scratch dir;
  const std::string bytes = recorded(dir);
  put_bytes(dir / "plain.h5", bytes.substr(0, bytes.size() - 32));
  const RecordingReader reader(dir / "plain.h5");
  EXPECT_EQ(reader.rows(), 1200u);
  EXPECT_EQ(reader.missing(), std::vector<std::string>{"seal"});
}

// Damage in a file without a seal, such as an interrupted recording after a power loss: the HDF5
// library may do anything with it, but this process goes on with a sentence or with the rows.
TEST(Recording, DamageWithoutASealNeverTakesTheProcessDown) {
  const Scratch dir;
  std::string bytes = recorded(dir);
  bytes.resize(bytes.size() - 32);
  std::uint64_t random = 5;
  const auto next = [&] {
    random = random * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::size_t>(random >> 33);
  };
  int refused = 0;
  for (int i = 0; i < 30; ++i) {
    std::string damaged = bytes;
    // Structures lie at the begin and behind the first block of rows; rows themselves carry none.
    for (int n = 0; n < 3; ++n) damaged[next() % 9000] = static_cast<char>(next());
    put_bytes(dir / "damaged.h5", damaged);
    refused += refusal(dir / "damaged.h5").empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

TEST(Recording, CutOffIsRefusedInOneSentence) {
  const Scratch dir;
  const std::string bytes = recorded(dir);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{100}, std::size_t{5000}, bytes.size() / 2}) {
    put_bytes(dir / "cut.h5", bytes.substr(0, size));
    const std::string said = refusal(dir / "cut.h5");
    EXPECT_TRUE(said.find("damaged") != said.npos || said.find("not an HDF5 file") != said.npos)
        << said;
  }
}

}  // namespace
}  // namespace vcnc::seal_test
