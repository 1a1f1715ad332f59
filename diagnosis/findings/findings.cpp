#include "diagnosis/findings/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/candidates/suspects.hpp"
#include "diagnosis/findings/excitation.hpp"
#include "diagnosis/findings/record_notes.hpp"
#include "diagnosis/findings/still_off.hpp"
#include "diagnosis/findings/vibrations.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/refit.hpp"
#include "diagnosis/healthy/common_numbers.hpp"
#include "diagnosis/replica/model_comparison.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "diagnosis/screening/consequence.hpp"
#include "diagnosis/selection/law_search.hpp"
#include "diagnosis/verdict.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Of an amplitude, what is uncertain of it with its shape known, where the shape is all the rest.
constexpr double kKnownTogether = 0.2;
/// Times the noise of a sample by which readings may shift from lap to lap.
constexpr double kShifted = 3;
/// Times what is declared that no declared number is.
constexpr double kUnlikelyTimes = 4;
bool of_measurement(const std::string& effect) {
  const EffectText* text = effect_text(effect);
  return text && (text->family == Family::probe || text->family == Family::acquisition ||
                  text->family == Family::setup);
}

/// Whether what it does comes and goes with time: then it tells why laps differ, or it is not it.
bool drifts(const FoundEffect& e) {
  const EffectText* text = effect_text(e.name);
  return text && (text->family == Family::thermal || text->name == ProbeDrift::text.name);
}

class Report {
 public:
  Report(const DiagnosisCase& of, const Evidence& evidence, const DiagnosisOptions& options,
         const SelectionResult& selection, const FoundBeforehand& before, bool differential)
      : of_(of),
        evidence_(evidence),
        options_(options),
        selection_(selection),
        before_(before),
        floor_(selection_.floor),
        inexact_(is_inexact(evidence, options, floor_, selection_.found.held_out)) {
    d_.differential = differential;
    d_.declared = of.declared;
    d_.found = selection_.found.machine;
    d_.axis_names = of.record.axis_names;
    d_.warnings = of.record.warnings;
    d_.suspects = options.suspects;
    const NoiseAudit& noise = evidence.noise();
    add(d_.warnings, noise.warnings);
  }

  Diagnosis write() {
    tell_slip();
    tell_effects();
    tell_uncertain();
    tell_clamping();
    add(d_.notes, notes_of_lines(evidence_, before_.chatter, d_.effects));
    add(d_.notes, notes_of_events(evidence_));
    add(d_.notes, notes_of_turning(evidence_));
    std::vector<StillOff> off = what_is_still_off();
    still_off_ = !off.empty();
    if (!selection_.interrupted) tell_laws();
    if (!d_.laws.empty()) off = what_is_still_off();
    // Without a law, numbers were pulled for want of it.
    if (d_.laws.empty()) add(d_.notes, pulled_);
    tell_still_off(off);
    add(d_.notes, notes_of_once(evidence_, d_.found));
    tell_vibrations(of_, evidence_, before_.chatter, d_);
    std::stable_sort(d_.effects.begin(), d_.effects.end(), [](const auto& a, const auto& b) {
      return a.contour_error_um > b.contour_error_um;
    });
    flag_minor();
    tell_shifts_between_laps();
    ExcitationOfRun excitation = excitation_of(of_, evidence_, selection_);
    d_.excitation = std::move(excitation.of);
    add(d_.notes, excitation.notes);
    tell_figures();
    tell_ladder();
    judge();
    d_.found = without_common(d_.found);
    return std::move(d_);
  }

 private:
  static void add(std::vector<std::string>& to, const std::vector<std::string>& sentences) {
    to.insert(to.end(), sentences.begin(), sentences.end());
  }
  const FittedMachine& found() const { return selection_.found; }
  double excess(double held_out) const { return std::max(0.0, held_out - floor_); }

  static bool is_of_machine(const FoundEffect& e) { return e.place != "setup"; }

