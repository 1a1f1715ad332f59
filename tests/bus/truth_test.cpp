#include "bus/truth.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/scratch.hpp"
#include "toy_machine.hpp"

namespace vcnc::truth_test {
namespace {

TruthCycle cycle(Tick k, std::size_t axis) {
  TruthCycle c{.tick = k};
  for (std::size_t i = 0; i < c.position.size(); ++i)
    c.position[i] =
        static_cast<double>(k) + 0.1 * static_cast<double>(axis) + 1e-12 * static_cast<double>(i);
  return c;
}

void publish_all(TruthPort& port, Tick k) {
  for (std::size_t axis = 0; axis < kTruthAxes; ++axis) port.publish(axis, cycle(k, axis));
}

void expect_cycle(TruthPort& port, Tick k) {
  std::array<TruthCycle, kTruthAxes> got;
  ASSERT_TRUE(port.collect(k, got)) << k;
  for (std::size_t axis = 0; axis < kTruthAxes; ++axis) {
    EXPECT_EQ(got[axis].tick, k);
    EXPECT_EQ(got[axis].position, cycle(k, axis).position);
  }
}

/// Both kinds, seen through the ports of drive and probe.
struct Channel {
  std::unique_ptr<TruthPort> probe, drive_owner;
  TruthPort* drive;
};

class Truth : public ::testing::TestWithParam<bool> {
 protected:
  Channel open() {
    Channel channel;
    if (GetParam()) {
      channel.probe = open_truth_reader(dir_ / "truth");
      channel.drive_owner = open_truth_writer(dir_ / "truth");
      channel.drive = channel.drive_owner.get();
    } else {
      channel.probe = open_local_truth();
      channel.drive = channel.probe.get();
    }
    return channel;
  }
  Scratch dir_;
};

TEST_P(Truth, CycleIsThereInTheNextOneWhoeverRunsFirst) {
  Channel channel = open();
  toy::Random random(4);
  publish_all(*channel.drive, 0);
  for (Tick k = 1; k < 500; ++k) {
    // In cycle k some drives run before the probe, others after it.
    const std::uint64_t first = random.next();
    for (std::size_t axis = 0; axis < kTruthAxes; ++axis)
      if (first >> axis & 1) channel.drive->publish(axis, cycle(k, axis));
    expect_cycle(*channel.probe, k - 1);
    for (std::size_t axis = 0; axis < kTruthAxes; ++axis)
      if (!(first >> axis & 1)) channel.drive->publish(axis, cycle(k, axis));
  }
  EXPECT_EQ(channel.drive->dropped(), 0u);
}

TEST_P(Truth, MissingAxisIsAnErrorAndNeverAnOldValue) {
  Channel channel = open();
  std::array<TruthCycle, kTruthAxes> got;
  EXPECT_FALSE(channel.probe->collect(-1, got));
  EXPECT_FALSE(channel.probe->collect(0, got));
  publish_all(*channel.drive, 6);
  for (std::size_t axis = 0; axis < kTruthAxes; ++axis)
    if (axis != 3) channel.drive->publish(axis, cycle(8, axis));
  EXPECT_FALSE(channel.probe->collect(8, got));
  channel.drive->publish(3, cycle(8, 3));
  expect_cycle(*channel.probe, 8);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Truth, ::testing::Bool(),
                         [](const auto& kind) { return kind.param ? "Socket" : "Local"; });

TEST(TruthSocket, AbsentReaderDoesNotHoldADrive) {
  Scratch dir;
  auto drive = open_truth_writer(dir / "truth");
  for (Tick k = 0; k < 100; ++k) drive->publish(0, cycle(k, 0));
  EXPECT_EQ(drive->dropped(), 100u);
}

TEST(TruthSocket, BlockedReaderDoesNotHoldADriveAndEveryLossIsCounted) {
  Scratch dir;
  auto probe = open_truth_reader(dir / "truth");
  auto drive = open_truth_writer(dir / "truth");
  for (Tick k = 0; k < 2000; ++k) publish_all(*drive, k);
  EXPECT_GT(drive->dropped(), 0u);
  EXPECT_LE(drive->dropped(), 5u * 2000 - 10);  // two cycles always fit
  std::array<TruthCycle, kTruthAxes> got;
  EXPECT_FALSE(probe->collect(1999, got));  // the oldest are kept, the newest are missing
  publish_all(*drive, 5000);
  expect_cycle(*probe, 5000);  // and it goes on
}

TEST(TruthSocket, WrongDatagramsAreCountedAndIgnored) {
  Scratch dir;
  auto probe = open_truth_reader(dir / "truth");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, (dir / "truth").c_str());
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  ASSERT_EQ(::sendto(fd, "hello", 5, 0, reinterpret_cast<sockaddr*>(&address), sizeof address), 5);
  ::close(fd);
  std::array<TruthCycle, kTruthAxes> got;
  EXPECT_FALSE(probe->collect(0, got));
  EXPECT_EQ(probe->dropped(), 1u);
}

TEST(TruthSocket, StaleFileOfAKilledRunIsReplacedAndTheFileIsRemovedAtTheEnd) {
  Scratch dir;
  const std::string path = dir / "truth";
  std::ofstream(path) << "left over";
  {
    auto probe = open_truth_reader(path);
    auto drive = open_truth_writer(path);
    publish_all(*drive, 1);
    expect_cycle(*probe, 1);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(TruthSocket, PathsThatCannotBeAreRefused) {
  EXPECT_THROW(open_truth_reader("/nowhere/at/all/truth"), TruthError);
  EXPECT_THROW(open_truth_reader(std::string(200, 'x')), TruthError);
  EXPECT_THROW(open_truth_writer(""), TruthError);
}

}  // namespace
}  // namespace vcnc::truth_test
