#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "bus/dds/dds_publisher.hpp"
#include "bus/dds/dds_subscriber.hpp"

namespace vcnc::dds_test {
namespace {

const RunBegin kBegin{"run-7", "part.nc", "name = \"machine\"", "name = \"piece\"", 99};

TelemetryRow numbered(std::int64_t k) {
  TelemetryRow row;
  row.tick = static_cast<double>(k);
  row.q_cmd[4] = 1e-3 * static_cast<double>(k);
  row.bus_load = 0.5;
  return row;
}

RunEnd complete_end(std::int64_t cycles) {
  RunEnd end;
  end.complete = true;
  end.reason = "program end";
  end.cycles = cycles;
  end.trace_hash = "cafe";
  end.wall_seconds = 2;
  end.bus_load_worst = 0.7;
  end.gaps = 1;
  return end;
}

/// Keeps what happened, in order.
class Collector : public TelemetrySink {
 public:
  void begin(const RunBegin& b) override { begins.push_back(b); }
  void row(const TelemetryRow& r) override {
    rows.push_back(r);
    ++received;
    if (delay_every > 0 && rows.size() % delay_every == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void alarm(const Alarm& a) override { alarms.emplace_back(rows.size(), a); }
  void end(const RunEnd& e) override { ends.push_back(e); }

  std::size_t delay_every = 0;
  std::atomic<int> received = 0;
  std::vector<RunBegin> begins;
  std::vector<TelemetryRow> rows;
  std::vector<std::pair<std::size_t, Alarm>> alarms;
  std::vector<RunEnd> ends;
};

void use_tag(const std::string& tag) {
  setenv("VCNC_DDS_TAG", (tag + std::to_string(getpid())).c_str(), 1);
}

std::shared_ptr<DdsDomain> private_domain(const std::string& tag) {
  use_tag(tag);
  return std::make_shared<DdsDomain>();
}

TEST(Dds, EverythingArrivesOnceAndInOrder) {
  const auto domain = private_domain("order");
  Collector sink;
  DdsSubscriber subscriber(sink, {domain});
  DdsPublisher publisher({.domain = domain});
  publisher.wait_for_subscriber(10000);
  publisher.begin(kBegin);
  constexpr std::int64_t kRows = 20000;
  for (std::int64_t k = 0; k < kRows; ++k) {
    if (k == 0 || k == 777 || k == 12345)
      publisher.alarm({k, static_cast<int>(k % 100), "probe", "alarm " + std::to_string(k)});
    publisher.row(numbered(k));
  }
  publisher.alarm({kRows, 5, "NC unit", "last"});
  publisher.end(complete_end(kRows));
  ASSERT_TRUE(subscriber.wait_for_end(20000));

  ASSERT_EQ(sink.begins.size(), 1u);
  EXPECT_EQ(sink.begins[0].run_id, kBegin.run_id);
  EXPECT_EQ(sink.begins[0].program_name, kBegin.program_name);
  EXPECT_EQ(sink.begins[0].declared_toml, kBegin.declared_toml);
  EXPECT_EQ(sink.begins[0].piece_toml, kBegin.piece_toml);
  EXPECT_EQ(sink.begins[0].seed, kBegin.seed);
  ASSERT_EQ(sink.rows.size(), static_cast<std::size_t>(kRows));
  for (std::int64_t k = 0; k < kRows; ++k) {
    const TelemetryRow& row = sink.rows[static_cast<std::size_t>(k)];
    ASSERT_EQ(row.tick, static_cast<double>(k));
    ASSERT_EQ(row.q_cmd[4], 1e-3 * static_cast<double>(k));
    ASSERT_EQ(row.bus_load, 0.5);
  }
  ASSERT_EQ(sink.alarms.size(), 4u);
  const std::array<std::size_t, 4> expected{0, 777, 12345, kRows};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(sink.alarms[i].first, expected[i]);
  EXPECT_EQ(sink.alarms[1].second.text, "alarm 777");
  EXPECT_EQ(sink.alarms[1].second.code, 77);
  EXPECT_EQ(sink.alarms[3].second.source, "NC unit");
  ASSERT_EQ(sink.ends.size(), 1u);
  EXPECT_TRUE(sink.ends[0].complete);
  EXPECT_EQ(sink.ends[0].cycles, kRows);
  EXPECT_EQ(sink.ends[0].trace_hash, "cafe");
  EXPECT_EQ(sink.ends[0].gaps, 1u);
  EXPECT_EQ(subscriber.lost_rows(), 0u);
  EXPECT_EQ(publisher.dropped(), 0u);
}

// With a bounded window the machine cannot run away from a subscriber that takes 1 ms for
// every 20 rows; nothing is lost.
TEST(Dds, SlowSubscriberSlowsAFreeRunningMachineButLosesNothing) {
  const auto domain = private_domain("slow");
  Collector sink;
  sink.delay_every = 20;
  DdsSubscriber subscriber(sink, {domain});
  DdsPublisher publisher({.buffer_rows = 500, .window_rows = 4000, .domain = domain});
  publisher.wait_for_subscriber(10000);
  publisher.begin(kBegin);
  constexpr std::int64_t kRows = 20000;
  const auto start = std::chrono::steady_clock::now();
  for (std::int64_t k = 0; k < kRows; ++k) publisher.row(numbered(k));
  const std::chrono::duration<double> given = std::chrono::steady_clock::now() - start;
  publisher.end(complete_end(kRows));
  ASSERT_TRUE(subscriber.wait_for_end(30000));
  ASSERT_EQ(sink.rows.size(), static_cast<std::size_t>(kRows));
  EXPECT_EQ(sink.rows.back().tick, static_cast<double>(kRows - 1));
  EXPECT_EQ(publisher.dropped(), 0u);
  // At least 1 ms per 20 rows, but for the rows that may be under way.
  EXPECT_GT(given.count(), (kRows - 4000 - 500 - 2000) / 20 * 1e-3 * 0.9);
}

TEST(Dds, PacedMachineNeverWaitsAndItsDropsAreKnown) {
  const auto domain = private_domain("paced");
  Collector sink;
  DdsSubscriber subscriber(sink, {domain});
  DdsPublisher publisher({.paced = true, .buffer_rows = 64, .domain = domain});
  publisher.wait_for_subscriber(10000);
  publisher.begin(kBegin);
  constexpr std::int64_t kRows = 200000;  // far faster than messages can leave
  for (std::int64_t k = 0; k < kRows; ++k) publisher.row(numbered(k));
  publisher.end(complete_end(kRows));
  ASSERT_TRUE(subscriber.wait_for_end(30000));
  EXPECT_GT(publisher.dropped(), 0u);
  EXPECT_EQ(subscriber.lost_rows(), publisher.dropped());
  EXPECT_EQ(sink.rows.size() + publisher.dropped(), static_cast<std::size_t>(kRows));
  double before = -1;
  for (const TelemetryRow& row : sink.rows) {
    ASSERT_GT(row.tick, before);
    before = row.tick;
  }
  // Missing ticks between received rows, plus those at the edges, are all that was lost.
  const double inner =
      sink.rows.back().tick - sink.rows.front().tick + 1 - static_cast<double>(sink.rows.size());
  EXPECT_EQ(inner + static_cast<double>(sink.ends[0].gaps - 1),
            static_cast<double>(publisher.dropped()));
}

TEST(Dds, LateSubscriberLearnsTheRunAndCountsWhatItMissed) {
  const auto domain = private_domain("late");
  DdsPublisher publisher({.domain = domain});
  publisher.begin(kBegin);
  for (std::int64_t k = 0; k < 300; ++k) publisher.row(numbered(k));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  Collector sink;
  DdsSubscriber subscriber(sink, {domain});
  publisher.wait_for_subscriber(10000);
  for (std::int64_t k = 300; k < 1000; ++k) publisher.row(numbered(k));
  publisher.end(complete_end(1000));
  ASSERT_TRUE(subscriber.wait_for_end(20000));
  ASSERT_EQ(sink.begins.size(), 1u);
  EXPECT_EQ(sink.begins[0].run_id, kBegin.run_id);
  ASSERT_EQ(sink.rows.size(), 700u);
  EXPECT_EQ(sink.rows.front().tick, 300);
  EXPECT_EQ(subscriber.lost_rows(), 300u);
  EXPECT_EQ(sink.ends[0].gaps, 1u + 300u);
}

TEST(Dds, NoSubscriberIsOneClearError) {
  const auto domain = private_domain("alone");
  DdsPublisher publisher({.domain = domain});
  EXPECT_THROW(publisher.wait_for_subscriber(100), DdsError);
}

TEST(Dds, ExceptionOfTheSinkComesOutOfWaiting) {
  struct Full : Collector {
    void row(const TelemetryRow& r) override {
      if (r.tick == 100) throw std::runtime_error("disk full");
    }
  };
  const auto domain = private_domain("throw");
  Full sink;
  {
    DdsPublisher publisher({.domain = domain});
    auto subscriber = std::make_unique<DdsSubscriber>(sink, DdsSubscriberOptions{domain});
    publisher.wait_for_subscriber(10000);
    publisher.begin(kBegin);
    for (std::int64_t k = 0; k < 1000; ++k) publisher.row(numbered(k));
    EXPECT_THROW(subscriber->wait_for_end(20000), std::runtime_error);
  }
}

TEST(Dds, PublisherThatVanishesEndsTheRun) {
  const auto domain = private_domain("vanish");
  Collector sink;
  DdsSubscriber subscriber(sink, {domain});
  {
    DdsPublisher publisher({.domain = domain});
    publisher.wait_for_subscriber(10000);
    publisher.begin(kBegin);
    for (std::int64_t k = 0; k < 1000; ++k) publisher.row(numbered(k));
    for (int i = 0; i < 500 && sink.received < 1000; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_TRUE(subscriber.wait_for_end(20000));
  ASSERT_EQ(sink.ends.size(), 1u);
  EXPECT_FALSE(sink.ends[0].complete);
  EXPECT_EQ(sink.ends[0].reason, "NC unit gone");
  EXPECT_EQ(sink.rows.size(), 1000u);
}

// ------------------------------------------------------------------ other processes
// This program again, as a child, playing the part that a disabled test below describes.
pid_t start_part(const char* part) {
  const pid_t child = fork();
  if (child == 0) {
    const std::string filter = std::string("--gtest_filter=DdsPart.DISABLED_") + part;
    execl("/proc/self/exe", "part", filter.c_str(), "--gtest_also_run_disabled_tests", nullptr);
    _exit(127);
  }
  return child;
}

TEST(DdsPart, DISABLED_EndlessPublisher) {
  DdsPublisher publisher;
  publisher.wait_for_subscriber(10000);
  publisher.begin(kBegin);
  for (std::int64_t k = 0; k < 60000; ++k) {
    publisher.row(numbered(k));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(DdsPart, DISABLED_ShortPublisher) {
  DdsPublisher publisher;
  publisher.wait_for_subscriber(10000);
  publisher.begin(kBegin);
  for (std::int64_t k = 0; k < 100; ++k) publisher.row(numbered(k));
  publisher.end(complete_end(100));
}

TEST(DdsProcesses, RunOfAnotherProcessArrivesWholeAlthoughItExitsAtOnce) {
  use_tag("short");
  Collector sink;
  DdsSubscriber subscriber(sink);
  const pid_t child = start_part("ShortPublisher");
  ASSERT_TRUE(subscriber.wait_for_end(20000));
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(sink.rows.size(), 100u);
  ASSERT_EQ(sink.ends.size(), 1u);
  EXPECT_TRUE(sink.ends[0].complete);
}

TEST(DdsProcesses, KilledMachineIsNoticed) {
  use_tag("kill");
  Collector sink;
  DdsSubscriber subscriber(sink);
  const pid_t child = start_part("EndlessPublisher");
  EXPECT_FALSE(subscriber.wait_for_end(2000));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ASSERT_TRUE(subscriber.wait_for_end(10000));
  EXPECT_EQ(sink.ends[0].reason, "NC unit gone");
  EXPECT_GT(sink.rows.size(), 100u);
  EXPECT_EQ(subscriber.lost_rows(), 0u);
}

TEST(DdsProcesses, DifferentTagsNeverMeet) {
  use_tag("theirs");
  const pid_t child = start_part("EndlessPublisher");
  use_tag("ours");
  Collector sink;
  DdsSubscriber subscriber(sink);
  EXPECT_FALSE(subscriber.wait_for_end(2000));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(sink.begins.empty());
  EXPECT_TRUE(sink.rows.empty());
}

}  // namespace
}  // namespace vcnc::dds_test