  static std::string name_of(const FoundEffect& e) {
    return e.name == "deviation" ? e.place : e.place + "." + e.name;
  }

  /// Whether an effect is too small for a word; then it is noted and put back.
  bool negligible(const FoundEffect& e, const Machine& without, const Prediction& prediction) {
    if (e.contour_error_um >= std::max(options_.least_contour_um, options_.form_um)) return false;
    const bool within_form = e.contour_error_um >= options_.least_contour_um;
    const Consequence of = consequence(evidence_, found().prediction, prediction);
    const double share = within_form ? of.of_noise_but_readings : of.of_noise;
    if (share >= options_.least_of_noise) return false;
    if (within_form)
      d_.notes.push_back(
          fmt::format("{} fits, but moves the reading by {:.2g} um rms only: what the model gets "
                      "wrong about the healthy machine changes by as much ({:.2g} um).",
                      name_of(e), e.contour_error_um, options_.form_um));
    else
      d_.notes.push_back(fmt::format(
          "{} fits a little ({} = {:.3g}) but does nothing that matters: {:.2g} um rms to "
          "the contour and {:.0f} % of the noise of a sample to any signal.",
          name_of(e), e.numbers.front().key, e.numbers.front().value, e.contour_error_um,
          100 * share));
    for (const FittedNumber& n : e.numbers) put_back(n.key, number_of(without, n.key));
    return true;
  }

  static FittedNumber with_interval_of(const FreedNumber& n,
                                       const std::map<std::string, Interval>& intervals) {
    const auto i = intervals.find(n.number.key);
    const double half = i == intervals.end() ? 0 : i->second.half_width;
    return {n.number.key, n.value, std::max(n.number.min, n.value - half),
            std::min(n.number.max, n.value + half)};
  }

