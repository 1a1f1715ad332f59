#include "model/probe/signals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace vcnc {
namespace {

constexpr double kSampleTime = 100e-6;  // [s]
constexpr double kNominalAmplitude = 0.5;
constexpr double kLeastShare = 0.6, kMostShare = 1.4;  // of the amplitude
constexpr std::array kTestSignals{-0.25, 0.25};        // [V] before the front end
constexpr double kTestTolerance = 1.0 / 64;            // of all codes
constexpr double kLargestStep = 0.8 * kPi, kLargestChange = 0.5 * kPi;

double wrap(double angle) { return angle - 2 * kPi * std::round(angle / (2 * kPi)); }

}  // namespace

double Adc::lsb() const { return kReference / (1u << bits); }

std::uint16_t Adc::code(double signal) const {
  const double most = (1u << bits) - 1;
  return static_cast<std::uint16_t>(
      std::clamp(std::round((kMiddle + kGain * signal) / lsb()), 0.0, most));
}

double Adc::signal(std::uint16_t code) const { return (code * lsb() - kMiddle) / kGain; }

bool Adc::clipped(std::uint16_t code) const { return code == 0 || code == (1 << bits) - 1; }

double Unwrapper::step(double phase) {
  if (seen_ == 0) {
    total_ = phase;
  } else {
    const double d = wrap(phase - phase_);
    if (std::abs(d) > kLargestStep) slipped_ = true;
    if (seen_ > 1 && std::abs(wrap(d - last_step_)) > kLargestChange) slipped_ = true;
    total_ += d;
    last_step_ = d;
  }
  phase_ = phase;
  seen_ = std::min(seen_ + 1, 2);
  return total_;
}

SignalChannel::SignalChannel(const ProbeParams& probe, int component, Chain<AnaloguePort> effects)
    : period_(probe.signal_period),
      adc_{probe.adc_bits},
      correction_(probe.correction),
      effects_(std::move(effects)),
      component_(component) {}

/// The self-test of both converters. One that is not frozen passes: it converts what it is given.
bool SignalChannel::converts(bool frozen) const {
  const double tolerance = kTestTolerance * (1u << adc_.bits);
  return !frozen || std::all_of(kTestSignals.begin(), kTestSignals.end(), [&](double signal) {
    const int expected = adc_.code(signal);
    return std::abs(last_cos_ - expected) <= tolerance &&
           std::abs(last_sin_ - expected) <= tolerance;
  });
}

ChannelSample SignalChannel::sample(double true_deflection) {
  SinCos analogue =
      Lissajous{.amplitude = kNominalAmplitude}.signals(2 * kPi / period_ * true_deflection);
  if (!effects_.empty()) {
    AnaloguePort::Signal<double> signal{analogue.u, analogue.w};
    effects_.step(signal, {{static_cast<double>(samples_) * kSampleTime, kSampleTime, samples_},
                           component_,
                           kNominalAmplitude});
    analogue = {signal.cosine, signal.sine};
  }
  ++samples_;

  ChannelSample result;
  if (fault_ == ChannelFault::wire_break) analogue = {0, 0};
  if (fault_ == ChannelFault::saturated) analogue = {Adc::kReference, Adc::kReference};
  const bool stuck = fault_ == ChannelFault::stuck && samples_ > 1;
  result.cos_code = stuck ? last_cos_ : adc_.code(analogue.u);
  result.sin_code = stuck ? last_sin_ : adc_.code(analogue.w);
  last_cos_ = result.cos_code;
  last_sin_ = result.sin_code;
  SinCos digital{adc_.signal(result.cos_code), adc_.signal(result.sin_code)};
  double amplitude = kNominalAmplitude;
  if (correction_ == ProbeParams::Correction::heydemann) {
    digital = corrector_.correct(digital);
    if (corrector_.ellipse()) amplitude = corrector_.ellipse()->amplitude;
  }
  const double share = std::sqrt(digital.u * digital.u + digital.w * digital.w) / amplitude;
  result.fault = share < kLeastShare || share > kMostShare || adc_.clipped(result.cos_code) ||
                 adc_.clipped(result.sin_code) || !converts(stuck);
  check_slip_ = check_slip_ || share < kLeastShare || share > kMostShare;
  result.deflection = unwrapper_.step(std::atan2(digital.w, digital.u)) * period_ / (2 * kPi) +
                      miscounted_ * period_;
  result.slip = check_slip_ || unwrapper_.slipped();
  return result;
}

int SignalChannel::check_zero() {
  const int periods = static_cast<int>(std::lround(unwrapper_.total() / (2 * kPi)));
  if (periods != 0) check_slip_ = true;
  return periods;
}

}  // namespace vcnc
