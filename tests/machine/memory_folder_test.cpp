#include "apps/memory_folder.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "apps/memory_content.hpp"
#include "model/input_error.hpp"
#include "servo_sim/spindle_node.hpp"
#include "tests/scratch.hpp"

namespace vcnc::memory_folder_test {
namespace {

namespace fs = std::filesystem;

class MemoryFolderTest : public testing::Test {
 protected:
  std::string path() const { return base_ / "memory"; }
  static void write(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
  }
  static std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::string refusal(const std::string& folder, bool create) {
    try {
      MemoryFolder(folder, create);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }

  const Scratch base_;
};

TEST_F(MemoryFolderTest, KeepsWhatWasSavedLast) {
  { MemoryFolder(path(), true); }
  const MemoryFolder again(path(), false);
  SlotFiles spindle(again.path(), "spindle");
  EXPECT_TRUE(spindle.load().empty()) << "new";
  for (int i = 0; i < 5; ++i) {
    spindle.save(encode_spindle_lock(i % 2 == 0));
    EXPECT_EQ(SlotFiles(again.path(), "spindle").load(), encode_spindle_lock(i % 2 == 0));
  }
  EXPECT_TRUE(read_content(again).spindle_locked);
  EXPECT_NE(to_text(read_content(again)).find("spindle      locked"), std::string::npos);
}

TEST_F(MemoryFolderTest, RefusesWhatIsNoMemoryAndASecondMachine) {
  EXPECT_NE(refusal(path(), false).find("is not a folder"), std::string::npos);
  fs::create_directory(path());
  EXPECT_NE(refusal(path(), false).find("is not the memory of a machine"), std::string::npos);
  write(base_ / "memory/letter.txt", "dear");
  EXPECT_NE(refusal(path(), true).find("holds other files"), std::string::npos);
  EXPECT_EQ(read(base_ / "memory/letter.txt"), "dear");
  fs::remove(base_ / "memory/letter.txt");
  write(base_ / "memory/nc.0", "half");  // the creation was interrupted: no machine ever used it
  const MemoryFolder one(path(), true);
  EXPECT_NE(refusal(path(), true).find("a machine is running"), std::string::npos);
  EXPECT_FALSE(read_content(one).nc);
}

// The file being written is torn at every byte; the state is the one before, and the next save is
// whole again.
TEST_F(MemoryFolderTest, ATornFileGivesTheStateBefore) {
  const MemoryFolder folder(path(), true);
  SlotFiles nc(folder.path(), "nc");
  const std::vector<std::uint8_t> one(40, 1), two(70, 2), three(55, 3);
  nc.save(one);  // nc.0
  nc.save(two);  // nc.1
  const std::string whole = read(base_ / "memory/nc.1");
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    write(base_ / "memory/nc.1", whole.substr(0, cut));
    ASSERT_EQ(nc.load(), one) << cut;
  }
  nc.save(three);
  EXPECT_EQ(nc.load(), three);
  EXPECT_EQ(SlotFiles(folder.path(), "spindle").load().size(), 0u) << "others are not touched";
}

TEST_F(MemoryFolderTest, DamageToBothNamesTheFilesAndTheWayOut) {
  const MemoryFolder folder(path(), true);
  write(base_ / "memory/spindle.0", "");
  write(base_ / "memory/spindle.1", std::string(60, 'x'));
  try {
    read_content(folder);
    FAIL() << "a machine that may be locked";
  } catch (const MemoryError& e) {
    const std::string text = e.what();
    for (const char* part :
         {"spindle.0 is missing or empty", "spindle.1 is not a memory slot", "vcnc reset"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  SlotFiles(folder.path(), "spindle").save(std::vector<std::uint8_t>{1, 7});
  EXPECT_THROW(read_content(folder), MemoryError) << "a state of another version";
}

}  // namespace
}  // namespace vcnc::memory_folder_test
