#include "diagnosis/findings/still_off.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/verdict.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Part of what a signal was off by before that a model of what was found may be wrong by.
constexpr double kWrongOfFound = 0.05;

/// Times its noise by which a signal is off in what was fitted alone, where nothing was repeated.
constexpr double kLoudAlone = 5;

/// A position of a linear axis, or where the tool is.
bool is_length(const ComparedChannel& channel) {
  return is_reading(channel.kind) ||
         (channel.kind == SignalKind::position && !is_rotary(channel.axis));
}

}  // namespace

bool is_stirred(const std::vector<Chatter>& chatter, const ComparedChannel& channel) {
  return std::any_of(chatter.begin(), chatter.end(), [&](const Chatter& c) {
    return is_reading(channel.kind) || channel.axis == c.axis;
  });
}

std::vector<StillOff> signals_still_off(const Evidence& evidence, const DiagnosisOptions& options,
                                        const std::vector<Chatter>& chatter, const Machine& before,
                                        const Machine& found) {
  std::vector<StillOff> off;
  const bool laps = evidence.partition().repeated;
  const Prediction was_to_be = evidence.predict(before), found_to_be = evidence.predict(found);
  const auto rms_of = [&](const Prediction& p, Role role) {
    return evidence.rms_within_laps(p, role);
  };
  const std::vector<double> before_rms = rms_of(was_to_be, Role::held_out),
                            before_fitted = rms_of(was_to_be, Role::fitted),
                            after = rms_of(found_to_be, Role::held_out),
                            fitted = rms_of(found_to_be, Role::fitted);
  for (std::size_t c = 0; c < after.size(); ++c) {
    const ComparedChannel& channel = evidence.replica().channels()[c];
    const double n = evidence.count(c, Role::held_out);
    if (n < kFewSamples || is_stirred(chatter, channel)) continue;
    const double form = c < options.form_of_channel.size() ? options.form_of_channel[c] / n : 0,
                 noise = evidence.reckoned_with(c) * std::sqrt(1 + form);
    const bool alone = !laps && fitted[c] > std::max(after[c], kLoudAlone * noise);
    const double was = alone ? before_fitted[c] : before_rms[c], is = alone ? fitted[c] : after[c];
    const auto beyond = [&](double rms) {
      return std::sqrt(std::max(0.0, rms * rms - noise * noise));
    };
    const double loud = std::max(kLoud * noise, 0.5 * evidence.step_of(c));
    if (std::min(is, fitted[c]) < loud || beyond(is) < kWrongOfFound * beyond(was)) continue;
    if (is_length(channel) && beyond(is) * 1e6 < options.least_contour_um) continue;
    off.push_back({channel, is, noise, was});
  }
  return off;
}

std::vector<double> made_by_steps(const Evidence& evidence, const DiagnosisOptions& options,
                                  const FittedMachine& machine) {
  const std::vector<double> left = evidence.chi2_of(machine.residual, Role::held_out),
                            floor =
                                noise_floor(evidence, machine.residual, options.form_of_channel);
  std::vector<double> made = evidence.made_by_steps(machine.prediction);
  for (std::size_t c = 0; c < made.size(); ++c) made[c] = std::min(made[c], left[c] - floor[c]);
  return made;
}

}  // namespace vcnc
