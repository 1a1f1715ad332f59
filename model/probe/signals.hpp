// From a deflection to converter codes and back: one channel of the probe and its acquisition.
//
//   phase      phi = 2 pi x / signal period
//   signals    u = R cos phi,  w = R sin phi,  R = 0.5 V (1 Vpp), and what effects make of them
//   front end  V = 1.65 V + 2.5 u
//   ADC        code = round(V / q) clamped to 0 .. 2^N - 1,  q = 3.3 V / 2^N, N = 12 or 16; both
//              signals at one instant
//   phase      phi^ = atan2(w', u'), with or without the correction of model/probe/heydemann.hpp
//   unwrap     sum of the steps d = wrap(phi^_k - phi^_k-1);  x^ = sum * period / 2 pi
//
// The count is free of slips while |x'| < period / (2 * 100 us), 100 mm/s at 20 um; half of that is
// the design limit. A slip is flagged and stays flagged, never repaired: |d| > 0.8 pi, a step that
// differs from the last one by more than pi / 2, a signal amplitude outside 0.6 .. 1.4 of R1, or a
// free probe that does not read zero (check_zero).
// After every sample both converters convert two known voltages of the module's own, 0.5 V apart; a
// code further than 1/64 of the range from what it must be is a fault. So a frozen converter is
// found in the sample in which it freezes, whether the probe moves or not: its one code cannot be
// both. Source: usual self-test of acquisition modules (test of analogue inputs, IEC 60730-1 annex
// H).
// Resolution: one code is 1 / 1551 rad or 2.05 nm of 20 um with 12 bits, 0.13 nm with 16 bits.
// Not modelled: anti-alias filter, integral non-linearity, noise, jitter and
// crosstalk come from effects (AnaloguePort, DeflectionPort).
// Source: 1 Vpp interface of scales and probes; converter data of STM32F4/H7 class parts.
#pragma once

#include <cstdint>

#include "model/effects/chain.hpp"
#include "model/machine.hpp"
#include "model/probe/heydemann.hpp"

namespace vcnc {

/// Front end and converter.
struct Adc {
  int bits = 16;
  static constexpr double kReference = 3.3, kMiddle = 1.65, kGain = 2.5;

  double lsb() const;                       ///< [V] at the converter
  std::uint16_t code(double signal) const;  ///< signal [V] before the front end
  double signal(std::uint16_t code) const;
  bool clipped(std::uint16_t code) const;
};

/// Counts periods. Positions in radians of the signal.
class Unwrapper {
 public:
  /// Adds the next phase in (-pi, pi]; the first one is taken as it is.
  double step(double phase);
  double total() const { return total_; }
  bool slipped() const { return slipped_; }
  /// Starts anew: the next phase is taken as it is.
  void reset() { *this = {}; }

 private:
  double phase_ = 0, total_ = 0, last_step_ = 0;
  int seen_ = 0;
  bool slipped_ = false;
};

struct ChannelSample {
  std::uint16_t cos_code = 0, sin_code = 0;
  double deflection = 0;  ///< what the module makes of them [m]
  bool slip = false;      ///< periods were lost at some time since the last zero
  bool fault = false;     ///< amplitude, converter at its end or self-test failed, now
};

/// What is broken in a channel: both signals at mid voltage, a converter that repeats its last
/// codes, or one at its end.
enum class ChannelFault { none, wire_break, stuck, saturated };

/// One of the three channels x, y, z. Call sample() every 100 us.
class SignalChannel {
 public:
  /// `component` 0, 1, 2; `effects` are those on the analogue signals.
  SignalChannel(const ProbeParams& probe, int component, Chain<AnaloguePort> effects = {});

  ChannelSample sample(double true_deflection);

  void suffer(ChannelFault fault) { fault_ = fault; }  ///< from now on
  /// Whole periods that are counted wrong from now on.
  void miscount(int periods) { miscounted_ = periods; }

  /// For a probe known to be free: whole periods that the reading is off (0: none); flags a slip
  /// otherwise.
  int check_zero();
  /// Takes the probe to be free now and starts counting from there; clears the slip.
  void set_zero() {
    unwrapper_.reset();
    check_slip_ = false;
  }

 private:
  bool converts(bool frozen) const;

  double period_;
  Adc adc_;
  ProbeParams::Correction correction_;
  Chain<AnaloguePort> effects_;
  int component_;
  std::int64_t samples_ = 0;
  ChannelFault fault_ = ChannelFault::none;
  int miscounted_ = 0;                         ///< periods
  std::uint16_t last_cos_ = 0, last_sin_ = 0;  ///< codes
  OnlineCorrector corrector_;
  Unwrapper unwrapper_;
  bool check_slip_ = false;  ///< a zero check or the amplitude found a slip
};

}  // namespace vcnc
