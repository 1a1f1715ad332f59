// What every effect promises, as checks for one effect type; `rotary` matters to Place::axis only.
//
//   check_text          what people read is complete and well-formed
//   check_numbers       keys, units, bounds; default is null, nominal is not and is within bounds
//   check_null          with default parameters no signal changes a bit
//   check_bounded       finite and of sane size, at nominal and with each parameter at each bound
//   check_dissipative   where claimed: it only takes energy away
//   check_derivative    a step and a sequence of steps: dual numbers against finite differences
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "model/effects/chain.hpp"
#include "model/effects/numbers.hpp"
#include "tests/effects/dual.hpp"
#include "tests/effects/port_samples.hpp"

namespace vcnc {

inline Seat seat_of(std::string_view name, bool rotary) {
  return {rotary ? kA : kX, rotary, NoiseStream(7, name, rotary ? kA : kX)};
}

/// Calls f(rotary) for linear and rotary where the effect may be.
template <class Effect, class F>
void for_each_kind(F&& f) {
  for (const bool rotary : {false, true}) {
    if (of_axis(Effect::place) ? !fits(Effect::place, rotary) : rotary) continue;
    SCOPED_TRACE(rotary ? "rotary" : "linear");
    f(rotary);
  }
}

// ------------------------------------------------------------------------------------ text

/// Plain ASCII. A text written as lines has lines of at most 100 columns; a single one is broken
/// where it is printed, but for an equation.
inline void check_block(std::string_view what, std::string_view text, bool breakable = true) {
  ASSERT_FALSE(text.empty()) << what;
  const bool lines = !breakable || text.find('\n') != text.npos;
  std::size_t column = 0, longest = 0;
  for (const char c : text) {
    EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << what << ": not plain ASCII: " << text;
    column = c == '\n' ? 0 : column + 1;
    longest = std::max(longest, column);
  }
  if (lines) {
    EXPECT_LE(longest, 100u) << what << ": " << text;
  }
  EXPECT_NE(text.front(), '\n') << what;
  EXPECT_NE(text.back(), '\n') << what;
  EXPECT_EQ(text.find('`'), text.npos) << what << ": a back-tick breaks the generated page";
}

/// Name of a file and key: letters, digits and single underscores.
inline bool snake_case(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  if (name.empty() || !letter(name.front()) || name.back() == '_') return false;
  for (const char c : name)
    if (!letter(c) && !(c >= '0' && c <= '9') && c != '_') return false;
  return name.find("__") == name.npos;
}

/// `known` are the names of the library; an effect may only be confused with those.
template <class Effect>
void check_text(const std::set<std::string>& known) {
  const EffectText& t = Effect::text;
  EXPECT_TRUE(snake_case(t.name));
  check_block("title", t.title);
  check_block("brief", t.brief);
  check_block("equation", t.equation, false);
  check_block("validity", t.validity);
  check_block("source", t.source);
  check_block("signature", t.signature);
  check_block("confusable", t.confusable);
  check_block("separate", t.separate);
  for (const std::string_view one_line : {t.title, t.brief})
    EXPECT_TRUE(one_line.find_first_of("\n|") == one_line.npos && one_line.size() <= 100)
        << "one line of at most 100 columns, no bar: " << one_line;
  std::string others(t.confusable);
  while (!others.empty()) {
    const std::string other = others.substr(0, others.find(' '));
    others.erase(0, std::min(other.size() + 1, others.size()));
    EXPECT_TRUE(known.contains(other)) << "confusable with what does not exist: " << other;
    EXPECT_NE(other, t.name);
  }
}

// --------------------------------------------------------------------------------- numbers

inline bool in_range(double si, const EffectNumber& n) {
  const double v = si / n.unit.to_si, slack = 1e-12 * std::abs(v);
  return v >= n.range.min - slack && v <= n.range.max + slack;
}

template <class Effect>
void check_numbers() {
  for_each_kind<Effect>([](bool rotary) {
    Effect by_default, nominal = nominal_of<Effect>(rotary);
    EXPECT_TRUE(by_default.null());
    EXPECT_FALSE(nominal.null());
    const auto defaults = numbers_of(by_default, rotary), typical = numbers_of(nominal, rotary);
    ASSERT_FALSE(typical.empty());
    std::set<std::string> keys;
    for (std::size_t i = 0; i < typical.size(); ++i) {
      const EffectNumber& n = typical[i];
      SCOPED_TRACE(n.key);
      EXPECT_TRUE(keys.insert(n.key).second) << "twice";
      EXPECT_FALSE(n.doc.empty());
      EXPECT_EQ(n.doc.find('|'), n.doc.npos) << "breaks the generated table";
      EXPECT_LT(n.range.min, n.range.max);
      EXPECT_TRUE(std::isfinite(n.range.min) && std::isfinite(n.range.max));
      EXPECT_TRUE(n.unit.suffix.empty() || n.key.ends_with(fmt::format("_{}", n.unit.suffix)))
          << "must end in its unit, " << n.unit.suffix;
      for (int c = 0; c < n.size(); ++c) {
        EXPECT_TRUE(in_range(n.get(c), n)) << "nominal";
        EXPECT_TRUE(in_range(defaults[i].get(c), n)) << "default";
      }
    }
  });
}

// ------------------------------------------------------------------------------------ steps

/// A smooth course of all inputs over time, of the size and speed of real ones.
template <class Port>
class SmoothCourse {
 public:
  SmoothCourse(Draw& draw, bool rotary) : rotary_(rotary) {
    Sample<Port, double> sample;
    sample.inputs(
        [&](double&, const Span&) {
          waves_.push_back({draw.between(-kPi, kPi), draw.between(1e-3, 0.3)});
        },
        rotary);
  }
  Sample<Port, double> operator()(std::int64_t count) const {
    Sample<Port, double> sample;
    auto wave = waves_.begin();
    sample.inputs(
        [&](double& x, const Span& span) {
          const double phase = wave->phase + wave->speed * static_cast<double>(count);
          x = span.low + (span.high - span.low) * (0.5 + 0.5 * std::sin(phase));
          ++wave;
        },
        rotary_);
    sample.constants(count, rotary_);
    return sample;
  }

