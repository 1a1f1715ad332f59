#include "diagnosis/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnosis/differential.hpp"
#include "diagnosis/evidence.hpp"
#include "diagnosis/generic_laws.hpp"
#include "diagnosis/intervals.hpp"
#include "model/axes.hpp"
#include "model/effects/list.hpp"

namespace vcnc {
namespace {

constexpr double kQuiet = 1.05, kAllExplained = 0.98;

const EffectText* text_of(const std::string& effect) {
  const EffectText* text = nullptr;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (Effect::text.name == effect) text = &Effect::text;
  });
  return text;
}

/// The canned program that shows an effect best.
std::string program_for(const std::string& effect) {
  const EffectText* text = text_of(effect);
  if (!text) return "";
  switch (text->showing) {
    case Showing::circle:
    case Showing::circle_feeds:
      return "circles";
    case Showing::line:
      return "lines";
    case Showing::reversals:
      return "reversals";
    case Showing::standstill:
      return "dwell";
    case Showing::spin:
      return "spin";
    case Showing::s_piece:
      return "s-piece";
    case Showing::corner:
      return "corners";
  }
  return "";
}

bool of_measurement(const std::string& effect) {
  const EffectText* text = text_of(effect);
  return text && (text->family == Family::probe || text->family == Family::acquisition ||
                  text->family == Family::setup);
}

/// RMS of what two predictions differ by where it can be seen: at the probe, else at the linear
/// axes [um].
double effect_on_contour(const Evidence& evidence, const Prediction& a, const Prediction& b) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  const auto among = [&](SignalKind kind) {
    double sum = 0, n = 0;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (channels[c].kind != kind || (kind == SignalKind::position && is_rotary(channels[c].axis)))
        continue;
      n = std::max(n, evidence.count(c, Role::both));
      for (const Block& block : evidence.partition().blocks)
        for (std::size_t k = block.begin; k < block.end; ++k)
          if (const double d = a[c][k] - b[c][k]; std::isfinite(d)) sum += d * d;
    }
    return n > 0 ? std::sqrt(sum / n) * 1e6 : 0;
  };
  const bool probed = std::any_of(channels.begin(), channels.end(),
                                  [](const auto& c) { return c.kind == SignalKind::deflection; });
  return among(probed ? SignalKind::deflection : SignalKind::position);
}

std::string channel_name(const ComparedChannel& c) {
  constexpr const char* kinds[] = {"command", "position", "twist",       "force", "deflection",
                                   "cosine",  "sine",     "temperature", "clock"};
  constexpr const char* xyz[] = {"x", "y", "z"};
  return fmt::format(
      "{} {}", kinds[static_cast<int>(c.kind)],
      c.kind == SignalKind::deflection ? xyz[c.axis % 3] : kAxisNames[c.axis].data());
}

class Report {
 public:
  Report(const DiagnosisCase& of, const Evidence& evidence, const DiagnosisOptions& options,
         SelectionResult selection, bool differential)
      : of_(of),
        evidence_(evidence),
        options_(options),
        selection_(std::move(selection)),
        floor_(selection_.floor) {
    d_.differential = differential;
    d_.declared = of.declared;
    d_.found = selection_.found.machine;
    d_.warnings = of.record.warnings;
    const NoiseAudit& noise = evidence.noise();
    d_.warnings.insert(d_.warnings.end(), noise.warnings.begin(), noise.warnings.end());
    if (selection_.interrupted)
      d_.warnings.push_back("Interrupted: what was found until then is told.");
  }

  Diagnosis write() {
    tell_effects();
    tell_clamping();
    tell_noise_lines();
    std::stable_sort(d_.effects.begin(), d_.effects.end(), [](const auto& a, const auto& b) {
      return a.contour_error_um > b.contour_error_um;
    });
    flag_minor();
    if (!selection_.interrupted) tell_law();
    tell_excitation();
    tell_figures();
    tell_ladder();
    judge();
    return std::move(d_);
  }

 private:
  const FittedMachine& found() const { return selection_.found; }
  double excess(double held_out) const { return std::max(0.0, held_out - floor_); }

