#include "apps/diagnose_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include "analysis/compare.hpp"
#include "analysis/whole_file.hpp"
#include "apps/keep_memory.hpp"
#include "apps/node_options.hpp"
#include "apps/page_folder.hpp"
#include "apps/progress_line.hpp"
#include "apps/stop_signal.hpp"
#include "configs/config.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/candidates/suspects.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/controller_lags.hpp"
#include "diagnosis/healthy/unknown_force.hpp"
#include "diagnosis/quadrature.hpp"
#include "diagnosis/records/any_record.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/checked_replica.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/report/diagnosis_json.hpp"
#include "diagnosis/report/diagnosis_page.hpp"
#include "diagnosis/report/diagnosis_text.hpp"

namespace vcnc {

namespace {

/// What both machines are off a record, less what a healthy run of its program has besides where
/// there is one (else null).
void append_figures(std::vector<SignalFigure>& figures, const Record& record,
                    const HealthyRun* healthy, const Machine& declared, const Machine& found,
                    const std::string& name) {
  DifferentialRecord less;
  if (healthy) less = less_healthy(record, *healthy);
  const Record& of = healthy ? less.record : record;
  MachineReplica replica(of, declared, piece_of(declared, of));
  if (healthy) replica.apply(less.unknown);
  const std::vector<SignalFigure> more =
      figures_of(of, replica, declared, found, name, less.noise_scales(replica.channels()));
  figures.insert(figures.end(), more.begin(), more.end());
}

/// Those of the healthy run's program less that, as the run itself.
void predict_tests(const DiagnoseOptions& options, const std::optional<HealthyRun>& healthy,
                   const Machine& declared, const Machine& found,
                   std::vector<SignalFigure>& figures) {
  for (const std::string& test : options.tests) {
    if (stop_requested()) return;
    const Record record = load_record(test, options.map, options.model);
    const bool beside = healthy && same_program(record, healthy->record);
    append_figures(figures, record, beside ? &*healthy : nullptr, declared, found, test);
  }
}

/// What of `other`, a run beside `run`, is declared otherwise where it was measured; empty: nothing
/// but where the piece lies.
std::string other_machine(const Record& run, const Record& other) {
  if (run.machine_toml.empty() || other.machine_toml.empty()) return "";
  std::vector<KeyDifference> keys = differing_keys(run.machine_toml, other.machine_toml);
  std::erase_if(
      keys, [](const KeyDifference& k) { return k.key == "name" || k.key.starts_with("setup."); });
  if (keys.empty()) return "";
  const auto told = [](const std::string& value) { return value.empty() ? "not there" : value; };
  return fmt::format(
      "{} was measured on a machine that is declared otherwise than that of {}: {} is {}, was "
      "{}{}.",
      other.source, run.source, keys[0].key, told(keys[0].b), told(keys[0].a),
      keys.size() > 1 ? fmt::format("; {} more keys differ", keys.size() - 1) : "");
}

/// With how the declared machine is fitted to the reference run, unless it was.
void tell_unknown_forces(const DiagnoseOptions& options, const ForceOfAxes& unknown,
                         bool commissioned, std::vector<std::string>& notes) {
  std::vector<std::string> forces;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (const double square = mean_square(unknown[axis]); square > 0)
      forces.push_back(fmt::format("{:.3g} {} rms on {}", std::sqrt(square),
                                   is_rotary(axis) ? "N m" : "N", kAxisNames[axis]));
  if (forces.empty()) return;
  notes.push_back(fmt::format(
      "The reference run has forces that the declared machine has not, {}; they count as there in "
      "this run, too.{}",
      fmt::join(forces, ", "),
      commissioned
          ? ""
          : fmt::format(" Names and sizes are surer against a model that is fitted to it: `vcnc "
                        "commission {}{}{} --out fitted.toml`, then --model fitted.toml.",
                        options.reference, options.map.empty() ? "" : " --map " + options.map,
                        options.model.empty() ? "" : " --model " + options.model)));
}

void tell_lags(const Machine& declared, const Machine& healthy, std::vector<std::string>& notes) {
  std::string lags;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const std::string told = told_lags(declared, healthy, axis);
    if (!told.empty()) lags += fmt::format("; {}: {}", kAxisNames[axis], told);
  }
  if (!lags.empty())
    notes.push_back(
        "The controllers of the reference run are as with other lags than declared, which count in "
        "this run, too" +
        lags + ".");
}

void append_told(std::string sentence, std::vector<std::string>& warnings) {
  if (!sentence.empty()) warnings.push_back(std::move(sentence));
}

bool same_values(const Record& a, const Record& b) {
  return std::equal(
      a.signals.begin(), a.signals.end(), b.signals.begin(), b.signals.end(),
      [](const MeasuredSignal& x, const MeasuredSignal& y) {
        const auto same = [](double p, double q) { return p == q || (p != p && q != q); };
        return x.kind == y.kind && x.axis == y.axis &&
               std::equal(x.value.begin(), x.value.end(), y.value.begin(), y.value.end(), same);
      });
}

struct CheckedRun {
  Record record;
  std::unique_ptr<MachineReplica> replica;
};

CheckedRun checked_run(const DiagnoseOptions& options, const std::string& path,
                       const Machine& declared, std::vector<std::string>& warnings) {
  CheckedRun run{load_record(path, options.map, options.model), nullptr};
  run.replica = checked_replica(run.record, declared, warnings);
  return run;
}

/// The healthy run, where --reference names one.
std::optional<CheckedRun> checked_reference(const DiagnoseOptions& options, const Record& record,
                                            const Machine& declared,
                                            std::vector<std::string>& warnings) {
  if (options.reference.empty()) return std::nullopt;
  CheckedRun run = checked_run(options, options.reference, declared, warnings);
  check_comparable(record, run.record);
  append_told(other_machine(record, run.record), warnings);
  return run;
}

/// `reference` may be null.
void check_tests(const DiagnoseOptions& options, const Record& record, const Machine& declared,
                 const CheckedRun* reference, std::vector<std::string>& warnings) {
  for (const std::string& test : options.tests) {
    const CheckedRun run = checked_run(options, test, declared, warnings);
    check_same_kinematics(record, run.record);
    if (reference && same_program(run.record, reference->record))
      check_comparable(run.record, reference->record);
    append_told(other_machine(record, run.record), warnings);
  }
}

/// Nothing without a reference.
std::optional<HealthyRun> healthy_run_of(std::optional<CheckedRun> reference,
                                         const Machine& declared) {
  if (!reference) return std::nullopt;
  return healthy_run_with_forces(reference->record, *reference->replica, declared);
}

int compare_models(const DiagnoseOptions& options, const Record& record, const Machine& declared) {
  Machine found = load_machine(options.compare);
  std::vector<std::string> warnings;
  checked_replica(record, declared, warnings);
  std::optional<CheckedRun> reference = checked_reference(options, record, declared, warnings);
  check_tests(options, record, declared, reference ? &*reference : nullptr, warnings);
  for (const std::string& warning : warnings) std::cerr << "vcnc: " << warning << '\n';
  std::vector<SignalFigure> figures;
  const std::optional<HealthyRun> healthy = healthy_run_of(std::move(reference), declared);
  const Machine& before = healthy ? healthy->machine : declared;
  // What holds for the healthy run holds in a file that says nothing else.
  if (healthy) found = with_fitted(std::move(found), declared, before);
  append_figures(figures, record, healthy ? &*healthy : nullptr, before, found, "run");
  predict_tests(options, healthy, before, found, figures);
  std::cout << figures_table(figures);
  return stop_requested() ? kExitInterrupted : kExitOk;
}

/// Of an axis that is not recorded nothing can be held against the record.
void check_recorded(const std::vector<std::string>& suspects, const std::vector<Candidate>& all,
                    const std::vector<std::string>& numbers, const Record& record) {
  for (const std::string& suspect : suspects) {
    std::vector<std::string> places;
    for (const Candidate& c : all)
      if (is_suspected({suspect}, c)) places.push_back(place_of_key(c.place));
    for (const std::string& key : numbers)
      if (is_suspected({suspect}, key)) places.push_back(place_of_key(key));
    if (!places.empty() && std::all_of(places.begin(), places.end(), [&](const std::string& place) {
          return holds_nothing_of(record, place);
        }))
      throw InputError(fmt::format("--suspect: \"{}\": {} holds nothing of {}", suspect,
                                   record.source, places.front()));
  }
}

std::vector<Candidate> candidates_of(const DiagnoseOptions& options, const Record& record,
                                     const Machine& declared) {
  std::vector<Candidate> all = candidates(declared);
  for (const std::string& effect : options.without)
    if (std::erase_if(all, [&](const Candidate& c) { return c.effect == effect; }) == 0)
      throw InputError(
          "--without: \"" + effect +
          "\" is no effect that a diagnosis would try; vcnc effects lists them, without "
          "an axis in front");
  std::vector<std::string> numbers;
  for (const FreedNumber& n : nuisances(declared)) numbers.push_back(n.number.key);
  check_recorded(options.suspects, all, numbers, record);
  all = suspected(std::move(all), numbers, options.suspects);
  std::erase_if(all, [&](const Candidate& c) {
    return options.suspects.empty() ? !is_sought(record, c) : holds_nothing_of(record, c.place);
  });
  return all;
}

/// `seen` becomes what the diagnosis was made on: in differential mode the record less the healthy
/// run.
Diagnosis diagnose_machine(const DiagnoseOptions& options, const Record& record,
                           MachineReplica& replica, std::optional<CheckedRun> reference,
                           const Machine& declared, std::vector<Candidate> candidates,
                           Record& seen) {
  ProgressLine progress;
  const auto keep_going = [&](const DiagnosisProgress& p) {
    progress.show(fmt::format("{} {:.0f} %", p.doing, p.share * 100));
    return !stop_requested();
  };
  const DiagnosisCase of{record, replica, declared, std::move(candidates)};
  if (reference) progress.show("fitting the reference run");
  const std::optional<HealthyRun> healthy = healthy_run_of(std::move(reference), declared);
  DiagnosisOptions asked;
  asked.suspects = options.suspects;
  Diagnosis d;
  if (healthy) {
    const DifferentialRecord difference = less_healthy(record, *healthy);
    seen = difference.record;
    replica.apply(difference.unknown);
    d = diagnose(of, difference, asked, keep_going);
    tell_lags(declared, healthy->machine, d.notes);
    tell_unknown_forces(options, healthy->unknown, !declared.commissioned.empty(), d.notes);
  } else {
    d = diagnose(of, asked, keep_going);
  }
  progress.show("predicting test runs");
  if (healthy && same_values(record, healthy->record))
    d.warnings.push_back(
        "The reference run holds the same values as the run itself: no difference can be found.");
  const bool interrupted = stop_requested();  // the diagnosis says so itself
  predict_tests(options, healthy, d.declared, d.found, d.figures);
  if (stop_requested() && !interrupted)
    d.warnings.push_back("Interrupted: not all test runs are predicted.");
  if (options.model.empty() && !d.effects.empty() && d.verdict != DiagnosisVerdict::explained)
    d.notes.push_back(
        "Declared is the machine that the run names; --model MACHINE.toml says otherwise which "
        "effects are believed present.");
  return d;
}

}  // namespace

