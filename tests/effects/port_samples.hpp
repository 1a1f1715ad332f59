// Random signals and contexts of every port, of the size they have in a machine.
//
// PortSamples<Port> knows the scalars of a port: `scalars(signal or context, f, rotary)` calls
// f(value, span) for each, where the span says between what bounds the value lies and what nothing
// may exceed, whatever effects act, each with one parameter at its bound. From that come random
// samples, comparison bit by bit, sanity bounds and derivatives.
//
// A Sample owns everything a step needs, the motions of all axes included.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include "model/effects/port_list.hpp"

namespace vcnc {

/// Between what bounds a scalar of a port lies, and what no effect may carry it beyond.
struct Span {
  double low, high;
  double least, most;
};
inline Span within(double size, double limit) { return {-size, size, -limit, limit}; }
/// Of a quantity that is never negative.
inline Span positive(double low, double high, double limit) { return {low, high, 0, limit}; }

/// Numbers that are the same with every standard library.
class Draw {
 public:
  explicit Draw(std::uint32_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) + 0.5) / 4294967296.0;
  }

 private:
  std::mt19937 random_;
};

template <class V, class F>
void each_component(V& v, F&& f, const Span& span) {
  for (int i = 0; i < 3; ++i) f(v[i], span);
}

/// Of all ports that have one: motions of the axes.
template <class Axes, class F>
void each_motion(Axes& axes, F&& f) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double scale = is_rotary(i) ? 3 : 0.4;  // [rad] or [m]
    f(axes[i].position, within(scale, 0));
    f(axes[i].velocity, within(scale, 0));
    f(axes[i].acceleration, within(10 * scale, 0));
  }
}

inline Span position_span(bool rotary) { return within(rotary ? 3 : 0.4, 100); }
inline Span velocity_span(bool rotary) { return within(rotary ? 3 : 0.5, 1e4); }
inline Span force_span(bool rotary) { return within(rotary ? 400 : 2e4, 1e9); }

template <class Port>
struct PortSamples;

template <>
struct PortSamples<PlanPort> {
  static constexpr double kStep = 0;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    f(s.blend_tolerance, positive(0, 1e-4, 1));
    f(s.sagitta, positive(0, 1e-4, 1));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<InterpolationPort> {
  static constexpr double kStep = 1e-3;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      f(s.position[i], position_span(is_rotary(i)));
      f(s.velocity[i], velocity_span(is_rotary(i)));
    }
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<ReceptionPort> {
  static constexpr double kStep = 1e-3;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.position, position_span(rotary));
    f(s.velocity, velocity_span(rotary));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<SetpointPort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.position, position_span(rotary));
    f(s.velocity, velocity_span(rotary));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.acceleration, within(rotary ? 30 : 5, 0));
  }
};

template <>
struct PortSamples<ServoPort> {
  static constexpr double kStep = 0;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.kv, positive(10, 100, 1e6));
    f(s.velocity_gain, positive(0.5, 1.5, 1e3));
    f(s.integral_time, Span{2e-3, 0.1, 1e-6, 1e4});  // the loop divides by it
    f(s.velocity_ff, within(1, 1e3));
    f(s.acceleration_ff, within(1, 1e3));
    f(s.current_lag, positive(0, 1e-3, 10));
    f(s.force_limit, positive(rotary ? 100 : 1e4, rotary ? 1000 : 5e4, 1e9));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<EncoderPort> {
  static constexpr double kStep = 0;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.position, position_span(rotary));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.velocity, velocity_span(rotary));
    f(c.acceleration, within(rotary ? 30 : 4, 0));
  }
};

template <>
struct PortSamples<MotorForcePort> {
  static constexpr double kStep = 50e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.force, force_span(rotary));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.position, position_span(rotary));
    f(c.velocity, velocity_span(rotary));
  }
};

template <>
struct PortSamples<TransmissionPort> {
  static constexpr double kStep = 0;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.gap, positive(0, 1e-4, 1));
    f(s.compliance, positive(0, rotary ? 1e-5 : 1e-7, 1));
    f(s.damping_ratio, positive(0.01, 0.5, 10));
    f(s.lead, within(1e-4, 1));
    f(s.wave, within(1e-6, 1));
    f(s.wave_period, positive(1e-3, 1, 1e6));
    f(s.wave_phase, within(3, 10));
    f(s.motor_dry, positive(0, rotary ? 10 : 500, 1e9));
    f(s.motor_viscous, positive(0, rotary ? 10 : 5000, 1e9));
    f(s.motor_stiffness, positive(0, rotary ? 1e6 : 1e8, 1e17));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<LoadForcePort> {
  static constexpr double kStep = 50e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.force, force_span(rotary));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.position, position_span(rotary));
    f(c.velocity, velocity_span(rotary));
  }
};

template <>
struct PortSamples<FrictionPort> {
  static constexpr double kStep = 50e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.dry, positive(0, rotary ? 20 : 1000, 1e8));
    f(s.viscous, positive(0, rotary ? 20 : 5000, 1e15));
    f(s.stiffness, positive(0, rotary ? 1e6 : 1e8, 1e17));
    f(s.damping, positive(0, rotary ? 100 : 1e5, 1e10));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.position, position_span(rotary));
    f(c.velocity, velocity_span(rotary));
  }
};

