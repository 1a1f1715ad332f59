#include "diagnosis/findings/record_notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnosis/replica/model_comparison.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Part of the readings that may count less without a word.
constexpr double kSomeTurn = 0.005;
/// Times its noise that a signal is off in what was run once for a word.
constexpr double kOffOnce = 10;

/// Whether a line is that of an axis that vibrates by itself.
bool is_of(const std::vector<Chatter>& chatter, const NoiseLine& line) {
  return std::any_of(chatter.begin(), chatter.end(), [&](const Chatter& c) {
    return c.has_line() && ((line.channel.axis == c.axis && !is_reading(line.channel.kind)) ||
                            std::abs(line.frequency - c.line.frequency) < 0.02 * c.line.frequency);
  });
}

/// Whether a found effect has a frequency like that.
bool is_named(const std::vector<FoundEffect>& effects, double frequency) {
  return std::any_of(effects.begin(), effects.end(), [&](const FoundEffect& e) {
    return std::any_of(e.numbers.begin(), e.numbers.end(), [&](const FittedNumber& n) {
      return n.key.ends_with("frequency_Hz") && std::abs(n.value - frequency) < 0.5;
    });
  });
}

}  // namespace

std::string vibration(const NoiseLine& line) {
  const ShownUnit unit = shown_unit(line.channel);
  return fmt::format("{} with {:.2f} Hz and {:.3g} {}", channel_name(line.channel), line.frequency,
                     line.amplitude * unit.factor, unit.name);
}

std::string trembling(const Unrest& u) {
  const ShownUnit unit = shown_unit(u.channel);
  return fmt::format("{} {} by {:.3g} {} rms", channel_name(u.channel),
                     u.at_rest ? "trembles at rest" : "differs from lap to lap",
                     u.rms.value_or(0) * unit.factor, unit.name);
}

std::vector<std::string> notes_of_lines(const Evidence& evidence,
                                        const std::vector<Chatter>& chatter,
                                        const std::vector<FoundEffect>& effects) {
  std::vector<std::string> notes;
  for (const NoiseLine& line : evidence.noise().lines) {
    if (is_named(effects, line.frequency) || is_of(chatter, line)) continue;
    const bool mains = std::abs(line.frequency - 50) < 0.4 || std::abs(line.frequency - 60) < 0.4;
    const bool probe = is_reading(line.channel.kind);
    notes.push_back(fmt::format(
        "{} holds a disturbance of {:.2f} Hz that does not repeat with the laps, amplitude "
        "{:.3g} {}, {:.0f} times the noise around it{}",
        channel_name(line.channel), line.frequency,
        line.amplitude * shown_unit(line.channel).factor, shown_unit(line.channel).name,
        line.strength,
        mains   ? " (mains)."
        : probe ? " (vibration between tool and piece)."
                : "."));
  }
  return notes;
}

std::vector<std::string> notes_of_events(const Evidence& evidence) {
  std::map<std::size_t, std::string> times;
  for (const LapEvent& e : evidence.events())
    times[e.axis] += fmt::format("{}{:.2f}", times.contains(e.axis) ? ", " : "",
                                 evidence.record().time_of((e.begin + e.end) / 2));
  std::vector<std::string> notes;
  for (const auto& [axis, at] : times)
    notes.push_back(fmt::format(
        "{} does not do the same in all laps about {} s, as an axis that stops in its friction "
        "may, and in its first lap; these moments were left out.",
        kAxisNames[axis], at));
  return notes;
}

std::vector<std::string> notes_of_turning(const Evidence& evidence) {
  std::vector<std::string> notes;
  for (std::size_t c = 0; c < evidence.replica().channels().size(); ++c)
    if (const double share = evidence.share_of_turning(c); share > kSomeTurn)
      notes.push_back(fmt::format(
          "{}: {} of the readings count less, taken while what is off goes over from one state "
          "to another; no signal of a drive tells when it should.",
          channel_name(evidence.replica().channels()[c]), percent(share)));
  return notes;
}

std::vector<std::string> notes_of_once(const Evidence& evidence, const Machine& machine) {
  std::string off;
  const std::vector<double> once = evidence.rms_run_once(evidence.predict(machine));
  for (std::size_t c = 0; c < once.size(); ++c) {
    const double noise = std::max(evidence.reckoned_with(c), 0.5 * evidence.step_of(c));
    if (once[c] < kOffOnce * noise) continue;
    const ComparedChannel& channel = evidence.replica().channels()[c];
    const ShownUnit unit = shown_unit(channel);
    off += fmt::format("{}{} by {:.3g} {} rms ({:.0f} times its noise)", off.empty() ? "" : ", ",
                       channel_name(channel), once[c] * unit.factor, unit.name, once[c] / noise);
  }
  if (off.empty()) return {};
  return {"In what was run once is still off " + off +
          ": without repetition that counts as noise, and the verdict is of the repeated motions "
          "alone. Run every motion twice to have it explained."};
}

}  // namespace vcnc
