#include "diagnosis/laws/generic_laws.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/laws/law_knots.hpp"
#include "diagnosis/selection/law_search.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc::generic_laws_test {
namespace {

TEST(GenericLaws, TakeANameAwayWhereTheyClearlyDoBetter) {
  // Friction that differs with the direction, of which the model is wrong by 1.4 %.
  EXPECT_FALSE(takes_names_away(20600, {20310, 1, 20310}, 71));
  // What no effect does: the best one imitates a third of it.
  EXPECT_TRUE(takes_names_away(268900, {101200, 1, 101200}, 16700));
  // Where little is to be gained, what a law is to gain at all decides.
  EXPECT_FALSE(takes_names_away(160, {100, 1, 100}, 60));
  EXPECT_TRUE(takes_names_away(170, {100, 1, 100}, 60));
  EXPECT_TRUE(takes_names_away(184300, {184200, 2, 9000}, 9300));
  EXPECT_FALSE(takes_names_away(184100, {184200, 2, 9000}, 9300));
  // Three names for a bellows at the end of a travel.
  EXPECT_TRUE(takes_names_away(164210, {164350, 3, 7740}, 40));
  // A small effect that the law does not do.
  EXPECT_FALSE(takes_names_away(164210, {164350, 3, 150}, 40));
}

TEST(GenericLaws, NamesStayOrGo) {
  const Named one{1000, 1, 1000}, three{1000, 3, 100};
  // Alone, beside, named, needed, too many.
  EXPECT_EQ(judged(900, 0, one, 40, false), Names::stay);
  EXPECT_EQ(judged(1200, 0, one, 40, false), Names::replaced);
  // Beside the name a law does far more.
  EXPECT_EQ(judged(1200, 2000, one, 40, false), Names::stay);
  EXPECT_EQ(judged(995, 0, three, 40, false), Names::replaced);
  EXPECT_EQ(judged(900, 0, three, 40, false), Names::stay);
  EXPECT_EQ(judged(900, 0, three, 40, true), Names::imitate);
  EXPECT_EQ(judged(30, 0, three, 40, true), Names::stay);
}

TEST(GenericLaws, AreContradictedByWhatTheyMakeWorse) {
  EXPECT_TRUE(contradicted({1000, 10}, {100, 110}));
  EXPECT_FALSE(contradicted({1000, 10}, {100, 30}));
  EXPECT_FALSE(contradicted({1000, 10}, {100, 10}));
}

/// What is gained by hats on these knots and besides, of a function over 0 to 1 that is known at
/// 2000 places to one in a hundred.
std::function<double(const std::vector<Hat>&)> gain_of(const std::vector<double>& knots,
                                                       double (*f)(double)) {
  return [knots, f](const std::vector<Hat>& hats) {
    std::vector<Hat> all = hats;
    for (std::size_t i = 0; i < knots.size(); ++i)
      all.push_back({i > 0 ? knots[i - 1] : -1, knots[i], i + 1 < knots.size() ? knots[i + 1] : 2});
    Eigen::VectorXd y(2000);
    Eigen::MatrixXd a(y.size(), static_cast<Eigen::Index>(all.size()));
    for (Eigen::Index k = 0; k < y.size(); ++k) {
      const double x = (static_cast<double>(k) + 0.5) / static_cast<double>(y.size());
      y[k] = 100 * f(x);
      for (Eigen::Index h = 0; h < a.cols(); ++h) {
        const Hat& hat = all[static_cast<std::size_t>(h)];
        const double width = x < hat.at ? hat.at - hat.low : hat.high - hat.at;
        a(k, h) = std::max(0.0, 1 - std::abs(x - hat.at) / width);
      }
    }
    return y.squaredNorm() - (y - a * a.colPivHouseholderQr().solve(y)).squaredNorm();
  };
}

const std::vector<double> kEven{0, 0.25, 0.5, 0.75, 1};

TEST(LawKnots, StayWhereStraightLinesDo) {
  const auto bent_at_a_knot = [](double x) { return std::max(0.0, x - 0.5); };
  EXPECT_EQ(with_more_knots(kEven, gain_of(kEven, bent_at_a_knot), 10), kEven);
}

TEST(LawKnots, ComeNearAKinkAlone) {
  const auto bent = [](double x) { return std::max(0.0, x - 0.3125); };
  const std::vector<double> knots = with_more_knots(kEven, gain_of(kEven, bent), 1);
  EXPECT_TRUE(std::count(knots.begin(), knots.end(), 0.3125)) << "in the end it has its knot";
  for (const double at : knots)
    EXPECT_TRUE(std::count(kEven.begin(), kEven.end(), at) || (at > 0.25 && at < 0.5)) << at;
}

TEST(LawKnots, DoubleUntilAWaveIsDrawn) {
  const auto wave = [](double x) { return std::sin(2 * kPi * x / 0.25); };
  EXPECT_EQ(with_more_knots(kEven, gain_of(kEven, wave), 10).size(), 33U);
}

/// Waves over Y that grow with X: no curve of one thing.
TEST(LawSearch, TellsTwoCurvesWhereOneGrowsWithAnother) {
  Record record = toy::commands(2048, 4);
  toy::measure(record, {}, 47);
  const std::vector<double>&x = record.find(SignalKind::command, 0)->value,
        &y = record.find(SignalKind::command, 1)->value;
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += 2e-6 * std::sin(2 * kPi * y[k] / 0.02) * (1 + x[k] / 0.02);
  toy::ToyReplica replica(record);
  const Diagnosis d = diagnose({record, replica, {}, toy::candidates()});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(d.laws.size(), 2U);
  std::vector<std::string> words{d.laws[0].words, d.laws[1].words};
  std::sort(words.begin(), words.end());
  EXPECT_EQ(words[0], "displacement on X as f(q_Y)");
  EXPECT_EQ(words[1], "displacement on X as q_X f(q_Y)");
  EXPECT_EQ(d.found.effects.laws.size(), 2U);
  for (const SignalFigure& f : d.figures)
    if (f.channel.kind == SignalKind::deflection) {
      EXPECT_LT(f.after, 0.2 * f.before);
    }
}

}  // namespace
}  // namespace vcnc::generic_laws_test
