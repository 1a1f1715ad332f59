#include "diagnosis/records/stretches.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"
#include "model/math.hpp"

namespace vcnc::stretches_test {
namespace {

/// Commands of X and Y at 1 ms.
class Motion2 {
 public:
  void stand(double seconds) {
    for (int i = 0; i < std::lround(seconds * 1e3); ++i) at(x_.back(), y_.back());
  }
  /// Laps of a circle about the origin, from the x axis on, at constant speed from standstill.
  void laps(double radius, double lap_time, double laps) {
    for (int i = 0; i < laps * std::abs(lap_time) * 1e3; ++i) {
      const double phi = 2 * kPi * i * 1e-3 / lap_time;
      at(radius * std::cos(phi), radius * std::sin(phi));
    }
  }
  void line(double way, double seconds) {
    const double from = x_.back();
    const int n = static_cast<int>(std::lround(seconds * 1e3));
    for (int i = 1; i <= n; ++i) at(from + way * i / n, y_.back());
  }
  Record record() const {
    Record r;
    r.signals = {{SignalKind::command, kX, "x", x_, 0}, {SignalKind::command, kY, "y", y_, 0}};
    return r;
  }
  std::size_t size() const { return x_.size(); }

 private:
  void at(double x, double y) {
    x_.push_back(x);
    y_.push_back(y);
  }
  std::vector<double> x_{0.02}, y_{0};
};

TEST(Stretches, LapsUnderOtherForcesAreNoRepetitions) {
  Motion2 m;
  m.stand(0.3);
  m.laps(0.02, 1.2, 4.02);
  m.stand(0.3);
  Record r = m.record();
  const std::size_t pulse = 1200 + 700;  // in the second of four laps
  std::vector<double> force(m.size(), 0.0);
  for (std::size_t k = 0; k < 10; ++k) force[300 + pulse + k] = 50;
  for (const SignalKind kind : {SignalKind::applied_force, SignalKind::added_force}) {
    r.signals.resize(2);
    r.signals.push_back({kind, kX, "f", force, 0});
    std::vector<Stretch> laps;
    for (const Stretch& one : stretches_of(r))
      if (one.end - one.begin > 1000) laps.push_back(one);
    ASSERT_EQ(laps.size(), 4u);
    EXPECT_NE(laps[0].condition, laps[1].condition);
    EXPECT_EQ(laps[0].condition, laps[2].condition);
    EXPECT_EQ(laps[0].condition, laps[3].condition);
  }
}

TEST(Stretches, LapsThatAreNoWholeNumberOfSamplesAreFound) {
  Motion2 m;
  m.stand(0.3);
  m.laps(0.02, 1.2347, 3.02);
  m.stand(0.3);
  m.laps(0.02, -1.2347, 2.02);
  m.stand(0.1);
  const std::vector<Stretch> s = stretches_of(m.record());
  std::vector<Stretch> laps;
  for (const Stretch& one : s)
    if (one.end - one.begin > 1000) laps.push_back(one);
  ASSERT_EQ(laps.size(), 5u);
  for (const Stretch& lap : laps) EXPECT_NEAR(static_cast<double>(lap.end - lap.begin), 1235, 1);
  EXPECT_NEAR(static_cast<double>(laps[2].begin - laps[0].begin), 2 * 1234.7, 1);
  EXPECT_EQ(laps[0].condition, laps[2].condition);
  EXPECT_EQ(laps[1].repetition, 1);
  EXPECT_EQ(laps[2].repetition, 2);
  EXPECT_NE(laps[3].condition, laps[0].condition);  // the other way round
  EXPECT_EQ(laps[3].condition, laps[4].condition);
}

/// As around a cone without unwinding.
/// Of laps in a row the first one follows something else than the others do; of laps from rest to
/// rest none does.
TEST(Stretches, TheFirstOfLapsInARowStillHoldsWhatCameBefore) {
  const auto run_in_of_laps = [](const Record& record) {
    std::vector<Stretch> laps;
    for (const Stretch& s : stretches_of(record))
      if (s.end - s.begin > 1000) laps.push_back(s);
    EXPECT_GE(laps.size(), 2U);
    return run_in(record, laps);
  };
  Motion2 in_a_row;
  in_a_row.stand(0.5);
  in_a_row.laps(0.02, 1.2, 3.02);
  in_a_row.stand(0.5);
  EXPECT_EQ(run_in_of_laps(in_a_row.record()), 300U);
  Motion2 from_rest;
  for (int i = 0; i < 3; ++i) {
    from_rest.stand(0.5);
    from_rest.line(0.03, 1.2);
    from_rest.line(-0.03, 1.2);
  }
  from_rest.stand(0.5);
  EXPECT_EQ(run_in_of_laps(from_rest.record()), 0U);
  EXPECT_EQ(run_in(Record(), {{0, 100, 0, 0, ""}}), 0U);
}

TEST(Stretches, ARotaryAxisThatHasTurnedRoundHasComeBack) {
  for (const std::size_t turning : {std::size_t{kC}, std::size_t{kZ}}) {
    Motion2 m;
    m.stand(0.3);
    const std::size_t begin = m.size();
    m.laps(0.02, 1.2347, 3.02);
    const std::size_t end = m.size();
    m.stand(0.3);
    Record r = m.record();
    std::vector<double> turn(m.size(), 0.0);
    for (std::size_t k = begin; k < m.size(); ++k)
      turn[k] = 2 * kPi * static_cast<double>(std::min(k, end - 1) - begin) / 1234.7;
    r.signals.push_back({SignalKind::command, turning, "turn", turn, 0});
    std::vector<Stretch> laps;
    for (const Stretch& one : stretches_of(r))
      if (std::abs(static_cast<double>(one.end - one.begin) - 1234.7) < 2) laps.push_back(one);
    if (turning == kZ) {
      EXPECT_TRUE(laps.empty());
      continue;
    }
    ASSERT_EQ(laps.size(), 3U);
    EXPECT_EQ(laps[0].condition, laps[2].condition);
  }
}

TEST(Stretches, EqualPassesWithRestsBetweenAreOneCondition) {
  Motion2 m;
  m.stand(0.2);
  for (int i = 0; i < 3; ++i) {
    m.line(0.01, 0.5);
    m.stand(0.1);
    m.line(-0.01, 0.5);
    m.stand(0.1);
  }
  m.line(0.01, 0.25);  // faster
  m.stand(0.1);
  const std::vector<Stretch> s = stretches_of(m.record());
  ASSERT_EQ(s.size(), 7u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(s[i].condition, static_cast<int>(i % 2));
    EXPECT_EQ(s[i].repetition, static_cast<int>(i / 2));
  }
  EXPECT_EQ(s[6].condition, 2);
  EXPECT_EQ(s[6].repetition, 0);
}

TEST(Stretches, DoNotOverlapAndLieInTheRecord) {
  Motion2 m;
  m.laps(0.02, 0.7, 2.5);
  m.laps(0.02, 0.31, 4.1);
  m.stand(0.05);
  m.line(0.03, 1);
  std::size_t end = 0;
  for (const Stretch& s : stretches_of(m.record())) {
    EXPECT_GE(s.begin, end);
    EXPECT_GT(s.end, s.begin);
    end = s.end;
  }
  EXPECT_LE(end, m.size());
}

TEST(Stretches, AStandingAxisIsMarked) {
  Motion2 m;
  m.stand(0.2);
  m.line(0.01, 0.5);
  m.stand(0.2);
  const std::vector<char> x = moving(m.record(), kX), y = moving(m.record(), kY);
  EXPECT_FALSE(x[100] || x[800]);
  EXPECT_TRUE(x[400] && x[710]);  // and the 25 ms after
  EXPECT_EQ(std::count(y.begin(), y.end(), true), 0);
}

}  // namespace
}  // namespace vcnc::stretches_test