 private:
  struct Wave {
    double phase, speed;
  };
  std::vector<Wave> waves_;
  bool rotary_;
};

/// 1000 samples, random or along a smooth course.
template <class Effect, class F>
void for_each_sample(bool rotary, std::uint32_t seed, F&& f) {
  using Port = typename Effect::Port;
  Draw draw(seed);
  const SmoothCourse<Port> course(draw, rotary);
  for (std::int64_t k = 0; k < 1000; ++k)
    f(k < 500 ? course(k) : random_sample<Port>(draw, k, rotary));
}

template <class Effect>
void check_null() {
  using Port = typename Effect::Port;
  for_each_kind<Effect>([](bool rotary) {
    const Effect effect;
    const Seat seat = seat_of(Effect::text.name, rotary);
    EffectState<Effect, double> state{};
    std::size_t changed = 0;
    for_each_sample<Effect>(rotary, 1, [&](Sample<Port, double> sample) {
      const std::vector<double> before = outputs_of(sample, rotary);
      step_effect<double>(effect, sample.signal, sample.context, state, seat);
      const std::vector<double> after = outputs_of(sample, rotary);
      for (std::size_t i = 0; i < before.size(); ++i)
        changed +=
            std::bit_cast<std::uint64_t>(before[i]) != std::bit_cast<std::uint64_t>(after[i]);
    });
    EXPECT_EQ(changed, 0u) << "the null effect changes signals";
  });
}

/// Runs the effect over many samples; every output must stay finite and within the port's bounds.
template <class Effect>
void expect_bounded(const Effect& effect, bool rotary) {
  using Port = typename Effect::Port;
  const Seat seat = seat_of(Effect::text.name, rotary);
  EffectState<Effect, double> state{};
  std::size_t wild = 0;
  double example = 0;
  for_each_sample<Effect>(rotary, 2, [&](Sample<Port, double> sample) {
    step_effect<double>(effect, sample.signal, sample.context, state, seat);
    sample.outputs(
        [&](const double& x, const Span& span) {
          if (std::isfinite(x) && x >= span.least && x <= span.most) return;
          ++wild;
          example = x;
        },
        rotary);
  });
  EXPECT_EQ(wild, 0u) << "signals out of bounds, such as " << example;
}

template <class Effect>
void check_bounded() {
  for_each_kind<Effect>([](bool rotary) {
    Effect effect = nominal_of<Effect>(rotary);
    expect_bounded(effect, rotary);
    for (std::size_t i = 0; i < numbers_of(effect, rotary).size(); ++i) {
      for (int c = 0; c < numbers_of(effect, rotary)[i].size(); ++c) {
        for (const bool upper : {false, true}) {
          effect = nominal_of<Effect>(rotary);
          const EffectNumber n = numbers_of(effect, rotary)[i];
          SCOPED_TRACE(n.key + (upper ? " at its upper bound" : " at its lower bound"));
          n.set(c, upper ? n.range.max : n.range.min);
          expect_bounded(effect, rotary);
        }
      }
    }
  });
}

/// Power that the effect puts into the motion [W]; nothing where the port has no power.
template <class Signal, class Context>
double power(const FrictionPort*, const Signal&, const Signal& after, const Context& context) {
  const double v = context.velocity;
  return -(after.dry * std::abs(v) + after.viscous * v * v);
}
template <class Signal, class Context>
double power(const LoadForcePort*, const Signal& before, const Signal& after,
             const Context& context) {
  return (after.force - before.force) * context.velocity;
}
template <class Signal, class Context>
double power(const MotorForcePort*, const Signal& before, const Signal& after,
             const Context& context) {
  return (after.force - before.force) * context.velocity;
}

template <class Effect>
void check_dissipative() {
  using Port = typename Effect::Port;
  if constexpr (requires { Effect::dissipative; }) {
    static_assert(Effect::dissipative);
    for_each_kind<Effect>([](bool rotary) {
      const Effect effect = nominal_of<Effect>(rotary);
      const Seat seat = seat_of(Effect::text.name, rotary);
      EffectState<Effect, double> state{};
      std::size_t driving = 0, below_zero = 0;
      for_each_sample<Effect>(rotary, 3, [&](Sample<Port, double> sample) {
        const auto before = sample.signal;
        step_effect<double>(effect, sample.signal, sample.context, state, seat);
        const Port* port = nullptr;
        driving += power(port, before, sample.signal, sample.context) > 0;
        if constexpr (std::is_same_v<Port, FrictionPort>)
          sample.outputs([&](double& x, const Span&) { below_zero += x < 0; }, rotary);
      });
      EXPECT_EQ(driving, 0u) << "it puts energy into the motion";
      EXPECT_EQ(below_zero, 0u) << "friction terms below zero";
    });
  }
}

// ------------------------------------------------------------------------------ derivatives

template <class Port>
Sample<Port, Dual> dual_sample(Sample<Port, double> values, const std::vector<double>& direction,
                               std::int64_t count, bool rotary) {
  std::vector<double> all;
  values.inputs([&](double& x, const Span&) { all.push_back(x); }, rotary);
  Sample<Port, Dual> sample;
  std::size_t i = 0;
  sample.inputs(
      [&](Dual& x, const Span&) {
        x = {all[i], direction[i]};
        ++i;
      },
      rotary);
  sample.constants(count, rotary);
  return sample;
}

template <class Port>
Sample<Port, double> moved(Sample<Port, double> sample, const std::vector<double>& direction,
                           double by, bool rotary) {
  std::size_t i = 0;
  sample.inputs([&](double& x, const Span&) { x += by * direction[i++]; }, rotary);
  return sample;
}

/// Relative size of a difference, and of what two differences may disagree by off kinks.
inline constexpr double kDifference = 1e-8, kAgreement = 1e-4;

/// Compares derivatives along a direction with central differences of two step sizes. `run(by)`
/// gives the outputs with the inputs moved by `by`. A point where the two differences disagree is
/// a kink: returns false.
template <class Run>
bool same_derivative(const std::vector<Dual>& outputs, double scale, Run&& run) {
  const double h = kDifference;
  const std::vector<double> up = run(h), down = run(-h), up2 = run(2 * h), down2 = run(-2 * h);
  for (std::size_t j = 0; j < outputs.size(); ++j) {
    const double size = std::abs(up[j]) + std::abs(down[j]) + scale;
    const double rounding = 32 * std::numeric_limits<double>::epsilon() * size / h;
    const double fine = (up[j] - down[j]) / (2 * h), coarse = (up2[j] - down2[j]) / (4 * h);
    if (std::abs(fine - coarse) > kAgreement * std::abs(fine) + rounding) return false;
    // Equal values: the derivative is zero but for what a double can hold (a saturated tanh).
    const double unseen = std::numeric_limits<double>::epsilon() * size / h;
    const bool changes = up[j] != down[j];
    EXPECT_NEAR(outputs[j].d, fine, kAgreement * std::abs(fine) + (changes ? rounding : unseen))
        << "output " << j;
  }
  return true;
}

/// One step, with respect to each scalar of signal and context in turn.
template <class Effect>
void check_step_derivative(bool rotary) {
  using Port = typename Effect::Port;
  const Effect effect = nominal_of<Effect>(rotary);
  const Seat seat = seat_of(Effect::text.name, rotary);
  Draw draw(4);
  int counted = 0, points = 0;
  for (std::int64_t k = 0; k < 40 && !testing::Test::HasFailure(); ++k) {
    const Sample<Port, double> sample = random_sample<Port>(draw, k, rotary);
    std::vector<Span> spans;
    Sample<Port, double>(sample).inputs([&](double&, const Span& span) { spans.push_back(span); },
                                        rotary);
    for (std::size_t i = 0; i < spans.size(); ++i) {
      std::vector<double> direction(spans.size(), 0);
      direction[i] = spans[i].high - spans[i].low;
      Sample<Port, Dual> dual = dual_sample(sample, direction, k, rotary);
      EffectState<Effect, Dual> dual_state{};
      step_effect<Dual>(effect, dual.signal, dual.context, dual_state, seat);
      const auto run = [&](double by) {
        Sample<Port, double> at = moved(sample, direction, by, rotary);
        EffectState<Effect, double> state{};
        step_effect<double>(effect, at.signal, at.context, state, seat);
        return outputs_of(at, rotary);
      };
      const std::vector<Dual> outputs = outputs_of(dual, rotary);
      const std::vector<double> plain = run(0);
      for (std::size_t j = 0; j < plain.size(); ++j)
        EXPECT_NEAR(outputs[j].v, plain[j], 1e-12 * std::abs(plain[j])) << "value, output " << j;
      SCOPED_TRACE(fmt::format("input {}, sample {}", i, k));
      ++points;
      counted += same_derivative(outputs, 0, run);
    }
  }
  EXPECT_GE(2 * counted, points) << "kinks nearly everywhere";
}

/// A sequence of steps from a fresh state, with respect to all its inputs along a random direction.
template <class Effect>
void check_sequence_derivative(bool rotary) {
  using Port = typename Effect::Port;
  const Effect effect = nominal_of<Effect>(rotary);
  const Seat seat = seat_of(Effect::text.name, rotary);
  Draw draw(5);
  int counted = 0, points = 0;
  for (const std::int64_t steps : {2, 5, 12, 40, 40, 40, 150, 150}) {
    const SmoothCourse<Port> course(draw, rotary);
    std::vector<std::vector<double>> directions(static_cast<std::size_t>(steps));
    for (auto& direction : directions) {
      Sample<Port, double> any;
      any.inputs(
          [&](double&, const Span& span) {
            direction.push_back((span.high - span.low) * draw.between(-1, 1));
          },
          rotary);
    }
    Sample<Port, Dual> last;
    EffectState<Effect, Dual> dual_state{};
    for (std::int64_t k = 0; k < steps; ++k) {
      last = dual_sample(course(k), directions[static_cast<std::size_t>(k)], k, rotary);
      step_effect<Dual>(effect, last.signal, last.context, dual_state, seat);
    }
    const auto run = [&](double by) {
      Sample<Port, double> at;
      EffectState<Effect, double> state{};
      for (std::int64_t k = 0; k < steps; ++k) {
        at = moved(course(k), directions[static_cast<std::size_t>(k)], by, rotary);
        step_effect<double>(effect, at.signal, at.context, state, seat);
      }
      return outputs_of(at, rotary);
    };
    SCOPED_TRACE(fmt::format("{} steps", steps));
    ++points;
    counted += same_derivative(outputs_of(last, rotary), 0, run);
  }
  EXPECT_GE(2 * counted, points) << "kinks nearly everywhere";
}

template <class Effect>
void check_derivative() {
  for_each_kind<Effect>([](bool rotary) {
    check_step_derivative<Effect>(rotary);
    check_sequence_derivative<Effect>(rotary);
  });
}

}  // namespace vcnc