  void tell_effects() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, found());
    const auto fitted = [&](const FreedNumber& n) {
      const auto i = intervals.find(n.number.key);
      const double half = i == intervals.end() ? 0 : i->second.half_width;
      return FittedNumber{n.number.key, n.value, std::max(n.number.min, n.value - half),
                          std::min(n.number.max, n.value + half)};
    };
    for (const AddedEffect& a : found().added) {
      const Candidate& candidate = of_.candidates[a.candidate];
      FoundEffect e;
      e.name = candidate.effect;
      e.place = candidate.place;
      for (const FreedNumber& n : a.numbers) e.numbers.push_back(fitted(n));
      e.gain = a.gain;
      Machine without = found().machine;
      for (const FreeNumber& n : candidate.numbers)
        move_number(without, n.key, number_of(of_.declared, n.key));
      e.contour_error_um =
          effect_on_contour(evidence_, found().prediction, evidence_.predict(without));
      e.acquisition = of_measurement(e.name);
      for (const std::size_t other : a.class_with)
        e.class_with.push_back(of_.candidates[other].name());
      if (!a.class_with.empty()) {
        e.separating_program = program_for(of_.candidates[a.class_with.front()].effect);
        if (e.separating_program.empty()) e.separating_program = program_for(e.name);
      }
      d_.effects.push_back(std::move(e));
    }
    for (const FreedNumber& n : found().nuisances.numbers) {
      const std::string& key = n.number.key;
      if (std::find(found().released.begin(), found().released.end(), key) ==
          found().released.end())
        continue;
      FoundEffect e;
      e.name = "deviation";
      e.place = key;
      e.numbers.push_back(fitted(n));
      e.contour_error_um = moved_by(n);
      d_.effects.push_back(std::move(e));
    }
  }

  /// What a number does to the contour by standing where it stands.
  double moved_by(const FreedNumber& n) const {
    Machine without = found().machine;
    move_number(without, n.number.key, n.centre);
    return effect_on_contour(evidence_, found().prediction, evidence_.predict(without));
  }

  /// Where the piece was clamped is part of every fit; it is told where it is worth a word.
  void tell_clamping() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, found());
    std::map<std::string, FoundEffect> by_effect;
    for (const FreedNumber& n : found().nuisances.numbers) {
      const std::string& key = n.number.key;
      if (!key.starts_with("effects.setup.")) continue;
      const auto i = intervals.find(key);
      if (i == intervals.end()) continue;
      const std::string name = key.substr(14, key.find('.', 14) - 14);
      const double worth = options_.clamped_um * (name == "piece_tilt" ? 10 : 1);
      FoundEffect& e = by_effect[name];
      e.numbers.push_back(
          {key, n.value, n.value - i->second.half_width, n.value + i->second.half_width});
      if (std::abs(n.value) < worth || std::abs(n.value) < 2.5 * i->second.half_width) continue;
      e.name = name;
      e.place = "setup";
      e.acquisition = true;
      e.contour_error_um = std::hypot(e.contour_error_um, moved_by(n));
    }
    for (auto& [name, e] : by_effect)
      if (!e.name.empty()) d_.effects.push_back(std::move(e));
  }

  /// A line that no effect of the model makes is a disturbance that does not repeat.
  void tell_noise_lines() {
    for (const NoiseLine& line : evidence_.noise().lines) {
      const bool named =
          std::any_of(d_.effects.begin(), d_.effects.end(), [&](const FoundEffect& e) {
            return std::any_of(e.numbers.begin(), e.numbers.end(), [&](const FittedNumber& n) {
              return n.key.ends_with("frequency_Hz") && std::abs(n.value - line.frequency) < 0.5;
            });
          });
      if (named) continue;
      const bool mains = std::abs(line.frequency - 50) < 0.4 || std::abs(line.frequency - 60) < 0.4;
      const bool probe = line.channel.kind == SignalKind::deflection;
      d_.notes.push_back(fmt::format(
          "{} holds a disturbance of {:.2f} Hz that does not repeat with the laps, amplitude "
          "{:.3g} "
          "{}, {:.0f} times the noise around it{}",
          channel_name(line.channel), line.frequency,
          line.channel.kind == SignalKind::force ? line.amplitude : line.amplitude * 1e6,
          line.channel.kind == SignalKind::force ? "N" : "um", line.strength,
          mains   ? " (mains)."
          : probe ? " (vibration between tool and piece)."
                  : "."));
    }
  }

  void flag_minor() {
    double largest = 0;
    for (const FoundEffect& e : d_.effects) largest = std::max(largest, e.contour_error_um);
    for (FoundEffect& e : d_.effects)
      e.minor = e.contour_error_um < 0.02 * largest && e.contour_error_um < 0.5;
  }

  void tell_law() {
    const double left = excess(found().held_out);
    if (left < options_.law_gain + 0.005 * floor_) return;
    LawFit law = best_law(evidence_, found(), options_);
    // A law that does better than a single named effect takes its name away.
    if (found().added.size() == 1) {
      LawFit instead = best_law(evidence_, selection_.base, options_);
      const double named = selection_.base.held_out - found().held_out;
      if (instead.gain > named + options_.law_gain &&
          instead.gain > 0.5 * (named + std::max(0.0, law.gain))) {
        d_.notes.push_back(fmt::format("It looks like {}, but {} fits better.",
                                       of_.candidates[found().added[0].candidate].name(),
                                       words_of(instead.law.law)));
        std::erase_if(d_.effects, [](const FoundEffect& e) {
          return !e.place.empty() && e.place != "setup" && e.name != "deviation";
        });
        withdrawn_ = true;
        law = std::move(instead);
      }
    }
    if (law.gain < std::max(options_.law_gain, options_.least_share * left)) return;
    law_gain_ = law.gain;
    d_.law = law.law;
    d_.found = law.machine;
  }

  void tell_excitation() {
    std::map<std::size_t, double> limits;
    for (const TrialColumns& t : selection_.trials) {
      const auto at = limits.try_emplace(t.trial.candidate, t.detection_limit).first;
      at->second = std::min(at->second, t.detection_limit);
    }
    for (const auto& [c, limit] : limits) {
      const Candidate& candidate = of_.candidates[c];
      double typical = 0;
      for (std::size_t i = 0; i < candidate.numbers.size() && typical == 0; ++i)
        typical = std::abs(candidate.numbers[i].typical);
      Excitation e{candidate.name(), limit, limit < typical, ""};
      if (!e.excited) e.program = program_for(candidate.effect);
      d_.excitation.push_back(std::move(e));
    }
  }

  void tell_figures() {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    const Prediction before = evidence_.predict(of_.declared), after = evidence_.predict(d_.found);
    for (const auto& [role, name] :
         {std::pair{Role::fitted, "fitted laps"}, std::pair{Role::held_out, "held-out laps"}})
      for (std::size_t c = 0; c < channels.size(); ++c)
        d_.figures.push_back({channels[c], name, evidence_.rms(before, c, role),
                              evidence_.rms(after, c, role), evidence_.noise().channels[c].rms});
  }

  void tell_ladder() {
    std::vector<double> rms;
    for (std::size_t c = 0; c < evidence_.replica().channels().size(); ++c)
      rms.push_back(evidence_.rms(selection_.base.prediction, c, Role::held_out));
    d_.ladder.push_back({"declared", selection_.base.held_out / std::max(1.0, floor_), rms});
    for (std::size_t i = 0; i < selection_.rung_chi2.size(); ++i)
      d_.ladder.push_back({selection_.rung_name[i], selection_.rung_chi2[i] / std::max(1.0, floor_),
                           selection_.rung_rms[i]});
  }

  void judge() {
    const double before = excess(selection_.base.held_out);
    const FittedMachine& kept = withdrawn_ ? selection_.base : found();
    const double after = excess(kept.held_out);
    const double ratio = 1 + after / std::max(1.0, floor_);
    const bool named = !d_.effects.empty();
    d_.explained_share = before > 0 ? std::clamp(1 - after / before, 0.0, 1.0) : 0;
    const bool excited = std::any_of(d_.excitation.begin(), d_.excitation.end(),
                                     [](const Excitation& e) { return e.excited; });
    using enum DiagnosisVerdict;
    if (evidence_.count(Role::held_out) < 200 || (!excited && !named && ratio < kQuiet))
      d_.verdict = not_identifiable;
    else if (d_.law)
      d_.verdict = named ? partly : unexplained;
    else if (!evidence_.noise().from_repetitions)
      d_.verdict = named ? explained : no_deviation;
    else if (named)
      d_.verdict = ratio < kQuiet || d_.explained_share > kAllExplained ? explained : partly;
    else
      d_.verdict = ratio < kQuiet ? no_deviation : unexplained;
    if (!d_.differential && !selection_.interrupted && evidence_.noise().from_repetitions &&
        ratio > options_.model_form) {
      d_.model_form_share = before > 0 ? std::min(1.0, after / before) : 1;
      d_.warnings.push_back(fmt::format(
          "Model form error: {:.0f} % of what the declared machine does not explain is still there "
          "({:.2f} times the noise). Against the declared machine alone no effect can be called "
          "the "
          "cause; compare with a healthy run of the same program.",
          100 * d_.model_form_share, ratio));
    }
  }

  const DiagnosisCase& of_;
  const Evidence& evidence_;
  const DiagnosisOptions& options_;
  SelectionResult selection_;
  double floor_;
  double law_gain_ = 0;
  bool withdrawn_ = false;
  Diagnosis d_;
};

}  // namespace