template <>
struct PortSamples<DisplacementPort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool rotary) {
    f(s.displacement, within(rotary ? 1e-4 : 1e-4, 10));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool rotary) {
    f(c.load.position, position_span(rotary));
    f(c.load.velocity, velocity_span(rotary));
    f(c.load.acceleration, within(rotary ? 30 : 5, 0));
    f(c.force, force_span(rotary));
  }
};

template <>
struct PortSamples<PosePort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    const Span length = within(1e-4, 10), angle = within(1e-3, 10);
    each_component(s.tip, f, length);
    each_component(s.tool_turn, f, angle);
    f(s.tool_longer, length);
    each_component(s.a_shift, f, length);
    each_component(s.a_tilt, f, angle);
    each_component(s.c_shift, f, length);
    each_component(s.c_tilt, f, angle);
    each_component(s.piece_shift, f, length);
    each_component(s.piece_tilt, f, angle);
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool) {
    each_motion(c.axes, f);
    for (auto& arm : c.arm) each_component(arm, f, within(0.5, 0));
  }
};

template <>
struct PortSamples<TouchPort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    f(s.radius, within(3e-3, 0.1));
    f(s.friction, positive(0, 0.2, 10));
    f(s.return_to_zero, positive(0, 2e-6, 1e-2));
    f(s.lifted, positive(0, 0.4, 10));
  }
  template <class C, class F>
  static void context(C& c, F&& f, bool) {
    each_component(c.normal_T, f, within(1, 0));
    each_component(c.normal_W, f, within(1, 0));
  }
};

template <>
struct PortSamples<DeflectionPort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    each_component(s.deflection, f, within(1e-3, 1));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<AnaloguePort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    f(s.cosine, within(0.5, 100));
    f(s.sine, within(0.5, 100));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

template <>
struct PortSamples<ReadingPort> {
  static constexpr double kStep = 100e-6;
  template <class S, class F>
  static void signal(S& s, F&& f, bool) {
    each_component(s.deflection, f, within(1e-3, 1));
  }
  template <class C, class F>
  static void context(C&, F&&, bool) {}
};

/// One step's worth of inputs.
template <class Port, class T>
struct Sample {
  typename Port::template Signal<T> signal{};
  typename Port::template Context<T> context{};
  Motions<T> axes{};

  Sample() = default;
  Sample(const Sample& other) { *this = other; }
  Sample& operator=(const Sample& other) {
    signal = other.signal;
    context = other.context;
    axes = other.axes;
    if constexpr (requires { *context.axes; }) context.axes = &axes;
    return *this;
  }

  /// Calls f(value, span) for every scalar of signal and context.
  template <class F>
  void inputs(F&& f, bool rotary) {
    PortSamples<Port>::signal(signal, f, rotary);
    PortSamples<Port>::context(context, f, rotary);
    if constexpr (requires { *context.axes; }) each_motion(axes, f);
  }
  template <class F>
  void outputs(F&& f, bool rotary) {
    PortSamples<Port>::signal(signal, f, rotary);
  }
  /// What is not T: the moment of step `count` and the constants of the port.
  void constants(std::int64_t count, bool rotary) {
    constexpr double dt = PortSamples<Port>::kStep;
    if constexpr (requires { context.moment; })
      context.moment = {static_cast<double>(count) * dt, dt, count};
    if constexpr (requires { context.travel_per_turn; }) {
      context.travel_per_turn = rotary ? 2 * kPi / 20 : 0.012;
      context.force_limit = rotary ? 500 : 4e4;
    }
    if constexpr (requires { context.spring_rate; }) context.spring_rate = 1324;
    if constexpr (requires { context.of_load; }) context.of_load = count % 2 != 0;
    if constexpr (requires { context.channel; }) {
      context.channel = static_cast<int>(count % 3);
      context.amplitude = 0.5;
    }
    if constexpr (requires { context.period; }) context.period = 20e-6;
    if constexpr (requires { *context.axes; }) context.axes = &axes;
  }
};

/// A random sample for step `count`.
template <class Port>
Sample<Port, double> random_sample(Draw& draw, std::int64_t count, bool rotary) {
  Sample<Port, double> sample;
  sample.inputs([&](double& x, const Span& span) { x = draw.between(span.low, span.high); },
                rotary);
  sample.constants(count, rotary);
  if constexpr (std::is_same_v<Port, TouchPort>) {
    sample.context.normal_T.normalize();
    sample.context.normal_W.normalize();
  }
  if constexpr (std::is_same_v<Port, TouchPort>) sample.signal.radius = 3e-3;
  return sample;
}

template <class Port, class T>
std::vector<T> outputs_of(Sample<Port, T>& sample, bool rotary) {
  std::vector<T> all;
  sample.outputs([&](T& x, const Span&) { all.push_back(x); }, rotary);
  return all;
}

}  // namespace vcnc
