#include "diagnosis/report/diagnosis_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/replica/model_comparison.hpp"
#include "diagnosis/report/shown_law.hpp"
#include "model/machine.hpp"

namespace vcnc {

namespace {

std::string name_of(const FoundEffect& e) {
  if (e.name == "deviation") return e.place;
  return e.place.empty() ? e.name : e.place + "." + e.name;
}

/// Last part of a key, with its component.
std::string short_key(const std::string& key, const std::string& effect) {
  const std::size_t at = key.rfind(effect + ".");
  if (!effect.empty() && at != std::string::npos) return key.substr(at + effect.size() + 1);
  return key.substr(key.rfind('.') + 1);
}

}  // namespace

std::string with_interval(const FittedNumber& n) {
  const double width = n.high - n.low;
  if (width == 0) return fmt::format("{:g}", n.value);  // tried, as whole numbers are
  const double least = std::isfinite(width) && width > 0 ? width : std::abs(n.value) * 1e-3;
  const int digits =
      least > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(least))), 0, 9) : 3;
  return fmt::format("{:.{}f} [{:.{}f} .. {:.{}f}]", n.value, digits, n.low, digits, n.high,
                     digits);
}

/// "+79 [+65 .. +94] against the reference run"
std::string against_declared(const FittedNumber& n, const Diagnosis& d) {
  const double was = number_of(d.declared, n.key);
  const FittedNumber change{n.key, n.value - was, n.low - was, n.high - was};
  return fmt::format("{} against {}", with_interval(change),
                     d.differential ? "the reference run" : "what is declared");
}

std::string with_change(const FittedNumber& n, const Diagnosis& d) {
  const bool declared = number_of(d.declared, n.key) != number_of(Machine(), n.key);
  return with_interval(n) + (declared ? ", " + against_declared(n, d) : "");
}

std::string percent(double share) {
  return share < 0.01 ? fmt::format("{:.1g} %", share * 100) : fmt::format("{:.0f} %", share * 100);
}

std::string verdict_sentence(const Diagnosis& d) {
  switch (d.verdict) {
    case DiagnosisVerdict::explained:
      if (d.left > 0)
        return fmt::format(
            "what was added explains {:.1f} % of what was to be explained and leaves {:.2f} times "
            "the noise",
            d.explained_share * 100, d.left);
      return !d.declared.commissioned.empty()
                 ? "what was added leaves no more than noise and what commissioning left"
                 : "what was added leaves nothing but noise";
    case DiagnosisVerdict::partly:
      return fmt::format(
          "what was added explains {} % of what was to be explained{}{}",
          d.explained_share < 0.995 ? fmt::format("{:.0f}", d.explained_share * 100) : "over 99",
          d.model_form_share > 0
              ? fmt::format("; {} is an error of the model's form, so what is named goes along "
                            "with it and need not be its cause",
                            percent(d.model_form_share))
              : "",
          d.vibrations.empty() ? ""
                               : fmt::format(", and not that {}", fmt::join(d.vibrations, ", ")));
    case DiagnosisVerdict::unexplained:
      if (!d.laws.empty()) return law_words(d.laws);
      if (!d.vibrations.empty()) return fmt::to_string(fmt::join(d.vibrations, ", "));
      return d.suspects.empty() ? "something is there that nothing in the library explains"
                                : "something is there that no suspect explains";
    case DiagnosisVerdict::no_deviation:
      return std::string("the machine does what is declared, within what this run can show") +
             (d.effects.empty() ? "" : "; the piece is not where it is declared");
    case DiagnosisVerdict::not_identifiable:
      return "the run does not excite what it should tell";
    case DiagnosisVerdict::interrupted:
      return d.effects.empty() ? "nothing was found until then"
                               : "found until then, not to the end";
  }
  return "";
}

std::string axes_told(const Diagnosis& d) {
  std::vector<std::string> told;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (!d.axis_names[i].empty() && d.axis_names[i] != kAxisNames[i])
      told.push_back(fmt::format("{} is {}", kAxisNames[i], d.axis_names[i]));
  return fmt::format("{}", fmt::join(told, ", "));
}

std::string figures_table(const std::vector<SignalFigure>& figures) {
  if (figures.empty()) return "";
  std::size_t width = 12;
  for (const SignalFigure& f : figures) width = std::max(width, f.run.size());
  std::string text = fmt::format("{:<16}{:<{}}  {:>11}{:>11}{:>11}\n", "rms", "", width, "before",
                                 "after", "noise");
  for (const SignalFigure& f : figures) {
    const ShownUnit unit = shown_unit(f.channel);
    const std::string floor =
        f.floor > 0 ? fmt::format("{:.4g}", f.floor * unit.factor) : std::string("-");
    text +=
        fmt::format("{:<16}{:<{}}  {:>11.4g}{:>11.4g}{:>11} {}\n", channel_name(f.channel), f.run,
                    width, f.before * unit.factor, f.after * unit.factor, floor, unit.name);
  }
  return text;
}

std::string to_text(const Diagnosis& d) {
  std::string text = fmt::format("{}: {}\nmode: {}\n", to_string(d.verdict), verdict_sentence(d),
                                 d.differential ? "differential, against the reference run"
                                                : "absolute, against the declared model");
  if (const std::string axes = axes_told(d); !axes.empty()) text += "axes: " + axes + "\n";
  if (!d.suspects.empty())
    text += fmt::format("sought: nothing but {}\n", fmt::join(d.suspects, ", "));
  for (const FoundEffect& e : d.effects) {
    std::string numbers;
    for (const FittedNumber& n : e.numbers) {
      const std::string separator = numbers.empty() ? "" : ", ";
      numbers +=
          e.name == "deviation"
              ? separator + with_interval(n) + ", " + against_declared(n, d)
              : fmt::format("{}{} = {}", separator, short_key(n.key, e.name), with_change(n, d));
    }
    const char* kind = e.minor ? " (minor)" : e.acquisition ? " (of the measurement)" : "";
    // A joint makes no contour.
    const std::string contour =
        e.contour_error_um == 0 ? ""
                                : fmt::format("; contour error {:+.3g} um rms", e.contour_error_um);
    text += fmt::format("  {}{}: {}{}\n", name_of(e), kind, numbers, contour);
    if (!e.class_with.empty()) {
      std::string others;
      for (const std::string& c : e.class_with) others += (others.empty() ? "" : ", ") + c;
      text +=
          fmt::format("    or: {}{}\n", others,
                      e.separating_program.empty()
                          ? ""
                          : "; a run of `vcnc program " + e.separating_program +
                                "`, at another feed or size if this is one, may tell them apart");
    }
  }
  for (const FittedNumber& n : d.uncertain)
    text += fmt::format("  declared as uncertain: {} = {}\n", n.key, with_interval(n));
  if (!d.laws.empty() && d.verdict != DiagnosisVerdict::unexplained)
    text += "  " + law_words(d.laws) + "\n";
  for (const LearnedLaw& law : d.laws) text += "    " + law_numbers(law) + "\n";
  text += figures_table(d.figures);
  std::size_t blind = 0;
  for (const Excitation& e : d.excitation) blind += !e.excited;
  if (blind > 0)
    text += fmt::format("this run cannot show {} of {} candidates; see the report\n", blind,
                        d.excitation.size());
  for (const std::string& n : d.notes) text += "note: " + n + "\n";
  for (const std::string& w : d.warnings) text += "warning: " + w + "\n";
  return text;
}

}  // namespace vcnc