int diagnose_command(const DiagnoseOptions& options) {
  keep_memory();
  catch_stop_signals(kStopping);
  const Record record = load_record(options.run, options.map, options.model);
  const Machine declared = declared_machine(options.model, record);
  if (!options.compare.empty()) {
    if (!(options.out.empty() && options.suspects.empty() && options.without.empty()))
      throw InputError(
          "--compare-only: compares two models and writes nothing; --out, --suspect and --without "
          "do not go with it");
    return compare_models(options, record, declared);
  }
  const bool bare = is_bare_encoder(record);
  if (bare && !(options.reference.empty() && options.tests.empty() && options.suspects.empty() &&
                options.without.empty()))
    throw InputError(
        "--reference, --test, --suspect, --without: are for machines, not for the signals of an "
        "encoder");
  // What cannot be predicted is refused before anything is sought.
  std::vector<std::string> of_runs;
  const auto replica = bare ? nullptr : checked_replica(record, declared, of_runs);
  std::optional<CheckedRun> reference = checked_reference(options, record, declared, of_runs);
  check_tests(options, record, declared, reference ? &*reference : nullptr, of_runs);
  std::vector<Candidate> candidates;
  if (!bare) candidates = candidates_of(options, record, declared);
  const std::string page = "report.html";
  std::filesystem::path folder;
  if (!options.out.empty()) folder = page_folder(options.out, page, kDiagnosisMark);
  Record seen = record;
  Diagnosis d = bare ? diagnose_quadrature(record, declared)
                     : diagnose_machine(options, record, *replica, std::move(reference), declared,
                                        std::move(candidates), seen);
  d.warnings.insert(d.warnings.end(), of_runs.begin(), of_runs.end());
  std::cout << to_text(d);
  const int code = stop_requested() ? kExitInterrupted : kExitOk;
  if (folder.empty()) return code;
  if (d.verdict == DiagnosisVerdict::interrupted && d.effects.empty()) {
    std::cout << folder.string() << ": nothing is written\n";
    return code;
  }
  DiagnosisStory story{.diagnosis = d, .record = seen, .residuals = {}};
  if (replica) story.residuals = model_residuals(seen, *replica, d.declared, d.found);
  write_whole_file(folder / "diagnosis.json", to_json(d, record.source));
  write_whole_file(folder / "found.toml", brief_toml(as_hypothesis(d.declared, d.found)));
  write_whole_file(folder / page, diagnosis_page(story));
  std::cout << "model:  " << (folder / "found.toml").string() << '\n'
            << "report: " << (folder / page).string() << '\n';
  return code;
}

}  // namespace vcnc
