// The word that a diagnosis ends with, from what its search left.
//
// What is left is told by chi-square on held-out laps over what noise makes of it: 1 where nothing
// is. Nothing is left below 1.05, and some signal may be off all the same (a short stretch of one
// among many). An effect explains what there was
//   where what is left is noise to half a percent, or
//   where it explains 98 %, or
//   where nothing is left and it explains 90 %, unless it took so many names that they imitate.
// What a law without a name does, and what vibrates by itself, nothing named explains.
#pragma once

#include "diagnosis/diagnosis.hpp"

namespace vcnc {

/// Chi-square over that of noise below which nothing is left.
inline constexpr double kQuiet = 1.05;
/// Held-out samples that tell something.
inline constexpr double kFewSamples = 200;

struct VerdictGrounds {
  bool interrupted = false;
  double held_out_samples = 0;
  bool excited = false;        ///< an effect of the size that is usual would have shown
  bool named = false;          ///< an effect of the machine or its measurement is told
  bool law = false;            ///< a law without a name is told
  bool vibrates = false;       ///< a signal does, of unknown cause
  bool still_off = false;      ///< a signal is, by more than a model of the cause may be wrong by
  bool made_worse = false;     ///< a signal is, by what was added
  bool few_effects = true;     ///< no more than a search with names may end with
  bool chatter_named = false;  ///< what a drive that vibrates did was not compared sample by sample
  double ratio = 1;            ///< chi-square left over that of noise
  double explained_share = 0;  ///< of the excess before
};

DiagnosisVerdict verdict_of(const VerdictGrounds& grounds);

}  // namespace vcnc
