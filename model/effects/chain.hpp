// The active effects of a machine at one port, in the order of the list.
//
// A chain is built once; null effects are left out of it, so an ideal machine pays nothing. Then
// step() runs every effect on the signal: no allocation, no branch on what is active. Effects that
// add the same at all times (`constant`) are summed up beforehand; what multiplies their terms
// comes after them in the list.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "model/effects/effects.hpp"

namespace vcnc {

/// Runs one step of an effect at T, whatever it takes: state and seat are optional.
template <class T, class Effect, class State>
void step_effect(const Effect& effect, typename Effect::Port::template Signal<T>& signal,
                 const typename Effect::Port::template Context<T>& context, State& state,
                 const Seat& seat) {
  if constexpr (requires { effect.step(signal, context, state, seat); })
    effect.step(signal, context, state, seat);
  else if constexpr (requires { effect.step(signal, context, state); })
    effect.step(signal, context, state);
  else if constexpr (requires { effect.step(signal, context, seat); })
    effect.step(signal, context, seat);
  else
    effect.step(signal, context);
}

/// The memory of an effect at T; an empty struct for one without.
struct NoState {};
template <class Effect, class T>
struct StateOfEffect {
  using type = NoState;
};
template <class Effect, class T>
requires requires { typename Effect::template State<T>; }
struct StateOfEffect<Effect, T> {
  using type = typename Effect::template State<T>;
};
template <class Effect, class T>
using EffectState = typename StateOfEffect<Effect, T>::type;

template <class Port>
class Chain {
 public:
  using Signal = typename Port::template Signal<double>;
  using Context = typename Port::template Context<double>;

  bool empty() const { return stages_.empty() && !some_constant_; }

  /// What constant effects add; nothing at a port that has none.
  const Signal& constant() const { return constant_; }
  /// Whether others do something.
  bool varies() const { return !stages_.empty(); }

  /// Whether some effect depends on what was before.
  bool remembers() const {
    for (const auto& stage : stages_)
      if (stage->remembers()) return true;
    return false;
  }

  void step(Signal& signal, const Context& context) {
    if constexpr (requires { signal += signal; }) signal += constant_;
    vary(signal, context);
  }
  /// All but the constant ones.
  void vary(Signal& signal, const Context& context) {
    for (const auto& stage : stages_) stage->step(signal, context);
  }

  template <class Effect>
  void add(const Effect& effect, const Seat& seat) {
    if constexpr (requires { Effect::constant; }) {
      NoState none;
      step_effect<double>(effect, constant_, Context{}, none, seat);
      some_constant_ = true;
    } else {
      stages_.push_back(std::make_unique<EffectStage<Effect>>(effect, seat));
    }
  }
  /// A law; what y does at this port is law_step(port, signal, context, axis, y).
  void add(const Law& law) { stages_.push_back(std::make_unique<LawStage>(law)); }

 private:
  struct Stage {
    virtual ~Stage() = default;
    virtual void step(Signal&, const Context&) = 0;
    virtual bool remembers() const = 0;
  };
  template <class Effect>
  struct EffectStage final : Stage {
    EffectStage(const Effect& e, const Seat& s) : effect(e), seat(s) {}
    void step(Signal& signal, const Context& context) override {
      step_effect<double>(effect, signal, context, state, seat);
    }
    bool remembers() const override {
      return !std::is_same_v<EffectState<Effect, double>, NoState>;
    }
    Effect effect;
    Seat seat;
    EffectState<Effect, double> state{};
  };
  struct LawStage final : Stage {
    explicit LawStage(const Law& l) : law(l) {}
    void step(Signal& signal, const Context& context) override { apply_law(law, signal, context); }
    bool remembers() const override { return false; }
    Law law;
  };

  Signal constant_{};
  bool some_constant_ = false;
  std::vector<std::unique_ptr<Stage>> stages_;
};

// What a law does at each of the ports that take one.
constexpr bool takes(Law::Point p, const SetpointPort*) {
  return p == Law::Point::command || p == Law::Point::command_time;
}
constexpr bool takes(Law::Point p, const MotorForcePort*) { return p == Law::Point::motor_force; }
constexpr bool takes(Law::Point p, const LoadForcePort*) { return p == Law::Point::table_force; }
constexpr bool takes(Law::Point p, const DisplacementPort*) {
  return p == Law::Point::displacement;
}
constexpr bool takes(Law::Point p, const ReadingPort*) { return p == Law::Point::reading; }
constexpr bool takes(Law::Point, const void*) { return false; }

inline void apply_law(const Law& law, SetpointPort::Signal<double>& s,
                      const SetpointPort::Context<double>& c) {
  const double y = law(c.moment.t, *c.axes);
  if (law.point == Law::Point::command) {
    s.position += y;
  } else {  // later by y
    s.position -= y * s.velocity - 0.5 * y * y * c.acceleration;
    s.velocity -= y * c.acceleration;
  }
}
inline void apply_law(const Law& law, MotorForcePort::Signal<double>& s,
                      const MotorForcePort::Context<double>& c) {
  s.force += law(c.moment.t, *c.axes);
}
inline void apply_law(const Law& law, LoadForcePort::Signal<double>& s,
                      const LoadForcePort::Context<double>& c) {
  s.force += law(c.moment.t, *c.axes);
}
inline void apply_law(const Law& law, DisplacementPort::Signal<double>& s,
                      const DisplacementPort::Context<double>& c) {
  s.displacement += law(c.moment.t, *c.axes);
}
inline void apply_law(const Law& law, ReadingPort::Signal<double>& s,
                      const ReadingPort::Context<double>& c) {
  s.deflection[static_cast<Eigen::Index>(law.axis_index())] += law(c.moment.t, *c.axes);
}
template <class Signal, class Context>
void apply_law(const Law&, Signal&, const Context&) {}  // no law is ever added to these ports

/// The chain of one axis at a port.
template <class Port>
Chain<Port> axis_chain(const Effects& effects, std::size_t axis, std::uint64_t seed) {
  Chain<Port> chain;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (of_axis(Effect::place) && std::is_same_v<typename Effect::Port, Port>) {
      const Effect& effect = effects.axis[axis].get<Effect>();
      if (fits(Effect::place, is_rotary(axis)) && (effects.simulate_null || !effect.null()))
        chain.add(effect, Seat{axis, is_rotary(axis), NoiseStream(seed, Effect::text.name, axis)});
    }
  });
  for (const Law& law : effects.laws)
    if (law.axis_index() == axis && takes(law.point, static_cast<const Port*>(nullptr)))
      chain.add(law);
  return chain;
}

/// The chain of the whole machine at a port: effects of all axes, of the machine, and laws.
template <class Port>
Chain<Port> machine_chain(const Effects& effects, std::uint64_t seed) {
  Chain<Port> chain;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (std::is_same_v<typename Effect::Port, Port>) {
      if constexpr (of_axis(Effect::place)) {
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
          const Effect& effect = effects.axis[axis].get<Effect>();
          if (fits(Effect::place, is_rotary(axis)) && (effects.simulate_null || !effect.null()))
            chain.add(effect,
                      Seat{axis, is_rotary(axis), NoiseStream(seed, Effect::text.name, axis)});
        }
      } else {
        const Effect& effect = effects.get<Effect>();
        if (effects.simulate_null || !effect.null())
          chain.add(effect, Seat{0, false, NoiseStream(seed, Effect::text.name, kAxisCount)});
      }
    }
  });
  for (const Law& law : effects.laws)
    if (takes(law.point, static_cast<const Port*>(nullptr))) chain.add(law);
  return chain;
}

}  // namespace vcnc
