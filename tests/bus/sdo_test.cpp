// SDO: the server against the bytes of CiA 301, the client against the server.
#include <gtest/gtest.h>

#include "bus/messages.hpp"
#include "bus/sdo_client.hpp"
#include "bus/sdo_server.hpp"
#include "toy_machine.hpp"

namespace vcnc::sdo_test {
namespace {

using Bytes8 = std::array<std::uint8_t, 8>;

/// A dictionary with one object of each kind behind a server.
struct Bench {
  std::int64_t speed = -2;
  std::string note = "hello";
  bool locked = false;
  ObjectDictionary objects;
  SdoServer server{5, objects};

  Bench() {
    using enum ObjectAccess;
    using enum ObjectType;
    objects.add({0x1000, 0, "Device type", u32, constant, "", [] { return 0x00020192; }});
    objects.add({0x1001, 0, "Error register", u8, read_only, "", [] { return 0x11; }});
    objects.record(0x1018, "Identity");
    objects.add({0x1018, 1, "Vendor", u32, constant, "", [] { return 0x76636e63; }});
    objects.add({0x1018, 4, "Serial", u32, constant, "", [] { return 5; }});
    objects.add({.index = 0x1008,
                 .name = "Name",
                 .type = text,
                 .access = constant,
                 .unit = "",
                 .get_text = [] { return "vcnc drive X, eight"; }});
    objects.add({.index = 0x2000,
                 .name = "Note",
                 .type = text,
                 .access = read_write,
                 .unit = "",
                 .get_text = [this] { return note; },
                 .set_text =
                     [this](const std::string& t) {
                       note = t;
                       return SdoAbort::none;
                     }});
    objects.add({0x2001, 0, "Cycles", u64, read_only, "", [] { return 0x0102030405060708; }});
    objects.add({0x2002, 0, "Speed", i16, read_write, "", [this] { return speed; },
                 [this](std::int64_t v) {
                   if (locked) return SdoAbort::device_state;
                   if (v == 7) return SdoAbort::value;
                   speed = v;
                   return SdoAbort::none;
                 },
                 -100, 1000});
    objects.add({0x2003, 0, "Long", i64, read_write, "", [this] { return speed; },
                 [this](std::int64_t v) {
                   speed = v;
                   return SdoAbort::none;
                 }});
  }

