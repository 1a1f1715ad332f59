#include "diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/findings.hpp"
#include "diagnosis/search/differential.hpp"
#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/period_slip_search.hpp"

namespace vcnc {
namespace {

/// Part of the noise's chi-square that an effect must gain: as much may be of a model that is not
/// quite the machine's.
constexpr double kFormAllowance = 0.001;
/// Part that the form of the model may leave at most, and how much of it an effect must explain.
constexpr double kForm = 0.04, kShareOfForm = 0.15;
/// A reading is not told where it is off by more than this, of its roughness.
constexpr double kUntold = 20;

/// Standard deviation of what is not smooth in a signal: of second differences, by their median.
double roughness(const std::vector<double>& value) {
  std::vector<double> second;
  for (std::size_t k = 2; k < value.size(); ++k)
    if (const double d = std::abs(value[k] - 2 * value[k - 1] + value[k - 2]); std::isfinite(d))
      second.push_back(d);
  if (second.empty()) return 0;
  const auto middle = second.begin() + static_cast<std::ptrdiff_t>(second.size() / 2);
  std::nth_element(second.begin(), middle, second.end());
  return 1.4826 * *middle / std::sqrt(6.0);
}

/// Where the model does not tell what the healthy machine read, as in the moment of touching or
/// while the drag on the ball turns over, it does not tell what a change does to it either.
void leave_out_untold(Record& difference, const Record& now) {
  for (MeasuredSignal& signal : difference.signals) {
    if (signal.kind != SignalKind::deflection) continue;
    const std::vector<double>& measured = now.find(signal.kind, signal.axis)->value;
    const double most = kUntold * std::max(roughness(measured), signal.resolution);
    if (most <= 0) continue;
    for (std::size_t k = 0; k < measured.size(); ++k)
      if (std::abs(measured[k] - signal.value[k]) > most) signal.value[k] = kMissing;
  }
}

}  // namespace

Diagnosis diagnose(const DiagnosisCase& of, const std::optional<HealthyRun>& healthy,
                   const DiagnosisOptions& options, const KeepGoing& keep_going) {
  DifferentialRecord record{of.record, 1};
  if (healthy) {
    record = less_healthy(of.record, healthy->record, healthy->replica, of.declared);
    leave_out_untold(record.record, of.record);
  }
  Machine declared = of.declared;
  std::optional<PeriodSlip> slip;
  if (declared.effects.get<PeriodSlip>().null())
    slip = find_period_slip(of.record, of.replica.channels(), of.replica.predict(declared),
                            declared.probe.signal_period);
  if (slip) declared.effects.get<PeriodSlip>() = *slip;
  Evidence evidence(record.record, of.replica, declared, record.noise_scale);
  const DiagnosisCase seen{record.record, of.replica, of.declared, of.candidates};
  DiagnosisOptions careful = options;
  careful.least_gain =
      std::max(options.least_gain, kFormAllowance * evidence.count(Role::held_out));
  careful.form = kForm * evidence.count(Role::held_out);
  careful.share_of_form = kShareOfForm;
  SelectionResult selection =
      select_effects_of(evidence, declared, of.candidates, careful, keep_going);
  return findings_of(seen, evidence, careful, std::move(selection), slip, healthy.has_value());
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

}  // namespace vcnc
