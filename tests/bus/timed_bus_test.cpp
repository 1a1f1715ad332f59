#include "bus/timed_bus.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "toy_machine.hpp"

namespace vcnc::timed_bus_test {
namespace {

TEST(TimedBus, LowestIdentifierWinsAndNothingIsInterrupted) {
  TimedBus bus;
  const std::vector<TimedBus::Request> requests{
      {0x700, 0, 100}, {0x180, 10, 50}, {0x080, 20, 30}, {0x200, 500, 10}};
  const auto slots = bus.arbitrate(requests);
  EXPECT_EQ(slots[0].start_ns, 0);    // alone at first, and not interrupted
  EXPECT_EQ(slots[2].start_ns, 100);  // lowest of those that wait
  EXPECT_EQ(slots[1].start_ns, 130);
  EXPECT_EQ(slots[1].end_ns, 180);
  EXPECT_EQ(slots[3].start_ns, 500);  // the bus was idle before
}

/// The definition, nanosecond by nanosecond.
std::vector<TimedBus::Slot> by_definition(const std::vector<TimedBus::Request>& requests) {
  std::vector<TimedBus::Slot> slots(requests.size());
  std::vector<bool> sent(requests.size());
  std::int64_t busy_until = 0;
  for (std::int64_t t = 0; std::find(sent.begin(), sent.end(), false) != sent.end(); ++t) {
    if (t < busy_until) continue;
    int winner = -1;
    for (std::size_t i = 0; i < requests.size(); ++i)
      if (!sent[i] && requests[i].ready_ns <= t &&
          (winner < 0 || requests[i].id < requests[static_cast<std::size_t>(winner)].id))
        winner = static_cast<int>(i);
    if (winner < 0) continue;
    const auto w = static_cast<std::size_t>(winner);
    sent[w] = true;
    busy_until = t + requests[w].duration_ns;
    slots[w] = {t, busy_until};
  }
  return slots;
}

TEST(TimedBus, AgreesWithTheDefinition) {
  toy::Random random(77);
  TimedBus bus;
  for (int run = 0; run < 300; ++run) {
    std::vector<TimedBus::Request> requests(random.next() % 12);
    for (auto& r : requests)
      r = {static_cast<std::uint16_t>(random.next() % 2048),
           static_cast<std::int64_t>(random.next() % 300),
           static_cast<std::int64_t>(1 + random.next() % 60)};
    const auto slots = bus.arbitrate(requests);
    const auto expected = by_definition(requests);
    ASSERT_EQ(slots.size(), expected.size());
    for (std::size_t i = 0; i < slots.size(); ++i) {
      EXPECT_EQ(slots[i].start_ns, expected[i].start_ns);
      EXPECT_EQ(slots[i].end_ns, expected[i].end_ns);
    }
  }
}

}  // namespace
}  // namespace vcnc::timed_bus_test
