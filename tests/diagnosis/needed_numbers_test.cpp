#include "diagnosis/fit/needed_numbers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace vcnc::needed_numbers_test {
namespace {

using Indices = std::vector<Eigen::Index>;

TEST(NeededNumbers, OneThatMovesWhatAnotherMovesIsNotNeeded) {
  // The first number is 10 standard deviations off. The second moves what the third moves, of
  // which a prior knows that it is about as declared: 3 of its standard deviations would do.
  const double prior = 0.01;
  Eigen::Matrix3d information;
  information << 1, 0, 0, 0, 1, 1, 0, 1, 1 + prior;
  const Eigen::Vector3d off(10, 30, 0);
  const double cost = 30 * 30 * (1 - 1 / (1 + prior));  // what is left with the third in its place
  EXPECT_EQ(needless(information, off, {0, 1}, 1.01 * cost), Indices{1});
  EXPECT_EQ(needless(information, off, {0, 1}, 0.99 * cost), Indices{});
}

TEST(NeededNumbers, NotAllOfThemGo) {
  EXPECT_EQ(needless(Eigen::Matrix2d::Identity(), Eigen::Vector2d(0.1, 0.2), {0, 1}, 1e9),
            Indices{0});
  EXPECT_EQ(needless(Eigen::Matrix2d::Identity(), Eigen::Vector2d(0.1, 0.2), {1}, 1e9), Indices{});
}

TEST(NeededNumbers, CostWhatIsLostWhenAllOthersAreFittedAgain) {
  std::mt19937 random(41);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::MatrixXd columns =
        Eigen::MatrixXd::NullaryExpr(40, 5, [&] { return normal(random); });
    const Eigen::VectorXd off = Eigen::VectorXd::NullaryExpr(5, [&] { return normal(random); });
    const Eigen::VectorXd reading = columns * off;
    // Those that went, by dropping their columns: least squares leave what they cost together.
    const auto left_without = [&](const Indices& gone) {
      Indices stay;
      for (Eigen::Index i = 0; i < 5; ++i)
        if (std::find(gone.begin(), gone.end(), i) == gone.end()) stay.push_back(i);
      const Eigen::MatrixXd others = columns(Eigen::all, stay);
      return (reading - others * others.colPivHouseholderQr().solve(reading)).squaredNorm();
    };
    const double cost = 60;
    const Indices gone = needless(columns.transpose() * columns, off, {0, 1, 2}, cost);
    EXPECT_LE(gone.size(), 2U);
    EXPECT_LT(left_without(gone), cost);
    if (gone.size() == 2) continue;
    for (Eigen::Index i = 0; i < 3; ++i) {
      Indices more = gone;
      if (std::find(gone.begin(), gone.end(), i) != gone.end()) continue;
      more.push_back(i);
      EXPECT_GE(left_without(more), cost);
    }
  }
}

}  // namespace
}  // namespace vcnc::needed_numbers_test
