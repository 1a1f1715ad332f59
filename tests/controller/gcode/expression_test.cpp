#include "controller/gcode/expression.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace vcnc::expression_test {
namespace {

class NoSystem : public SystemParameters {
 public:
  std::optional<double> read(int) const override { return std::nullopt; }
  std::optional<double> read(std::string_view) const override { return std::nullopt; }
  bool write(int, double) override { return false; }
};

class Expression : public testing::Test {
 protected:
  double value(const std::string& text) {
    Cursor at(text);
    const double x = Evaluator(parameters, vacant, siemens).value(at);
    at.skip_blanks();
    EXPECT_TRUE(at.at_end()) << text << ": stopped at column " << at.column();
    return x;
  }
  std::string refused(const std::string& text) {
    try {
      value(text);
    } catch (const LineError& error) {
      return std::to_string(error.column) + ": " + error.what();
    }
    return "accepted";
  }
  NoSystem system;
  Parameters parameters{system};
  bool vacant = false, siemens = false;
};

TEST_F(Expression, Numbers) {
  EXPECT_EQ(value("5"), 5);
  EXPECT_EQ(value("+5."), 5);
  EXPECT_EQ(value("-.5"), -0.5);
  EXPECT_EQ(value("00012.50"), 12.5);
  EXPECT_EQ(value("[-3]"), -3);
}

TEST_F(Expression, EveryNumberIsTheNearestDouble) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string text = std::to_string(random() % 1'000'000) + ".";
    const std::size_t decimals = random() % 14;
    for (std::size_t k = 0; k < decimals; ++k) text += static_cast<char>('0' + random() % 10);
    EXPECT_EQ(value(text), std::stod(text)) << text;
  }
}

TEST_F(Expression, RanksAndOrder) {
  EXPECT_EQ(value("[2+3*4]"), 14);
  EXPECT_EQ(value("[2*3**2]"), 18);
  EXPECT_EQ(value("[2**3**2]"), 64);  // from left to right
  EXPECT_EQ(value("[10-3-2]"), 5);
  EXPECT_EQ(value("[24/4/2]"), 3);
  EXPECT_EQ(value("[7 MOD 4 + 1]"), 4);
  EXPECT_EQ(value("[-7 mod 4]"), 1);
  EXPECT_EQ(value("[1+1 EQ 2]"), 1);
  EXPECT_EQ(value("[1 GT 2 OR 3 GT 2]"), 1);
  EXPECT_EQ(value("[1 XOR 1]"), 0);
  EXPECT_EQ(value("[1 AND 0]"), 0);
  EXPECT_EQ(value("[2 NE 2]"), 0);
  EXPECT_EQ(value("[2 GE 2] "), 1);
  EXPECT_EQ(value("[3 LE 2]"), 0);
  EXPECT_EQ(value("[3 LT 4]"), 1);
  EXPECT_EQ(value("[1-2]"), -1);
  EXPECT_EQ(value("[1--2]"), 3);
}

TEST_F(Expression, Functions) {
  EXPECT_NEAR(value("SIN[30]"), 0.5, 1e-15);
  EXPECT_NEAR(value("cos[60]"), 0.5, 1e-15);
  EXPECT_NEAR(value("TAN[45]"), 1, 1e-15);
  EXPECT_NEAR(value("ASIN[0.5]"), 30, 1e-13);
  EXPECT_NEAR(value("ACOS[0.5]"), 60, 1e-13);
  EXPECT_NEAR(value("ATAN[1]/[-1]"), 135, 1e-13);
  EXPECT_NEAR(value("ATAN[-1]/[-1]"), -135, 1e-13);
  EXPECT_EQ(value("SQRT[9]"), 3);
  EXPECT_EQ(value("ABS[-2.5]"), 2.5);
  EXPECT_EQ(value("FIX[2.8]"), 2);
  EXPECT_EQ(value("FIX[-2.8]"), -3);
  EXPECT_EQ(value("FUP[2.2]"), 3);
  EXPECT_EQ(value("FUP[-2.8]"), -2);
  EXPECT_EQ(value("ROUND[-2.5]"), -3);
  EXPECT_NEAR(value("EXP[1]"), 2.718281828459045, 1e-15);
  EXPECT_NEAR(value("LN[10]"), 2.302585092994046, 1e-15);
  EXPECT_EQ(value("POW[2,10]"), 1024);
  EXPECT_EQ(value("MAX[2,MIN[7,5]]"), 5);
}

