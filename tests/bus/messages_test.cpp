#include "bus/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <type_traits>

#include "toy_machine.hpp"

namespace vcnc::messages_test {
namespace {

using Bytes = std::vector<int>;

Bytes bytes_of(const Frame& frame) { return {frame.payload().begin(), frame.payload().end()}; }

// ------------------------------------------------------------------ golden bytes
TEST(Messages, GoldenBytesOfNetworkManagement) {
  const Frame nmt = encode(Nmt{NmtCommand::reset_comm, 5});
  EXPECT_EQ(nmt.id, 0x000);
  EXPECT_FALSE(nmt.fd);
  EXPECT_EQ(bytes_of(nmt), (Bytes{0x82, 5}));
  const Frame sync = encode(Sync{240});
  EXPECT_EQ(sync.id, 0x080);
  EXPECT_EQ(bytes_of(sync), (Bytes{0xf0}));
  const Frame heartbeat = encode(Heartbeat{8, NmtState::pre_operational});
  EXPECT_EQ(heartbeat.id, 0x708);
  EXPECT_EQ(bytes_of(heartbeat), (Bytes{0x7f}));
  const Frame emergency = encode(Emergency{3, 0x8611, 0x21, {1, 2, 3, 4, 5}});
  EXPECT_EQ(emergency.id, 0x083);
  EXPECT_FALSE(emergency.fd);
  EXPECT_EQ(bytes_of(emergency), (Bytes{0x11, 0x86, 0x21, 1, 2, 3, 4, 5}));
}

TEST(Messages, GoldenBytesOfGroupCommand) {
  GroupCommand m;
  m.tick = 0x1234;
  m.controlword = 0x000f;
  m.axes[0] = {0.1, -0.02};      // 1e9 counts, -2e6 counts
  m.axes[1] = {-1e-10, 1e-8};    // -1, 1
  m.axes[4] = {0, 21.47483647};  // the largest velocity
  m.spindle_mode = GroupCommand::SpindleMode::orient;
  m.flags = kResetLatch;
  m.spindle_speed = -1;  // -1e5
  const Frame frame = encode(m);
  EXPECT_EQ(frame.id, 0x200);
  EXPECT_TRUE(frame.fd);
  Bytes expected(64, 0);
  const auto put = [&](std::size_t offset, const Bytes& part) {
    std::copy(part.begin(), part.end(), expected.begin() + static_cast<std::ptrdiff_t>(offset));
  };
  put(0, {0x34, 0x12, 0x0f, 0x00});
  put(4, {0x00, 0xca, 0x9a, 0x3b, 0x00, 0x00, 0x80, 0x7b, 0xe1, 0xff});
  put(14, {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01, 0x00, 0x00, 0x00});
  put(50, {0xff, 0xff, 0xff, 0x7f});
  put(54, {3, 2, 0x60, 0x79, 0xfe, 0xff});
  EXPECT_EQ(bytes_of(frame), expected);
}

TEST(Messages, GoldenBytesOfAnswers) {
  const Frame axis = encode(DriveStatus{2, 0xabcd, 0x1237, 0.0256, -1e-6, 0.5});
  EXPECT_EQ(axis.id, 0x182);
  EXPECT_EQ(bytes_of(axis), (Bytes{0xcd, 0xab, 0x37, 0x12, 0x00, 0x40, 0x42, 0x0f, 0x00, 0x00, 0xf0,
                                   0xd8, 0xff, 0xff, 0x88, 0x13}));
  // The spindle's second value is a speed, in 1e-5 rad/s.
  const Frame spindle = encode(DriveStatus{kSpindleNode, 1, 2, 1e-10, 100.0, -1});
  EXPECT_EQ(spindle.id, 0x186);
  EXPECT_EQ(bytes_of(spindle),
            (Bytes{1, 0, 2, 0, 1, 0, 0, 0, 0, 0, 0x80, 0x96, 0x98, 0x00, 0xf0, 0xd8}));

  const Frame probe =
      encode(ProbeSample{7, ProbeSample::kSlip, {1e-10, -1e-10, 0.018}, {1, 2, 3, 4, 5, 65535}});
  EXPECT_EQ(probe.id, 0x187);
  EXPECT_EQ(bytes_of(probe),
            (Bytes{7, 0, 4, 0, 1, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0x00, 0x95, 0xba, 0x0a,
                   1, 0, 2, 0, 3, 0, 4, 0, 5,    0,    0xff, 0xff, 0,    0,    0,    0}));

  const Frame overtravel = encode(
      OvertravelState{258, OvertravelState::State::hard, OvertravelState::Cause::signal, 1e-4});
  EXPECT_EQ(overtravel.id, 0x188);
  EXPECT_EQ(bytes_of(overtravel), (Bytes{2, 1, 3, 3, 0x40, 0x42, 0x0f, 0}));
}

// ------------------------------------------------------------------ contract of every codec
/// A codec as the contract tests see it: frames of random messages, and what decoding gives back.
struct Codec {
  std::string name;
  std::function<Frame(toy::Random&)> random_frame;
  std::function<std::optional<Frame>(const Frame&)> reencode;  ///< decode, then encode
};

template <class M>
std::function<std::optional<Frame>(const Frame&)> reencoder(
    std::optional<M> (*decode)(const Frame&)) {
  return [decode](const Frame& frame) -> std::optional<Frame> {
    const auto message = decode(frame);
    return message ? std::optional(encode(*message)) : std::nullopt;
  };
}

template <class T>
T pick(toy::Random& r, std::initializer_list<T> values) {
  return *(values.begin() + r.next() % values.size());
}
std::uint16_t word(toy::Random& r) { return static_cast<std::uint16_t>(r.next()); }
std::uint8_t byte(toy::Random& r, std::uint64_t limit = 256) {
  return static_cast<std::uint8_t>(r.next() % limit);
}
int node(toy::Random& r, std::uint64_t last) { return static_cast<int>(r.next() % last) + 1; }

std::vector<Codec> codecs() {
  return {
      {"nmt",
       [](toy::Random& r) {
         return encode(Nmt{pick(r, {NmtCommand::start, NmtCommand::stop, NmtCommand::preop,
                                    NmtCommand::reset_node, NmtCommand::reset_comm}),
                           byte(r)});
       },
       reencoder(decode_nmt)},
      {"sync",
       [](toy::Random& r) { return encode(Sync{static_cast<std::uint8_t>(1 + r.next() % 240)}); },
       reencoder(decode_sync)},
      {"heartbeat",
       [](toy::Random& r) {
         return encode(
             Heartbeat{node(r, 127), pick(r, {NmtState::boot_up, NmtState::stopped,
                                              NmtState::operational, NmtState::pre_operational})});
       },
       reencoder(decode_heartbeat)},
      {"emergency",
       [](toy::Random& r) {
         return encode(Emergency{
             node(r, 127), word(r), byte(r), {byte(r), byte(r), byte(r), byte(r), byte(r)}});
       },
       reencoder(decode_emergency)},
      {"group command",
       [](toy::Random& r) {
         GroupCommand m;
         m.tick = word(r);
         m.controlword = word(r);
         for (auto& axis : m.axes) axis = {r.unit() * 14000, r.unit() * 21};
         m.spindle_mode = static_cast<GroupCommand::SpindleMode>(byte(r, 4));
         m.flags = byte(r);
         m.spindle_speed = r.unit() * 20000;
         return encode(m);
       },
       reencoder(decode_group_command)},
      {"drive status",
       [](toy::Random& r) {
         return encode(DriveStatus{node(r, 6), word(r), word(r), r.unit() * 10, r.unit() * 0.2,
                                   r.unit() * 3.2});
       },
       reencoder(decode_drive_status)},
      {"probe sample",
       [](toy::Random& r) {
         return encode(ProbeSample{word(r),
                                   word(r),
                                   {r.unit() * 0.02, r.unit() * 0.02, r.unit() * 0.005},
                                   {word(r), word(r), word(r), word(r), word(r), word(r)}});
       },
       reencoder(decode_probe_sample)},
      {"overtravel state",
       [](toy::Random& r) {
         return encode(OvertravelState{word(r), static_cast<OvertravelState::State>(byte(r, 3)),
                                       static_cast<OvertravelState::Cause>(byte(r, 5)),
                                       r.unit() * 0.02});
       },
       reencoder(decode_overtravel_state)},
  };
}

TEST(MessagesContract, RoundTripKeepsEveryBit) {
  for (const Codec& codec : codecs()) {
    toy::Random random(42);
    for (int i = 0; i < 3000; ++i) {
      const Frame frame = codec.random_frame(random);
      ASSERT_TRUE(valid_length(frame.len, frame.fd)) << codec.name;
      const auto again = codec.reencode(frame);
      ASSERT_TRUE(again.has_value()) << codec.name;
      ASSERT_EQ(*again, frame) << codec.name;
    }
  }
}

TEST(MessagesContract, EveryOtherLengthIsRefused) {
  for (const Codec& codec : codecs()) {
    toy::Random random(7);
    const Frame good = codec.random_frame(random);
    for (int len = 0; len <= 64; ++len) {
      Frame frame = good;
      frame.len = static_cast<std::uint8_t>(len);
      EXPECT_EQ(codec.reencode(frame).has_value(), len == good.len) << codec.name << " " << len;
    }
  }
}

TEST(MessagesContract, EveryIdentifierBelongsToOneCodecAtMost) {
  const auto all = codecs();
  for (const Codec& codec : all) {
    toy::Random random(3);
    const Frame good = codec.random_frame(random);
    int accepted = 0;
    for (int id = 0; id < 2048; ++id) {
      Frame frame = good;
      frame.id = static_cast<std::uint16_t>(id);
      if (!codec.reencode(frame)) continue;
      ++accepted;
      for (const Codec& other : all) {
        EXPECT_TRUE(other.name == codec.name || !other.reencode(frame)) << codec.name << " " << id;
      }
    }
    EXPECT_GE(accepted, 1) << codec.name;
    EXPECT_LE(accepted, 127) << codec.name;
  }
}

TEST(MessagesContract, RandomBytesNeverDecodeToSomethingElse) {
  for (const Codec& codec : codecs()) {
    toy::Random random(11);
    Frame frame = codec.random_frame(random);
    for (int i = 0; i < 2000; ++i) {
      for (auto& b : frame.data) b = byte(random);
      // Reserved bytes aside, what is accepted says the same when it is encoded again.
      const auto once = codec.reencode(frame);
      EXPECT_TRUE(!once || codec.reencode(*once) == once) << codec.name;
    }
  }
}

TEST(MessagesContract, NotANumberStaysVisible) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  GroupCommand command;
  command.axes[2] = {kNan, kNan};
  command.axes[3] = {1.5, 0};
  const auto got = decode_group_command(encode(command));
  ASSERT_TRUE(got);
  EXPECT_TRUE(std::isnan(got->axes[2].position));
  EXPECT_TRUE(std::isnan(got->axes[2].velocity));
  EXPECT_DOUBLE_EQ(got->axes[3].position, 1.5);
  const auto status = decode_drive_status(encode(DriveStatus{1, 0, 0, kNan, 0.1, kNan}));
  EXPECT_TRUE(std::isnan(status->position));
  EXPECT_DOUBLE_EQ(status->second_encoder, 0.1);
  EXPECT_TRUE(std::isnan(status->force));
  EXPECT_TRUE(
      std::isnan(decode_overtravel_state(encode(OvertravelState{.deflection = kNan}))->deflection));
}

TEST(MessagesContract, SaturatesSymmetrically) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double huge : {1e6, 1e300, infinity}) {
    const auto up = decode_drive_status(encode(DriveStatus{1, 0, 0, huge, huge, huge}));
    EXPECT_DOUBLE_EQ(up->position, 14073.7488355327);
    EXPECT_DOUBLE_EQ(up->second_encoder, 0.2147483647);
    EXPECT_DOUBLE_EQ(up->force, 3.2767);
    const auto down = decode_drive_status(encode(DriveStatus{1, 0, 0, -huge, -huge, -huge}));
    EXPECT_DOUBLE_EQ(down->position, -14073.7488355327);
    EXPECT_DOUBLE_EQ(down->second_encoder, -0.2147483647);
    EXPECT_DOUBLE_EQ(down->force, -3.2767);
  }
  EXPECT_EQ(encode(Heartbeat{500, NmtState::operational}).id, 0x77f);
  EXPECT_EQ(encode(DriveStatus{.node = -4}).id, 0x181);
}

