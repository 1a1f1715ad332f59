#include "diagnosis/fit/look_about.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/settling.hpp"
#include "toy_machine.hpp"

namespace vcnc::look_about_test {
namespace {

const std::vector<double> kAt{0, -8, -4, -2, -1, 1, 2, 4, 8};

std::vector<double> chi_square(double least_at, double (*rough)(double)) {
  std::vector<double> all;
  for (const double k : kAt) all.push_back(1000 + 4 * std::pow(k - least_at, 2) + rough(k));
  return all;
}

TEST(TimesWider, IsOneWhereChiSquareIsItsOwnParabola) {
  EXPECT_NEAR(times_wider(kAt, chi_square(0, [](double) { return 0.0; })), 1, 1e-9);
}

TEST(TimesWider, GrowsWithHowFarOffTheLeastIs) {
  EXPECT_NEAR(times_wider(kAt, chi_square(3, [](double) { return 0.0; })), std::sqrt(10), 1e-9);
}

TEST(TimesWider, GrowsWithWhatScattersAboutTheParabola) {
  const double wider =
      times_wider(kAt, chi_square(0, [](double k) { return k == 0 ? -100.0 : 0.0; }));  // a dip
  EXPECT_GT(wider, 2.5);
  EXPECT_LT(wider, 8);
}

TEST(TimesWider, EndsWhereNobodyLooked) {
  EXPECT_EQ(times_wider(kAt, chi_square(0, [](double k) { return -5 * k * k; })), 8);
  EXPECT_EQ(times_wider({0, -1, 1}, {0, 5, 1}), 1);  // a parabola is through any three
}

/// A toy with a viscous friction of X, that of the truth, fitted.
struct Fitted {
  Fitted() {
    toy::measure(record, toy::machine({{key, 300}}), 5);
    evidence.emplace(record, replica, Machine());
    machine = fit_declared(*evidence, Machine());
    machine.added.push_back({.numbers = {{.number = {key, 2000, 0, 1e6, true}, .value = 300}}});
    settle_at(*evidence, machine);
  }
  double value() const { return machine.added[0].numbers[0].value; }
  double half_width() const { return intervals_of(*evidence, machine).at(key).half_width; }

  const std::string key = "effects.X.viscous.coefficient_Ns_per_m";
  Record record = toy::commands(1000, 4);
  toy::ToyReplica replica{record};
  std::optional<Evidence> evidence;
  FittedMachine machine;
};

/// In a machine that is linear in it, a number and its interval stay as they are.
TEST(LookAbout, LeavesASmoothNumberAlone) {
  Fitted f;
  const double value = f.value(), half = f.half_width();
  look_about(*f.evidence, f.machine, {f.key}, false, 25);
  EXPECT_NEAR(f.value(), value, 0.01 * half);
  EXPECT_NEAR(f.half_width(), half, 0.1 * half);
}

/// From a value far beside, it begins again where less is left.
TEST(LookAbout, BeginsAgainWhereLessIsLeft) {
  Fitted f;
  const double half = f.half_width();
  f.machine.added[0].numbers[0].value = 300 - 6 * half;
  move_number(f.machine.machine, f.key, 300 - 6 * half);
  anchor_at(*f.evidence, f.machine);
  look_about(*f.evidence, f.machine, {f.key}, false, 25);
  EXPECT_NEAR(f.value(), 300, 2 * half);
}

}  // namespace
}  // namespace vcnc::look_about_test
