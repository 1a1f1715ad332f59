#include "diagnosis/verdict.hpp"

namespace vcnc {
namespace {

constexpr double kSilent = 1.005, kAllExplained = 0.98, kMostExplained = 0.9;

bool is_explained(const VerdictGrounds& g) {
  if (g.still_off || g.made_worse) return false;
  return g.ratio < kSilent || g.explained_share > kAllExplained ||
         (g.ratio < kQuiet && g.few_effects &&
          (g.explained_share > kMostExplained || g.chatter_named));
}

}  // namespace

DiagnosisVerdict verdict_of(const VerdictGrounds& g) {
  using enum DiagnosisVerdict;
  const bool nothing_left = !g.still_off && g.ratio < kQuiet;
  if (g.interrupted) return interrupted;
  if (g.held_out_samples < kFewSamples) return not_identifiable;
  if (!g.excited && !g.named && nothing_left) return not_identifiable;
  if (g.law || g.vibrates) return g.named ? partly : unexplained;
  if (g.named) return is_explained(g) ? explained : partly;
  return nothing_left ? no_deviation : unexplained;
}

}  // namespace vcnc
