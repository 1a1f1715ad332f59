#include "diagnosis/evidence/gathering.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace vcnc::gathering_test {
namespace {

/// Predicts the load of X, and notes how many machines it was asked for at a time.
class LoadReplica : public Replica {
 public:
  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    const double load = m.axes[kX].mechanics.load;
    if (load < 0) throw std::invalid_argument("no such load");
    return {SharedSeries(std::vector<double>{load})};
  }
  std::vector<Prediction> predict_all(const std::vector<Machine>& machines) const override {
    asked.push_back(machines.size());
    return Replica::predict_all(machines);
  }

  mutable std::vector<std::size_t> asked;  ///< only ever one question at a time

 private:
  std::vector<ComparedChannel> channels_{{SignalKind::position, kX}};
};

Machine of_load(double load) {
  Machine m;
  m.axes[kX].mechanics.load = load;
  return m;
}

TEST(Gathering, AnswersAllAtOnceAndEachItsOwn) {
  const LoadReplica replica;
  Gathering gathering(replica);
  std::atomic<int> right = 0;
  // Member i asks i + 1 times: of three, one leaves after each round.
  gathering.each(3, [&](std::size_t i) {
    for (std::size_t round = 0; round <= i; ++round) {
      const double load = 100.0 * static_cast<double>(i + 1) + static_cast<double>(round);
      const std::vector<Prediction> p = gathering.predict_all({of_load(load), of_load(load + 0.5)});
      right += p.size() == 2 && p[0][0][0] == load && p[1][0][0] == load + 0.5;
    }
  });
  EXPECT_EQ(right, 6);
  EXPECT_EQ(replica.asked, (std::vector<std::size_t>{6, 4, 2}));
}

TEST(Gathering, WithoutMembersAnswersWhoAsks) {
  const LoadReplica replica;
  Gathering gathering(replica);
  EXPECT_EQ(gathering.predict_all({of_load(7)})[0][0][0], 7);
}

TEST(Gathering, WhatCannotBeAnsweredIsThrownToWhoAsked) {
  const LoadReplica replica;
  Gathering gathering(replica);
  std::atomic<int> answered = 0, thrown = 0;
  gathering.each(3, [&](std::size_t i) {
    try {
      gathering.predict_all({of_load(i == 1 ? -1 : 5)});
      ++answered;
    } catch (const std::invalid_argument&) {
      thrown += i == 1;
    }
  });
  EXPECT_EQ(answered, 2);
  EXPECT_EQ(thrown, 1);
  EXPECT_THROW(gathering.each(2, [](std::size_t) { throw std::invalid_argument("none"); }),
               std::invalid_argument);
}

}  // namespace
}  // namespace vcnc::gathering_test
