#include "healthy_run.hpp"

#include <gtest/gtest.h>

#include "recorded_run.hpp"

namespace vcnc {

RunOfMachine reversals_in_the_air(const Effects& effects) {
  RecordedRun run =
      recorded_run(Showing::reversals, kX, effects, {.wall = ExperimentOptions::Wall::none});
  return {std::move(run.record), std::move(run.declared), std::move(run.piece)};
}

TEST(ReversalsInTheAir, AreARecordOfXThatMoves) {
  const RunOfMachine run = reversals_in_the_air({});
  const std::vector<double>& x = run.record.find(SignalKind::command, kX)->value;
  EXPECT_GT(*std::max_element(x.begin(), x.end()) - *std::min_element(x.begin(), x.end()), 1e-3);
}

}  // namespace vcnc