Diagnosis diagnose(const DiagnosisCase& of, const std::optional<HealthyRun>& healthy,
                   const DiagnosisOptions& options, const KeepGoing& keep_going) {
  DifferentialRecord record{of.record, 1};
  if (healthy) record = less_healthy(of.record, healthy->record, healthy->replica, of.declared);
  Evidence evidence(record.record, of.replica, of.declared, record.noise_scale);
  const DiagnosisCase seen{record.record, of.replica, of.declared, of.candidates};
  SelectionResult selection =
      select_effects_of(evidence, of.declared, of.candidates, options, keep_going);
  return Report(seen, evidence, options, std::move(selection), healthy.has_value()).write();
}

std::vector<SignalFigure> figures_of(const Record& record, Replica& replica,
                                     const Machine& declared, const Machine& found,
                                     const std::string& name) {
  Evidence evidence(record, replica, declared);
  const Prediction before = evidence.predict(declared), after = evidence.predict(found);
  std::vector<SignalFigure> all;
  for (std::size_t c = 0; c < replica.channels().size(); ++c)
    all.push_back({replica.channels()[c], name, evidence.rms(before, c, Role::both),
                   evidence.rms(after, c, Role::both), evidence.noise().channels[c].rms});
  return all;
}

Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options,
                         const KeepGoing& keep_going) {
  struct FrictionLaw {
    const char* name;
    std::vector<std::string> effects;
  };
  static const std::vector<FrictionLaw> laws{
      {"dry and viscous friction", {"coulomb", "viscous"}},
      {"dry, viscous and break-away friction", {"coulomb", "viscous", "stribeck"}},
      {"dry and viscous friction with pre-sliding", {"coulomb", "viscous", "presliding"}},
      {"dry, viscous and break-away friction with pre-sliding",
       {"coulomb", "viscous", "stribeck", "presliding"}}};
  Evidence evidence(of.record, of.replica, of.declared);
  FittedMachine machine = fit_declared(evidence, of.declared);
  Commissioning result;
  std::vector<FreedNumber> fitted;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (keep_going && !keep_going({fmt::format("friction of {}", kAxisNames[axis]),
                                   static_cast<double>(axis) / kAxisCount}))
      break;
    FittedMachine best = machine;
    std::string chosen = "no friction";
    for (const FrictionLaw& law : laws) {
      FittedMachine trial = machine;
      for (const std::string& effect : law.effects) {
        for (std::size_t c = 0; c < of.candidates.size(); ++c) {
          const Candidate& candidate = of.candidates[c];
          if (candidate.effect != effect || candidate.place != kAxisNames[axis]) continue;
          AddedEffect added{.candidate = c, .numbers = {}, .gain = 0, .class_with = {}};
          for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
            const FreeNumber& n = candidate.numbers[i];
            const bool shape = std::find(candidate.shape.begin(), candidate.shape.end(), i) !=
                               candidate.shape.end();
            const double declared = number_of(machine.machine, n.key);
            FreedNumber freed{.number = n,
                              .value = declared != 0 ? declared : 0.3 * std::abs(n.typical),
                              .shape = shape};
            freed.number.typical = std::max(std::abs(n.typical), 1e-9);
            added.numbers.push_back(freed);
          }
          trial.added.push_back(std::move(added));
        }
      }
      if (trial.added.size() == machine.added.size()) continue;
      const std::vector<FreedNumber> numbers = trial.numbers();
      LinearPart left;
      for (std::size_t i = 0; i < trial.nuisances.numbers.size(); ++i) {
        const std::string& key = trial.nuisances.numbers[i].number.key;
        if (std::any_of(numbers.begin(), numbers.end(),
                        [&](const FreedNumber& n) { return n.number.key == key; }))
          continue;
        left.numbers.push_back(trial.nuisances.numbers[i]);
        left.columns.push_back(trial.nuisances.columns[i]);
      }
      trial.nuisances = std::move(left);
      converge(evidence, trial);
      if (best.held_out - trial.held_out <= options.least_gain) continue;
      best = std::move(trial);
      chosen = law.name;
    }
    if (best.added.size() > machine.added.size())
      result.notes.push_back(fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}",
                                         kAxisNames[axis], chosen,
                                         machine.held_out / evidence.count(Role::held_out),
                                         best.held_out / evidence.count(Role::held_out)));
    machine = std::move(best);
  }
  const std::map<std::string, Interval> intervals = intervals_of(evidence, machine);
  const auto tell = [&](const FreedNumber& n) {
    const auto i = intervals.find(n.number.key);
    const double half = i == intervals.end() ? 0 : i->second.half_width;
    result.numbers.push_back({n.number.key, n.value, std::max(n.number.min, n.value - half),
                              std::min(n.number.max, n.value + half)});
  };
  for (const FreedNumber& n : machine.numbers()) tell(n);
  for (const FreedNumber& n : machine.nuisances.numbers) tell(n);
  result.machine = machine.machine;
  result.figures = figures_of(of.record, of.replica, of.declared, result.machine, "all laps");
  result.warnings = evidence.noise().warnings;
  return result;
}

}  // namespace vcnc