TEST_F(Expression, Parameters) {
  parameters.write(1, 2);
  parameters.write(2, 40);
  parameters.write("local", 7);
  parameters.write("_global", 8);
  EXPECT_EQ(value("#1"), 2);
  EXPECT_EQ(value("##1"), 40);
  EXPECT_EQ(value("#[#1-1]"), 2);
  EXPECT_EQ(value("-#2"), -40);
  EXPECT_EQ(value("[#<Lo cal>+#<_global>]"), 15);
  EXPECT_EQ(value("EXISTS[#<local>]"), 1);
  EXPECT_EQ(value("EXISTS[#<nothing>]"), 0);
  EXPECT_EQ(value("#99"), 0);
}

TEST_F(Expression, VacantParametersOfMacros) {
  vacant = true;
  EXPECT_TRUE(std::isnan(value("#5")));
  EXPECT_EQ(value("[#5 EQ #0]"), 1);
  EXPECT_EQ(value("[#5 EQ 0]"), 0);
  EXPECT_EQ(value("[#5 NE 0]"), 1);
  EXPECT_EQ(value("[#5+3]"), 3);
  EXPECT_EQ(value("[#5*3]"), 0);
  EXPECT_EQ(value("[#5 GE 0]"), 1);
}

TEST_F(Expression, WrongOnesNameColumnAndReason) {
  EXPECT_EQ(refused("[1/0]"), "3: division by 0");
  EXPECT_EQ(refused("[5 MOD 0]"), "4: MOD 0");
  EXPECT_EQ(refused("SQRT[-1]"), "1: SQRT of -1; allowed is 0 or more");
  EXPECT_EQ(refused("ASIN[2]"), "1: ASIN of 2; allowed is -1 to 1");
  EXPECT_EQ(refused("LN[0]"), "1: LN of 0; allowed is more than 0");
  EXPECT_EQ(refused("[[-2]**0.5]"), "6: a negative number to a power that is not whole");
  EXPECT_EQ(refused("[0**-1]"), "3: 0 to a negative power");
  EXPECT_EQ(refused("[1+2"), "1: '[' without its ']'");
  EXPECT_EQ(refused("[1+]"), "4: a number was expected, not ']'");
  EXPECT_EQ(refused("ATAN[1]"), "8: ATAN[y] is followed by /[x]");
  EXPECT_EQ(refused("#<nothing>"), "1: #<nothing> was never set");
  EXPECT_EQ(refused("#-1"), "2: #-1: a parameter has a whole number from 0 to 9999");
  EXPECT_EQ(refused("#1.5"), "2: #1.5: a parameter has a whole number from 0 to 9999");
  EXPECT_NE(refused("FOO[1]").find("not FOO; functions are ABS"), std::string::npos);
  EXPECT_NE(refused("SIN 30").find("each followed by '['"), std::string::npos);
  EXPECT_NE(refused(std::string(200, '[')).find("nested deeper than 50"), std::string::npos);
  EXPECT_NE(refused(std::string(200, '-') + "1").find("malformed"), std::string::npos);
  EXPECT_NE(refused("[1E5]"), "accepted");
}

/// Random expression trees against the same tree computed here.
TEST_F(Expression, RandomTreesAgreeWithTheirOwnValue) {
  std::mt19937_64 random(11);
  struct Tree {
    std::string text;
    double value;
  };
  const std::function<Tree(int)> grow = [&](int depth) -> Tree {
    if (depth == 0 || random() % 4 == 0) {
      const double x = static_cast<double>(random() % 2001) / 100 - 10;
      std::string text = std::to_string(x);
      return {text, std::stod(text)};
    }
    const Tree a = grow(depth - 1), b = grow(depth - 1);
    switch (random() % 6) {
      case 0:
        return {"[" + a.text + " + " + b.text + "]", a.value + b.value};
      case 1:
        return {"[" + a.text + "-" + b.text + "]", a.value - b.value};
      case 2:
        return {"[" + a.text + "*" + b.text + "]", a.value * b.value};
      case 3:
        return {"ABS[" + a.text + "]", std::abs(a.value)};
      case 4:
        return {"[" + a.text + " GT " + b.text + "]", a.value > b.value ? 1.0 : 0.0};
      default:
        return {"[-" + std::string("[") + a.text + "]/2]", -a.value / 2};
    }
  };
  for (int i = 0; i < 2000; ++i) {
    const Tree tree = grow(5);
    EXPECT_EQ(value(tree.text), tree.value) << tree.text;
  }
}

}  // namespace
}  // namespace vcnc::expression_test
