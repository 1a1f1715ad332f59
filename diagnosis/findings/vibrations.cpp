#include "diagnosis/findings/vibrations.hpp"

#include <fmt/format.h>

#include <limits>

#include "diagnosis/findings/excitation.hpp"
#include "diagnosis/findings/record_notes.hpp"
#include "diagnosis/screening/consequence.hpp"
#include "model/axes.hpp"

namespace vcnc {

void tell_vibrations(const DiagnosisCase& of, const Evidence& evidence,
                     const std::vector<Chatter>& all, Diagnosis& d) {
  for (const Chatter& chatter : all) {
    const std::string_view axis = kAxisNames[chatter.axis];
    if (chatter.of_model) {
      d.notes.push_back(
          fmt::format("The declared machine lets {} vibrate by itself ({}), the measured one does "
                      "not: what is declared of that drive is not what there is, and it was not "
                      "compared.",
                      axis, vibration(chatter.line)));
      d.vibrations.push_back(fmt::format(
          "{} vibrates by itself in the declared machine and not in the measured one", axis));
      continue;
    }
    std::string text =
        chatter.has_line()
            ? fmt::format("{} vibrates by itself: {}", axis, vibration(chatter.line))
            : fmt::format("{} is restless: {}, {:.0f} times as much as in the healthy run", axis,
                          trembling(chatter.unrest), chatter.times);
    if (chatter.causes.empty() || !chatter.causes.front().as_strong) {
      std::string likely;
      for (const ChatterCause& c : chatter.causes)
        likely += (likely.empty() ? " So does the model, but not with that strength, with "
                                  : " or with ") +
                  of.candidates[c.candidate].name();
      if (chatter.too_many > 0)
        likely = fmt::format(
            " So is the model with any of {} effects: it tells nothing of the "
            "cause",
            chatter.too_many);
      else if (likely.empty())
        likely = fmt::format(" No effect on the drive of {} does so", axis);
      d.notes.push_back(text + "." + likely + ".");
      d.vibrations.push_back(chatter.has_line() ? fmt::format("{} vibrates by itself at {:.0f} Hz",
                                                              axis, chatter.line.frequency)
                                                : fmt::format("{} is restless", axis));
      continue;
    }
    const ChatterCause& cause = chatter.causes.front();
    const Candidate& candidate = of.candidates[cause.candidate];
    d.notes.push_back(fmt::format(
        "{}. So does the model with {}: {}. Such a vibration has no phase that repeats, so that "
        "amplitudes were compared and not samples; what else the drive of {} does was not "
        "sought.",
        text, candidate.name(),
        chatter.has_line() ? vibration(cause.line) : trembling(cause.unrest), axis));
    FoundEffect e;
    e.name = candidate.effect;
    e.place = candidate.place;
    e.gain = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 1; i < chatter.causes.size(); ++i)
      e.class_with.push_back(of.candidates[chatter.causes[i].candidate].name());
    if (!e.class_with.empty()) e.separating_program = program_for(e.name);
    const Prediction still = evidence.predict(d.found);
    d.found = with_candidate(d.found, candidate, cause.size);
    const std::string& key = candidate.numbers.front().key;
    e.numbers = {{key, number_of(d.found, key), cause.low, cause.high}};
    e.contour_error_um = consequence(evidence, evidence.predict(d.found), still).contour_um;
    d.effects.push_back(std::move(e));
  }
}

}  // namespace vcnc