TEST(Messages, RoundsToTheNearestCount) {
  toy::Random random(5);
  for (int i = 0; i < 3000; ++i) {
    const double position = random.unit(), velocity = random.unit();
    GroupCommand m;
    m.axes[1] = {position, velocity};
    const auto got = decode_group_command(encode(m));
    EXPECT_LE(std::abs(got->axes[1].position - position), 0.5001e-10);
    EXPECT_LE(std::abs(got->axes[1].velocity - velocity), 0.5001e-8);
  }
}

TEST(Messages, MeaninglessCodesAreRefused) {
  Frame nmt = encode(Nmt{});
  nmt.data[0] = 0x03;
  EXPECT_FALSE(decode_nmt(nmt));
  Frame sync = encode(Sync{});
  sync.data[0] = 0;
  EXPECT_FALSE(decode_sync(sync));
  sync.data[0] = 241;
  EXPECT_FALSE(decode_sync(sync));
  Frame heartbeat = encode(Heartbeat{1});
  heartbeat.data[0] = 1;
  EXPECT_FALSE(decode_heartbeat(heartbeat));
  Frame command = encode(GroupCommand{});
  command.data[54] = 4;
  EXPECT_FALSE(decode_group_command(command));
  Frame overtravel = encode(OvertravelState{});
  overtravel.data[2] = 4;
  EXPECT_FALSE(decode_overtravel_state(overtravel));
  overtravel.data[2] = 0;
  overtravel.data[3] = 8;
  EXPECT_FALSE(decode_overtravel_state(overtravel));
}

TEST(Messages, SyncCounterRunsFrom1To240) {
  EXPECT_EQ(sync_counter(0), 1);
  EXPECT_EQ(sync_counter(239), 240);
  EXPECT_EQ(sync_counter(240), 1);
  EXPECT_EQ(low16(65536 + 7), 7);
}

}  // namespace
}  // namespace vcnc::messages_test