  /// Numbers that the declared machine calls uncertain, where nothing else is said of them.
  void tell_uncertain() {
    if (d_.differential || of_.declared.uncertainties.empty()) return;
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, found(), inexact_);
    for (const Uncertainty& u : of_.declared.uncertainties) {
      if (u.exact()) continue;
      const std::vector<FreedNumber>& along = found().nuisances.numbers;
      const auto n = std::find_if(along.begin(), along.end(),
                                  [&](const FreedNumber& f) { return f.number.key == u.key; });
      const bool told = std::any_of(d_.effects.begin(), d_.effects.end(), [&](const auto& e) {
        return std::any_of(e.numbers.begin(), e.numbers.end(),
                           [&](const FittedNumber& f) { return f.key == u.key; });
      });
      if (told) continue;
      const bool shown = n != along.end();
      const FittedNumber fit = shown ? with_interval_of(*n, intervals) : FittedNumber{};
      if (shown && !(u.free() && fit.low <= u.between[0] && fit.high >= u.between[1])) {
        d_.uncertain.push_back(fit);
        continue;
      }
      d_.notes.push_back(u.key + " is declared as uncertain, and this run does not show it.");
      put_back(u.key, number_of(of_.declared, u.key));
    }
  }

  void tell_effects() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, found(), inexact_);
    const auto fitted = [&](const FreedNumber& n) { return with_interval_of(n, intervals); };
    for (const AddedEffect& a : found().added) {
      const Candidate& candidate = of_.candidates[a.candidate];
      if (!(a.gain > options_.least_gain)) {
        withhold(candidate, "was tried and is not needed");
        continue;
      }
      FoundEffect e;
      e.name = candidate.effect;
      e.place = candidate.place;
      for (const FreedNumber& n : a.numbers) e.numbers.push_back(fitted(n));
      for (const FreeNumber& n : candidate.numbers) {
        const double value = number_of(found().machine, n.key);
        if (n.whole) e.numbers.push_back({n.key, value, value, value});
      }
      e.gain = a.gain;
      tell_known_together(a, intervals);
      if (may_be_as_declared(a, of_.declared, intervals)) {
        withhold(candidate, "fits, but may be as declared");
        continue;
      }
      Machine without = found().machine;
      for (const FreeNumber& n : candidate.numbers)
        move_number(without, n.key, number_of(of_.declared, n.key));
      const Prediction less = evidence_.predict(without);
      e.contour_error_um = consequence(evidence_, found().prediction, less).contour_um;
      if (negligible(e, without, less)) continue;
      e.acquisition = of_measurement(e.name);
      tell_class(e, a.class_with);
      tell_bounds(a.numbers);
      d_.effects.push_back(std::move(e));
    }
    for (const FreedNumber& n : found().nuisances.numbers) {
      const std::string& key = n.number.key;
      const auto released = std::find_if(found().released.begin(), found().released.end(),
                                         [&](const ReleasedNumber& r) { return r.key == key; });
      if (released == found().released.end()) {
        const double pull = std::abs(n.pull());
        if (!n.common() && !is_clamping(key) && pull > options_.out_of_tolerance)
          pulled_.push_back(fmt::format(
              "{} fits best {} {:.4g}, {:.1f} tolerances from what is declared ({:.4g}), but that "
              "explains too little to count.",
              key, pull > kFarthestPull - 0.05 ? "beyond the furthest it is let go," : "at",
              n.value, pull, n.centre));
        continue;
      }
      FoundEffect e;
      e.name = "deviation";
      e.place = key;
      if (never_quite_absent(key)) e.place = place_of_key(key), e.name = effect_of_key(key);
      e.numbers.push_back(fitted(n));
      Machine without = found().machine;
      move_number(without, key, n.centre);
      if (e.numbers.front().low <= n.centre && n.centre <= e.numbers.front().high) {
        d_.notes.push_back(fmt::format("{} may be out of tolerance, or as declared.", key));
        put_back(key, number_of(selection_.base.machine, key));
        held_.push_back(n);
        continue;
      }
      const Prediction less = evidence_.predict(without);
      e.contour_error_um = consequence(evidence_, found().prediction, less).contour_um;
      if (negligible(e, without, less)) continue;
      const FittedMachine held = found().holding(key, selection_.base);
      e.gain = Ground(evidence_, held.residual, held.linear()).held_out - found().held_out;
      tell_class(e, released->class_with);
      tell_unlikely(n);
      d_.effects.push_back(std::move(e));
    }
    if (withheld_ || !held_.empty()) fit_what_is_told();
  }

  /// Amplitudes whose interval is wide only since a shape is not known: the height of a drift of
  /// which no more than a straight piece was seen.
  void tell_known_together(const AddedEffect& a, const std::map<std::string, Interval>& intervals) {
    for (const FreedNumber& n : a.numbers) {
      const auto i = intervals.find(n.number.key);
      if (n.shape || i == intervals.end()) continue;
      const double off = std::abs(n.value - number_of(of_.declared, n.number.key));
      if (i->second.half_width < off || i->second.shapes_known > kKnownTogether * off) continue;
      d_.notes.push_back(
          fmt::format("{} is not known apart from the shape of its effect; with the shape that is "
                      "told it is {:.4g} +- {:.2g}.",
                      n.number.key, n.value, i->second.shapes_known));
    }
  }

  /// A number that would go on if it might is of something else.
  void tell_bounds(const std::vector<FreedNumber>& numbers) {
    for (const FreedNumber& n : numbers) {
      if (!at_its_most(n.number, n.value)) continue;
      d_.warnings.push_back(
          fmt::format("{} went to the end of what is allowed, {:.4g}: it is no size that such an "
                      "effect has, and what is there is probably something else.",
                      n.number.key, n.number.max));
    }
  }

  /// A declared number that no builder could be so wrong about.
  void tell_unlikely(const FreedNumber& n) {
    if (never_quite_absent(n.number.key)) return;  // nobody declares what is left of an error
    const double times = n.centre == 0 ? 1 : n.value / n.centre;
    if (times > 0 && times < kUnlikelyTimes && 1 / times < kUnlikelyTimes) return;
    d_.warnings.push_back(fmt::format(
        "{} would be {:.2g} times what is declared: what is there is probably something "
        "else that acts like it.",
        n.number.key, times));
  }

  void tell_class(FoundEffect& e, const std::vector<std::size_t>& others) {
    for (const std::size_t other : others) e.class_with.push_back(of_.candidates[other].name());
    if (others.empty()) return;
    if (of_.record.on_table) {  // no program of ours moves about a ball on the table
      d_.notes.push_back(
          fmt::format("{} may be told apart from the others of its class by the same test with "
                      "another feed or size, or at another place of the table.",
                      name_of(e)));
      return;
    }
    e.separating_program = program_for(of_.candidates[others.front()].effect);
    if (e.separating_program.empty()) e.separating_program = program_for(e.name);
  }

  /// An effect that is not told; what is declared of it goes into the found machine.
  void withhold(const Candidate& candidate, const std::string& why) {
    withheld_ = true;
    d_.notes.push_back(fmt::format("{} {}.", candidate.name(), why));
    for (const FreeNumber& n : candidate.numbers)
      put_back(n.key, number_of(selection_.base.machine, n.key));
  }

  /// A number of what is not told becomes what it was.
  void put_back(const std::string& key, double value) {
    put_back_.emplace_back(key, value);
    move_number(d_.found, key, value);
  }

  /// Declared numbers and where the piece lies were fitted beside what is not told: anew, without,
  /// along their sensitivities until that leaves no less.
  void fit_what_is_told() {
    constexpr int kSteps = 6;
    LinearPart linear = without(found().nuisances, held_);
    Column residual = evidence_.residual(evidence_.predict(d_.found));
    told_held_out_ = evidence_.chi2(residual, Role::held_out);
    for (int i = 0; i < kSteps; ++i) {
      const Ground ground(evidence_, residual, linear);
      for (std::size_t n = 0; n < linear.numbers.size(); ++n)
        linear.numbers[n].value +=
            ground.step[static_cast<Eigen::Index>(n)] * linear.numbers[n].number.typical;
      const Machine next = with(d_.found, linear.numbers);
      residual = evidence_.residual(evidence_.predict(next));
      const double left = evidence_.chi2(residual, Role::held_out);
      if (!(left < told_held_out_)) break;
      const double gained = told_held_out_ - left;
      d_.found = next;
      told_held_out_ = left;
      if (gained < options_.least_gain) break;
    }
  }

  void tell_slip() {
    if (!before_.slip) return;
    const PeriodSlip& slip = *before_.slip;
    FoundEffect e;
    e.name = PeriodSlip::text.name;
    e.place = "probe";
    const std::string key = "effects.probe.period_slip.";
    const double within = evidence_.record().period, n = slip.periods, channel = slip.channel;
    e.numbers = {{key + "periods", n, n, n},
                 {key + "channel", channel, channel, channel},
                 {key + "start_s", slip.start, slip.start - within, slip.start}};
    Machine without = found().machine;
    without.effects.get<PeriodSlip>() = {};
    const Prediction less = evidence_.predict(without);
    e.contour_error_um = consequence(evidence_, found().prediction, less).contour_um;
    e.gain = lost(less);
    e.acquisition = true;
    d_.effects.push_back(std::move(e));
  }

  /// Held-out chi-square that a prediction leaves beyond that of the found machine.
  double lost(const Prediction& without) const {
    return evidence_.chi2(evidence_.residual(without), Role::held_out) -
           evidence_.chi2(found().residual, Role::held_out);
  }

  /// What a number does to the contour by standing where it stands.
  double moved_by(const FreedNumber& n) const {
    Machine without = found().machine;
    move_number(without, n.number.key, n.centre);
    return consequence(evidence_, found().prediction, evidence_.predict(without)).contour_um;
  }

  /// Where the piece was clamped is part of every fit; it is told where it is worth a word.
  void tell_clamping() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, found(), inexact_);
    std::map<std::string, FoundEffect> by_effect;
    for (const FreedNumber& n : found().nuisances.numbers) {
      const std::string& key = n.number.key;
      if (!is_clamping(key)) continue;
      const auto i = intervals.find(key);
      if (i == intervals.end()) continue;
      const std::string name = effect_of_key(key);
      const double worth = options_.clamped_um * (name == "piece_tilt" ? 10 : 1);
      FoundEffect& e = by_effect[name];
      e.numbers.push_back(
          {key, n.value, n.value - i->second.half_width, n.value + i->second.half_width});
      const double moved = std::abs(n.value - n.centre);
      if (moved < worth || moved < 2.5 * i->second.half_width) continue;
      e.name = name;
      e.place = "setup";
      e.acquisition = true;
      e.contour_error_um = std::hypot(e.contour_error_um, moved_by(n));
    }
    for (auto& [name, e] : by_effect) {
      if (e.name.empty()) continue;
      // Between two runs the piece was clamped anew: that is no finding.
      if (!d_.differential) {
        Machine without = found().machine;
        for (const FittedNumber& n : e.numbers)
          move_number(without, n.key, number_of(of_.declared, n.key));
        e.gain = lost(evidence_.predict(without));
        d_.effects.push_back(std::move(e));
        continue;
      }
      std::string text = fmt::format("{}: the {} is not where it was in the reference run", name,
                                     of_.record.on_table ? "ball or the sensor" : "piece");
      for (const FittedNumber& n : e.numbers) {
        const double moved = n.value - number_of(of_.declared, n.key);
        if (n.high - n.low < std::abs(moved))
          text += fmt::format(", {} {:+.1f}", n.key.substr(n.key.find('.', 14) + 1), moved);
      }
      d_.notes.push_back(text + ".");
    }
  }

  /// Readings that are elsewhere in every lap: noise to a fit, but more than samples have. Where no
  /// more than drifts are named but for what is minor, these were to explain it.
  void tell_shifts_between_laps() {
    if (selection_.interrupted || !options_.suspects.empty()) return;
    const bool named = std::any_of(d_.effects.begin(), d_.effects.end(), [](const FoundEffect& e) {
      return is_of_machine(e) && !drifts(e) && !e.minor;
    });
    const Prediction left = evidence_.predict(d_.found);
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (!is_reading(channels[c].kind)) continue;
      const double shift = shift_between_laps(evidence_, left, c).value_or(0),
                   noise = evidence_.noise().channels[c].rms;
      if (shift < kShifted * noise) continue;
      const std::string text = fmt::format("{} shifts by {:.2g} um from lap to lap",
                                           channel_name(channels[c]), 1e6 * shift);
      d_.notes.push_back(fmt::format(
          "{}, {:.0f} times the noise of a sample, as with a clamp that slips or a drift.", text,
          shift / noise));
      if (!named) d_.vibrations.push_back(text);
    }
  }

  void flag_minor() {
    double largest = 0;
    for (const FoundEffect& e : d_.effects) largest = std::max(largest, e.contour_error_um);
    for (FoundEffect& e : d_.effects)
      e.minor = e.contour_error_um < 0.02 * largest && e.contour_error_um < 0.5;
  }

  void tell_steps(const std::vector<double>& made) {
    for (std::size_t c = 0; c < made.size(); ++c) {
      if (made[c] <= kFloorScatter * evidence_.count(c, Role::held_out)) continue;
      const ComparedChannel& channel = evidence_.replica().channels()[c];
      const ShownUnit unit = shown_unit(channel);
      d_.notes.push_back(
          fmt::format("{} is recorded in steps of {:.3g} {}; what is left of it is no more than "
                      "those can make.",
                      channel_name(channel), evidence_.step_of(c) * unit.factor, unit.name));
    }
  }

  /// But for where the piece lies: that is no fault that a model of it could be wrong about.
  std::vector<StillOff> what_is_still_off() const {
    Machine clamped = of_.declared;
    for (const FreedNumber& n : found().nuisances.numbers)
      if (is_clamping(n.number.key))
        move_number(clamped, n.number.key, number_of(d_.found, n.number.key));
    return signals_still_off(evidence_, options_, before_.chatter, clamped, d_.found);
  }

  void tell_still_off(const std::vector<StillOff>& off) {
    double most = 0;
    for (const auto& [channel, is, noise, was] : off) {
      const ShownUnit unit = shown_unit(channel);
      d_.notes.push_back(
          fmt::format("{} is still off by {:.3g} {} rms{}, {:.3g} times its noise; it was {:.3g}.",
                      channel_name(channel), is * unit.factor, unit.name,
                      evidence_.partition().repeated ? " on held-out laps" : "", is / noise,
                      was * unit.factor));
      if (is / noise > most) most = is / noise, d_.still_off = channel;
    }
  }

  void tell_laws() {
    UnnamedLaws unnamed = search_laws(evidence_, selection_, of_.candidates, options_, still_off_);
    if (unnamed.laws.empty()) return;
    if (unnamed.instead) {
      d_.notes.push_back(unnamed.note);
      std::erase_if(d_.effects, [](const FoundEffect& e) {
        return !e.place.empty() && e.place != "setup" && e.name != PeriodSlip::text.name;
      });
      withdrawn_ = true;
    }
    d_.laws = std::move(unnamed.laws);
    d_.found = unnamed.machine;
    // What is not told goes out of it, unless the laws were learnt beside that.
    Machine less = std::move(unnamed.machine);
    for (const auto& [key, value] : put_back_) move_number(less, key, value);
    const auto held_out = [&](const Machine& m) {
      return evidence_.chi2(evidence_.residual(evidence_.predict(m)), Role::held_out);
    };
    if (held_out(less) < held_out(d_.found) + options_.least_gain) d_.found = std::move(less);
  }

  void tell_figures() {
    const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
    const Prediction before = evidence_.predict(of_.declared), after = evidence_.predict(d_.found);
    for (const auto& [role, name] :
         {std::pair{Role::fitted, "fitted laps"}, std::pair{Role::held_out, "held-out laps"}})
      for (std::size_t c = 0; c < channels.size(); ++c)
        d_.figures.push_back({channels[c], name, evidence_.rms(before, c, role),
                              evidence_.rms(after, c, role), evidence_.noise_left(c)});
    if (d_.effects.empty()) return;
    const std::vector<std::string> worse = signals_made_worse(d_.figures);
    add(d_.warnings, worse);
    std::vector<SignalFigure> at_rest = d_.figures;
    std::erase_if(at_rest,
                  [&](const SignalFigure& f) { return is_stirred(before_.chatter, f.channel); });
    made_worse_ = !signals_made_worse(at_rest).empty();
  }

  /// With suspects, nothing but these.
  bool is_sought(const Excitation& e) const {
    return is_suspected(options_.suspects, e.key) ||
           std::any_of(options_.suspects.begin(), options_.suspects.end(),
                       [&](const std::string& s) { return (e.name + ".").starts_with(s + "."); });
  }

  void tell_ladder() {
    std::vector<double> rms;
    for (std::size_t c = 0; c < evidence_.replica().channels().size(); ++c)
      rms.push_back(evidence_.rms(selection_.base.prediction, c, Role::held_out));
    d_.ladder.push_back({"declared", selection_.base.held_out / std::max(1.0, floor_), rms});
    for (const LadderStep& r : selection_.ladder)
      d_.ladder.push_back({r.name, r.held_out / std::max(1.0, floor_), r.rms});
  }

  void judge() {
    // What is no part of the search was explained before it began.
    const bool beforehand =
        before_.slip || !std::all_of(d_.effects.begin(), d_.effects.end(), is_of_machine);
    const double before =
        excess(beforehand ? evidence_.chi2(evidence_.residual(evidence_.predict(of_.declared)),
                                           Role::held_out)
                          : selection_.base.held_out);
    const double after = excess(withdrawn_ ? selection_.base.held_out : told_held_out_);
    // A piece that lies elsewhere is no fault of the machine.
    const bool named = std::any_of(d_.effects.begin(), d_.effects.end(), is_of_machine);
    double ratio = 1 + after / std::max(1.0, floor_);
    if (ratio >= kQuiet && !named && !still_off_ && d_.laws.empty() && d_.vibrations.empty()) {
      const std::vector<double> made = made_by_steps(evidence_, options_, selection_.base);
      const double beyond = after - std::accumulate(made.begin(), made.end(), 0.0);
      if (beyond < (kQuiet - 1) * floor_) ratio = 1, tell_steps(made);
    }
    d_.chi2 = {before + floor_, after + floor_, floor_};
    d_.explained_share = before > 0 ? std::clamp(1 - after / before, 0.0, 1.0) : 0;
    d_.left = ratio < kQuiet ? 0 : std::sqrt(ratio);
    d_.verdict = verdict_of({
        .interrupted = selection_.interrupted,
        .held_out_samples = evidence_.count(Role::held_out),
        .excited = std::any_of(d_.excitation.begin(), d_.excitation.end(),
                               [&](const Excitation& e) { return e.excited && is_sought(e); }),
        .named = named,
        .law = !d_.laws.empty(),
        .vibrates = !d_.vibrations.empty(),
        .still_off = still_off_,
        .made_worse = made_worse_,
        .few_effects = found().found() <= options_.few_effects,
        .chatter_named = !before_.chatter.empty(),
        .ratio = ratio,
        .explained_share = d_.explained_share,
    });
    if (!d_.differential && !selection_.interrupted && evidence_.noise().from_repetitions &&
        ratio > options_.model_form) {
      d_.model_form_share = before > 0 ? std::min(1.0, after / before) : 1;
      d_.warnings.push_back(fmt::format(
          "Model form error: {} of what the declared machine does not explain is still there "
          "({:.2f} times the noise). Against the declared machine alone no effect can be called "
          "the cause; compare with a healthy run of the same program.",
          percent(d_.model_form_share), ratio));
    }
  }

  const DiagnosisCase& of_;
  const Evidence& evidence_;
  const DiagnosisOptions& options_;
  const SelectionResult& selection_;
  const FoundBeforehand& before_;
  double floor_;
  bool inexact_;             ///< the model is known not to be the machine
  bool made_worse_ = false;  ///< some signal is, by what was added
  bool still_off_ = false;   ///< some signal is, by more than a model of the cause may be wrong by
  std::vector<std::string> pulled_;  ///< declared numbers that were, and are not found
  bool withdrawn_ = false, withheld_ = false;
  double told_held_out_ = selection_.found.held_out;  ///< chi-square that what is told leaves
  std::vector<FreedNumber> held_;                     ///< released numbers that are not told
  std::vector<std::pair<std::string, double>>
      put_back_;  ///< numbers of what is not told, as they were
  Diagnosis d_;
};

}  // namespace

std::vector<std::string> signals_made_worse(const std::vector<SignalFigure>& figures) {
  constexpr double kWorse = 1.25;
  std::vector<std::string> sentences;
  for (const SignalFigure& f : figures) {
    if (f.run != "held-out laps" || f.after <= kWorse * f.before || f.after <= kLoud * f.floor)
      continue;
    const ShownUnit unit = shown_unit(f.channel);
    sentences.push_back(fmt::format(
        "With what was added {} is further off than without, {:.3g} {} instead of "
        "{:.3g}: it cannot be all of what is there, or stands for something else.",
        channel_name(f.channel), f.after * unit.factor, unit.name, f.before * unit.factor));
  }
  return sentences;
}

Diagnosis findings_of(const DiagnosisCase& of, const Evidence& evidence,
                      const DiagnosisOptions& options, const SelectionResult& selection,
                      const FoundBeforehand& before, bool differential) {
  return Report(of, evidence, options, selection, before, differential).write();
}

}  // namespace vcnc
