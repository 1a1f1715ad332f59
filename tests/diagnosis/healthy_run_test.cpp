#include "healthy_run.hpp"

#include <gtest/gtest.h>

#include "recorded_run.hpp"

namespace vcnc {

RunOfMachine reversals_in_the_air(const Effects& effects) {
  RecordedRun run =
      recorded_run(Showing::reversals, kX, effects, {.wall = ExperimentOptions::Wall::none});
  return {std::move(run.record), std::move(run.declared), std::move(run.piece)};
}

RunOfMachine circles_in_a_ring(const Effects& effects) {
  RecordedRun run = recorded_run(Showing::circle_feeds, kX, effects);
  return {std::move(run.record), std::move(run.declared), std::move(run.piece)};
}

RunOfMachine lap_of_the_s_piece(const Effects& effects) {
  RecordedRun run = recorded_run(Showing::s_piece, kX, effects);
  return {std::move(run.record), std::move(run.declared), std::move(run.piece)};
}

namespace healthy_run_test {

TEST(ReversalsInTheAir, AreARecordOfXThatMoves) {
  const RunOfMachine run = reversals_in_the_air({});
  const std::vector<double>& x = run.record.find(SignalKind::command, kX)->value;
  EXPECT_GT(*std::max_element(x.begin(), x.end()) - *std::min_element(x.begin(), x.end()), 1e-3);
}

TEST(CirclesInARing, AreARecordOfABallThatIsDeflected) {
  const RunOfMachine run = circles_in_a_ring({});
  ASSERT_TRUE(run.piece);
  const std::vector<double>& x = run.record.find(SignalKind::deflection, 0)->value;
  EXPECT_GT(*std::max_element(x.begin(), x.end()), 0.1e-3);
}

TEST(LapOfTheSPiece, IsARecordOfABallThatIsDeflectedAndOfRotaryAxesThatMove) {
  const RunOfMachine run = lap_of_the_s_piece({});
  const std::vector<double>& x = run.record.find(SignalKind::deflection, 0)->value;
  EXPECT_GT(*std::max_element(x.begin(), x.end()), 0.1e-3);
  const std::vector<double>& c = run.record.find(SignalKind::command, kC)->value;
  EXPECT_GT(*std::max_element(c.begin(), c.end()) - *std::min_element(c.begin(), c.end()), 1);
}

}  // namespace healthy_run_test
}  // namespace vcnc
