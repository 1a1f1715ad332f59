// Two runs side by side: what differs in their figures, their verdicts and their declared machines.
//
// Runs need not have the same program or piece: what can be compared is, what cannot is said in one
// sentence each. Where the piece and the scan line are the same, e_n is compared station by
// station: the mean of both runs in bins of 0.25 mm. The commanded motion is the same when every
// commanded position of every cycle is, to the last bit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/curves.hpp"
#include "analysis/features.hpp"
#include "analysis/recording.hpp"
#include "analysis/summary.hpp"

namespace vcnc {

inline constexpr double kProfileBin = 0.25e-3;  ///< [m]

/// What a comparison needs of one run.
struct ComparedRun {
  std::string name;  ///< as the user called it
  Summary summary;
  RunBegin begin;
  PerAxis<Statistics> force;    ///< share of the limit, every row while the program runs
  std::uint64_t motion = 0;     ///< fingerprint of all commanded positions
  Curve profile;                ///< mean e_n over the station [m]
  PerAxis<Envelope> following;  ///< over time [s]
  double seconds = 0;           ///< length of the recording
};

/// A key that the two declare differently; empty where one does not have it.
struct KeyDifference {
  std::string key, a, b;
};

struct Comparison {
  ComparedRun a, b;
  std::vector<KeyDifference> machine, piece;  ///< as declared
  bool same_motion = false;                   ///< commanded positions
  bool same_trace = false;                    ///< every frame on the bus
  bool same_line = false;                     ///< e_n can be compared station by station
  Curve e_n_difference;                       ///< B - A over the station [m], where both measured
  std::vector<std::string> not_comparable;    ///< sentences
};

/// Reads a run once. `name` is what messages call it.
ComparedRun read_run(const RecordingReader& recording, const std::string& name);

Comparison compare(ComparedRun a, ComparedRun b);

/// Keys with different values of two texts as to_toml writes them.
std::vector<KeyDifference> differing_keys(const std::string& a, const std::string& b);

/// The tables for the terminal.
std::string to_text(const Comparison& comparison);

}  // namespace vcnc
