// The worked example of CONTRIBUTING.md is this code, works, and keeps the contract; and the checks
// of the contract can fail.
#include "tests/effects/worked_example.hpp"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <fstream>

#include "model/drive/friction.hpp"
#include "tests/effects/contract.hpp"

namespace vcnc::worked_example_test {
namespace {

std::string file(const std::string& path) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/" + path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(WorkedExample, IsTheOneInContributing) {
  const std::string page = file("CONTRIBUTING.md"), fence = "```cpp\n";
  const std::size_t begin = page.find(fence);
  ASSERT_NE(begin, page.npos);
  const std::size_t from = begin + fence.size();
  EXPECT_EQ(page.substr(from, page.find("```", from) - from),
            file("tests/effects/worked_example.hpp"));
}

TEST(WorkedExample, KeepsTheContract) {
  std::set<std::string> known;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    known.insert(std::string(Effect::text.name));
  });
  EXPECT_FALSE(known.contains(std::string(BallPassage::text.name))) << "it is in the library now";
  check_text<BallPassage>(known);
  check_numbers<BallPassage>();
  check_null<BallPassage>();
  check_bounded<BallPassage>();
  check_dissipative<BallPassage>();
  check_derivative<BallPassage>();
}

/// Sliding at constant speed, the force is g_0 (1 + h cos(2 pi q/p + psi)) against the motion.
TEST(WorkedExample, SwingsTheFrictionForceOverThePosition) {
  Chain<FrictionPort> chain;
  chain.add(Coulomb{250}, Seat{});
  chain.add(BallPassage{.share = 0.2, .period = 8e-3, .phase = 0.5}, Seat{});
  Friction friction;
  for (const double v : {0.05, -0.05}) {
    for (int i = 0; i < 100; ++i) {
      const double q = 1e-4 * i;
      FrictionTerms terms;
      chain.step(terms, {.moment = {}, .position = q, .velocity = v});
      friction.step(terms, v, v, 50e-6, 50e-6 / 500);
      const double expected = 250 * (1 + 0.2 * std::cos(2 * kPi * q / 8e-3 + 0.5));
      EXPECT_NEAR(friction.force(), v > 0 ? expected : -expected, 1e-8);  // rounding of v
    }
  }
}

// ------------------------------------------------------------------------ the checks can fail

/// A sound effect, to be spoilt.
struct SpoiltBase {
  using Port = FrictionPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{.name = "spoilt",
                                   .title = "Spoilt",
                                   .family = Family::friction,
                                   .brief = "b",
                                   .equation = "e",
                                   .validity = "v",
                                   .source = "s",
                                   .signature = "s",
                                   .confusable = "coulomb",
                                   .separate = "s",
                                   .showing = Showing::line};
  static constexpr bool dissipative = true;
  double level = 0;
  bool null() const { return level == 0; }
  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("level_N", p.level, unit::newton, Range{0, 1000}, "level");
  }
};
struct LeakyNull : SpoiltBase {
  static LeakyNull nominal() { return {{100}}; }
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.dry = signal.dry * T(1 + 1e-16) + T(1e-13);
  }
};
struct OutOfBounds : SpoiltBase {
  static OutOfBounds nominal() { return {{2000}}; }
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.dry += level / context.velocity;
  }
};
struct Driving : SpoiltBase {
  static Driving nominal() { return {{2000}}; }
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.dry -= level;
  }
};
struct BlindToVelocity : SpoiltBase {
  static BlindToVelocity nominal() { return {{100}}; }
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    if constexpr (std::is_same_v<T, double>)
      signal.dry += level * context.velocity * context.velocity;
    else  // what a cast to double would do
      signal.dry += T(level * context.velocity.v * context.velocity.v);
  }
};
struct Forgetful : SpoiltBase {
  static Forgetful nominal() { return {{100}}; }
  template <class T>
  struct State {
    double last = 0;  // should be T
  };
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    signal.dry += level * state.last;
    if constexpr (std::is_same_v<T, double>)
      state.last = context.position;
    else
      state.last = context.position.v;
  }
};

/// The failures of a check.
std::string failures_of(void (*check)()) {
  testing::TestPartResultArray all;
  {
    testing::ScopedFakeTestPartResultReporter reporter(
        testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &all);
    check();
  }
  std::string text;
  for (int i = 0; i < all.size(); ++i) text += all.GetTestPartResult(i).message();
  return text;
}

TEST(EffectContract, ItsChecksCanFail) {
  const auto has = [](const std::string& text, const char* what) {
    return text.find(what) != text.npos;
  };
  EXPECT_TRUE(has(failures_of(check_null<LeakyNull>), "the null effect changes signals"));
  EXPECT_TRUE(has(failures_of(check_numbers<OutOfBounds>), "nominal"));
  EXPECT_TRUE(has(failures_of(check_bounded<OutOfBounds>), "signals out of bounds"));
  EXPECT_TRUE(has(failures_of(check_dissipative<Driving>), "puts energy into the motion"));
  EXPECT_TRUE(has(failures_of(check_derivative<BlindToVelocity>), "output 0"));
  EXPECT_TRUE(has(failures_of(check_derivative<Forgetful>), "output 0"));
  EXPECT_TRUE(has(failures_of([] { check_text<LeakyNull>({}); }), "does not exist: coulomb"));
  EXPECT_EQ(failures_of([] { check_text<LeakyNull>({"coulomb"}); }), "");
}

}  // namespace
}  // namespace vcnc::worked_example_test