  static Frame request(const Bytes8& bytes) {
    Frame frame;
    frame.id = 0x605;
    frame.len = 8;
    std::copy(bytes.begin(), bytes.end(), frame.data.begin());
    return frame;
  }
  /// Eight bytes of the answer; empty: none.
  std::vector<int> ask(const Bytes8& bytes, Tick k = 0) {
    const auto answer = server.serve(request(bytes), k);
    if (!answer) return {};
    EXPECT_EQ(answer->id, 0x585);
    EXPECT_EQ(answer->len, 8);
    EXPECT_FALSE(answer->fd);
    return {answer->data.begin(), answer->data.begin() + 8};
  }
  /// The code of an abort; 0: the answer is none.
  std::uint32_t abort_of(const Bytes8& bytes) {
    const auto answer = ask(bytes);
    if (answer.empty() || answer[0] != 0x80) return 0;
    return static_cast<std::uint32_t>(answer[4] | answer[5] << 8 | answer[6] << 16) |
           static_cast<std::uint32_t>(answer[7]) << 24;
  }
};

using Ints = std::vector<int>;

TEST(SdoServer, UploadsExpedited) {
  Bench b;
  EXPECT_EQ(b.ask({0x40, 0x00, 0x10, 0}), (Ints{0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00}));
  EXPECT_EQ(b.ask({0x40, 0x01, 0x10, 0}), (Ints{0x4f, 0x01, 0x10, 0, 0x11, 0, 0, 0}));
  EXPECT_EQ(b.ask({0x40, 0x02, 0x20, 0}), (Ints{0x4b, 0x02, 0x20, 0, 0xfe, 0xff, 0, 0}));
  EXPECT_EQ(b.ask({0x40, 0x18, 0x10, 0}), (Ints{0x4f, 0x18, 0x10, 0, 4, 0, 0, 0}))
      << "sub-index 0: the highest";
}

TEST(SdoServer, UploadsInSegments) {
  Bench b;
  EXPECT_EQ(b.ask({0x40, 0x08, 0x10, 0}), (Ints{0x41, 0x08, 0x10, 0, 19, 0, 0, 0}));
  EXPECT_EQ(b.ask({0x60}), (Ints{0x00, 'v', 'c', 'n', 'c', ' ', 'd', 'r'}));
  EXPECT_EQ(b.ask({0x70}), (Ints{0x10, 'i', 'v', 'e', ' ', 'X', ',', ' '}));
  EXPECT_EQ(b.ask({0x60}), (Ints{0x05, 'e', 'i', 'g', 'h', 't', 0, 0}));
  EXPECT_EQ(b.abort_of({0x70}), 0x05040001u) << "the transfer is over";
  EXPECT_EQ(b.ask({0x40, 0x01, 0x20, 0}), (Ints{0x41, 0x01, 0x20, 0, 8, 0, 0, 0}));
  EXPECT_EQ(b.ask({0x60}), (Ints{0x00, 8, 7, 6, 5, 4, 3, 2}));
  EXPECT_EQ(b.ask({0x70}), (Ints{0x1d, 1, 0, 0, 0, 0, 0, 0}));
}

TEST(SdoServer, DownloadsExpedited) {
  Bench b;
  EXPECT_EQ(b.ask({0x2b, 0x02, 0x20, 0, 0x34, 0x01}), (Ints{0x60, 0x02, 0x20, 0, 0, 0, 0, 0}));
  EXPECT_EQ(b.speed, 0x134);
  EXPECT_EQ(b.ask({0x22, 0x02, 0x20, 0, 0x9c, 0xff, 0xaa, 0xaa}),
            (Ints{0x60, 0x02, 0x20, 0, 0, 0, 0, 0}))
      << "without a size the object's own counts";
  EXPECT_EQ(b.speed, -100);
}

TEST(SdoServer, DownloadsInSegments) {
  Bench b;
  EXPECT_EQ(b.ask({0x21, 0x00, 0x20, 0, 9}), (Ints{0x60, 0x00, 0x20, 0, 0, 0, 0, 0}));
  EXPECT_EQ(b.ask({0x00, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}), (Ints{0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(b.note, "hello") << "not before the last segment";
  EXPECT_EQ(b.ask({0x1b, 'h', 'i'}), (Ints{0x30, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(b.note, "abcdefghi");
}

TEST(SdoServer, RefusesByTheRightCode) {
  Bench b;
  EXPECT_EQ(b.abort_of({0x40, 0x34, 0x12, 0}), 0x06020000u);
  EXPECT_EQ(b.abort_of({0x40, 0x00, 0x10, 1}), 0x06090011u);
  EXPECT_EQ(b.abort_of({0x40, 0x18, 0x10, 3}), 0x06090011u);
  EXPECT_EQ(b.abort_of({0x23, 0x00, 0x10, 0, 1, 2, 3, 4}), 0x06010002u);
  EXPECT_EQ(b.abort_of({0x23, 0x34, 0x12, 0, 1, 2, 3, 4}), 0x06020000u);
  EXPECT_EQ(b.abort_of({0x23, 0x02, 0x20, 0, 1, 2, 3, 4}), 0x06070012u);
  EXPECT_EQ(b.abort_of({0x2f, 0x02, 0x20, 0, 1}), 0x06070013u);
  EXPECT_EQ(b.abort_of({0x2b, 0x02, 0x20, 0, 0xe9, 0x03}), 0x06090031u) << "1001";
  EXPECT_EQ(b.abort_of({0x2b, 0x02, 0x20, 0, 0x9b, 0xff}), 0x06090032u) << "-101";
  EXPECT_EQ(b.abort_of({0x2b, 0x02, 0x20, 0, 7, 0}), 0x06090030u);
  b.locked = true;
  EXPECT_EQ(b.abort_of({0x2b, 0x02, 0x20, 0, 8, 0}), 0x08000022u);
  EXPECT_EQ(b.speed, -2) << "nothing of it was written";
  EXPECT_EQ(b.abort_of({0xa0, 0x00, 0x10, 0}), 0x05040001u) << "block upload";
  EXPECT_EQ(b.abort_of({0xc0, 0x00, 0x20, 0}), 0x05040001u) << "block download";
  EXPECT_EQ(b.abort_of({0x00, 1, 2}), 0x05040001u) << "a segment out of nowhere";
  EXPECT_EQ(b.abort_of({0x21, 0x00, 0x20, 0, 65}), 0x06070012u) << "longer than a text may be";
  EXPECT_EQ(b.abort_of({0x27, 0x00, 0x20, 0, 'a', 7, 'b'}), 0x06090030u) << "not printable";
  EXPECT_EQ(b.ask({0x40, 0x34, 0x12, 9}), (Ints{0x80, 0x34, 0x12, 9, 0, 0, 0x02, 0x06}));
}

TEST(SdoServer, BreaksOffAtAWrongToggleBitAndAWrongLength) {
  Bench b;
  b.ask({0x40, 0x08, 0x10, 0});
  b.ask({0x60});
  EXPECT_EQ(b.ask({0x60}), (Ints{0x80, 0x08, 0x10, 0, 0, 0, 0x03, 0x05}));
  EXPECT_FALSE(b.server.transferring());
  b.ask({0x21, 0x00, 0x20, 0, 9});
  EXPECT_EQ(b.abort_of({0x10, 'a'}), 0x05030000u);
  b.ask({0x21, 0x00, 0x20, 0, 9});
  EXPECT_EQ(b.abort_of({0x0d, 'a'}), 0x06070010u) << "the last one too soon";
  b.ask({0x21, 0x00, 0x20, 0, 3});
  EXPECT_EQ(b.abort_of({0x00, 'a', 'b', 'c', 'd'}), 0x06070012u) << "more than announced";
  EXPECT_EQ(b.note, "hello");
}

TEST(SdoServer, EndsATransferWhoseClientAbortsOrGoes) {
  Bench b;
  b.ask({0x40, 0x08, 0x10, 0}, 10);
  EXPECT_EQ(b.ask({0x80, 0x08, 0x10, 0}), Ints{}) << "an abort is not answered";
  EXPECT_FALSE(b.server.transferring());
  b.ask({0x40, 0x08, 0x10, 0}, 10);
  EXPECT_FALSE(b.server.expire(10 + SdoServer::kTimeout - 1));
  const auto abort = b.server.expire(10 + SdoServer::kTimeout);
  ASSERT_TRUE(abort);
  EXPECT_EQ(abort->id, 0x585);
  EXPECT_EQ(Ints(abort->data.begin(), abort->data.begin() + 8),
            (Ints{0x80, 0x08, 0x10, 0, 0, 0, 0x04, 0x05}));
  EXPECT_FALSE(b.server.expire(5000));
}

TEST(SdoServer, OverlooksWhatIsNoRequestToIt) {
  Bench b;
  Frame frame = Bench::request({0x40, 0x00, 0x10, 0});
  frame.id = 0x606;
  EXPECT_FALSE(b.server.serve(frame));
  frame.id = 0x605;
  frame.len = 7;
  EXPECT_FALSE(b.server.serve(frame));
}

/// Plays a client against a server to the end.
void play(SdoClient& client, SdoServer& server, Frame request) {
  for (int frames = 0; frames < 100; ++frames) {
    const auto answer = server.serve(request);
    ASSERT_TRUE(answer);
    const auto next = client.feed(*answer);
    if (!next) break;
    request = *next;
  }
  EXPECT_TRUE(client.done());
}

TEST(SdoClient, ReadsAndWritesEveryLength) {
  Bench b;
  SdoClient client(5);
  for (std::size_t length = 0; length <= ObjectDictionary::kLongestText; ++length) {
    std::string text;
    for (std::size_t i = 0; i < length; ++i) text += static_cast<char>('a' + i % 26);
    play(client, b.server, client.download(0x2000, 0, {text.begin(), text.end()}));
    EXPECT_EQ(client.aborted(), SdoAbort::none) << length;
    EXPECT_EQ(b.note, text);
    play(client, b.server, client.upload(0x2000, 0));
    EXPECT_EQ(std::string(client.bytes().begin(), client.bytes().end()), text);
  }
  play(client, b.server, client.upload(0x1000, 0));
  EXPECT_EQ(client.number(), 0x00020192u);
  play(client, b.server, client.download(0x2003, 0, {1, 2, 3, 4, 5, 6, 7, 0xff}));
  EXPECT_EQ(b.speed, static_cast<std::int64_t>(0xff07060504030201));
}

TEST(SdoClient, SaysWhyItWasRefused) {
  Bench b;
  SdoClient client(5);
  play(client, b.server, client.upload(0x1234, 0));
  EXPECT_EQ(client.aborted(), SdoAbort::no_object);
  play(client, b.server, client.download(0x1000, 0, {1, 2, 3, 4}));
  EXPECT_EQ(client.aborted(), SdoAbort::read_only);
}

TEST(SdoClient, BreaksOffWhenTheServerTalksNonsense) {
  SdoClient client(5);
  client.upload(0x1000, 0);
  EXPECT_FALSE(client.feed(encode_sdo_answer({.node = 6, .command = 0x43, .index = 0x1000})));
  EXPECT_FALSE(client.done()) << "of another node";
  const auto abort = client.feed(encode_sdo_answer({.node = 5, .command = 0x43, .index = 0x1001}));
  ASSERT_TRUE(abort);
  EXPECT_EQ(abort->id, 0x605);
  EXPECT_EQ(abort->data[0], 0x80);
  EXPECT_TRUE(client.done());
  EXPECT_EQ(client.aborted(), SdoAbort::command);
}

/// 10^5 requests, half of them near something valid.
TEST(SdoServer, AnyFramesMeetAtMostOneWellFormedAnswerAndLeaveItUsable) {
  toy::Random random(2026);
  Bench b;
  constexpr std::array<std::uint16_t, 8> kIndices{0x1000, 0x1001, 0x1018, 0x1008,
                                                  0x2000, 0x2001, 0x2002, 0x2003};
  constexpr std::array<std::uint8_t, 12> kCommands{0x40, 0x60, 0x70, 0x21, 0x23, 0x2b,
                                                   0x2f, 0x00, 0x10, 0x01, 0x80, 0x0d};
  int answers = 0, aborts = 0;
  for (Tick k = 0; k < 100000; ++k) {
    Bytes8 bytes{};
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    if (random.next() % 2 == 0) {
      bytes[0] = kCommands[random.next() % kCommands.size()];
      const std::uint16_t index = kIndices[random.next() % kIndices.size()];
      bytes[1] = static_cast<std::uint8_t>(index);
      bytes[2] = static_cast<std::uint8_t>(index >> 8);
      bytes[3] = static_cast<std::uint8_t>(random.next() % 8 == 0 ? random.next() % 3 : 0);
      bytes[4] = static_cast<std::uint8_t>(random.next() % 12);
      for (std::size_t i = 5; i < 8; ++i) bytes[i] = 0;
    }
    Frame frame = Bench::request(bytes);
    if (random.next() % 64 == 0) frame.len = static_cast<std::uint8_t>(random.next() % 8);
    const bool counts = frame.len == 8 && bytes[0] >> 5 != 4;
    const auto answer = b.server.serve(frame, k);
    ASSERT_EQ(answer.has_value(), counts) << k;
    if (!answer) continue;
    ++answers;
    ASSERT_EQ(answer->id, 0x585);
    ASSERT_EQ(answer->len, 8);
    const int specifier = answer->data[0] >> 5;
    ASSERT_TRUE(specifier <= 4) << specifier;
    if (specifier == 4) {
      ++aborts;
      const auto m = *decode_sdo_answer(*answer);
      const auto code =
          static_cast<SdoAbort>(m.data[0] | m.data[1] << 8 | m.data[2] << 16 | m.data[3] << 24);
      ASSERT_NE(text_of(code), "unknown abort code") << k;
      ASSERT_EQ(answer->data[0], 0x80);
      ASSERT_FALSE(b.server.transferring());
    }
    ASSERT_LE(b.note.size(), ObjectDictionary::kLongestText);
    if (k % 1000 == 0) {
      SdoClient client(5);
      play(client, b.server, client.upload(0x1008, 0));
      ASSERT_EQ(client.bytes().size(), 19u);
    }
  }
  EXPECT_GT(aborts, 10000);
  EXPECT_GT(answers - aborts, 4000);
}

TEST(ObjectDictionary, RefusesAMistakenTable) {
  Bench b;
  EXPECT_THROW(b.objects.add({0x1000, 0, "Again", ObjectType::u8, ObjectAccess::constant, "",
                              [] { return 0; }}),
               std::logic_error);
  EXPECT_THROW(b.objects.add({0x3000, 1, "Orphan", ObjectType::u8, ObjectAccess::constant, "",
                              [] { return 0; }}),
               std::logic_error);
  EXPECT_THROW(b.objects.add({0x3000, 0, "Unreadable", ObjectType::u8, ObjectAccess::constant, ""}),
               std::logic_error);
  EXPECT_THROW(b.objects.add({0x3000, 0, "Unwritable", ObjectType::u8, ObjectAccess::read_write, "",
                              [] { return 0; }}),
               std::logic_error);
}

}  // namespace
}  // namespace vcnc::sdo_test
