#include "bus/wire_docs.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "bus/frame.hpp"

namespace vcnc::wire_docs_test {
namespace {

TEST(WireDocs, FieldsLieInsideTheirMessageWithoutOverlap) {
  std::set<std::string_view> names;
  for (const WireMessage& m : wire_messages()) {
    EXPECT_TRUE(names.insert(m.name).second) << m.name;
    EXPECT_TRUE(valid_length(m.length, m.fd)) << m.name;
    std::vector<std::string_view> owner(static_cast<std::size_t>(m.length));
    std::set<std::string_view> fields;
    for (const WireField& f : m.fields) {
      EXPECT_TRUE(fields.insert(f.name).second) << m.name << "." << f.name;
      EXPECT_GT(f.per_unit, 0);
      ASSERT_LE(f.offset + f.bytes, m.length) << m.name << "." << f.name;
      for (int b = f.offset; b < f.offset + f.bytes; ++b) {
        EXPECT_EQ(owner[static_cast<std::size_t>(b)], "") << m.name << "." << f.name;
        owner[static_cast<std::size_t>(b)] = f.name;
      }
    }
  }
  EXPECT_EQ(names.size(), 12u);
}

TEST(WireDocs, MarkdownNamesEveryField) {
  const std::string page = wire_table_markdown();
  for (const WireMessage& m : wire_messages()) {
    EXPECT_NE(page.find("## " + std::string(m.name) + " ("), std::string::npos);
    for (const WireField& f : m.fields)
      EXPECT_NE(page.find("| " + std::string(f.name) + " |"), std::string::npos) << f.name;
  }
  EXPECT_NE(page.find("| 4 | i48 | x_position | 1e-10 | m | -14073.7..14073.7 |"),
            std::string::npos);
}

TEST(WireDocs, DbcHasEveryFrameOnceAndMarksFd) {
  const std::string text = dbc();
  std::map<int, int> length_by_id;
  std::set<std::string> names;
  std::set<int> fd_ids, fast_ids;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword, name, object;
    int id = -1, number = -1;
    words >> keyword;
    if (keyword == "BO_" && words >> id >> name >> number) {
      EXPECT_TRUE(length_by_id.emplace(id, number).second) << line;
      EXPECT_TRUE(names.insert(name).second) << line;
    } else if (keyword == "BA_" && words >> name >> object >> id >> number) {
      if (name == "\"VFrameFormat\"" && number == 14) fd_ids.insert(id);
      if (name == "\"CANFD_BRS\"" && number == 1) fast_ids.insert(id);
    }
  }
  EXPECT_EQ(length_by_id.size(), 2u + 8 + 6 + 2 + 1 + 16 + 8 + 1);
  EXPECT_EQ(length_by_id.at(0x200), 64);
  EXPECT_EQ(length_by_id.at(0x187), 32);
  EXPECT_EQ(length_by_id.at(0x085), 8);

  EXPECT_EQ(fd_ids, (std::set<int>{0x181, 0x182, 0x183, 0x184, 0x185, 0x186, 0x187, 0x188, 0x200}));
  EXPECT_EQ(fast_ids, fd_ids);
  for (const char* attribute : {"BusType", "VFrameFormat", "CANFD_BRS"})
    EXPECT_NE(text.find("BA_DEF_DEF_ \"" + std::string(attribute) + "\""), std::string::npos);
  EXPECT_NE(text.find("SG_ x_position : 32|48@1- (1e-10,0) "), std::string::npos);
}

/// The page in docs/ is the generated one. `vcnc wire` prints it.
TEST(WireDocs, PageInDocsIsCurrent) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/docs/wire.md");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(text, wire_table_markdown());
}

}  // namespace
}  // namespace vcnc::wire_docs_test
