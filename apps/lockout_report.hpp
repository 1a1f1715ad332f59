// The results of a lockout suite as text, JSON and JUnit XML.
#pragma once

#include <string>
#include <vector>

#include "apps/lockout_suite.hpp"

namespace vcnc {

/// What a suite was, for its reports.
struct LockoutResults {
  std::uint64_t seed = 1;
  std::vector<LockoutItem> items{};  ///< of the verdicts, in their order
  std::vector<LockoutVerdict> verdicts{};
  LockoutSummary summary{};
  double wall_seconds = 0;
  bool interrupted = false;
};

/// Table, distributions with histograms, and how to repeat what was not as expected.
std::string lockout_text(const LockoutResults& results);
/// Runs on real processes by kind, process and phase; empty without any.
std::string process_table(const LockoutResults& results);
std::string lockout_json(const LockoutResults& results);
std::string lockout_junit(const LockoutResults& results);

/// `vcnc lockout` arguments that repeat one run.
std::string repeat_arguments(const LockoutResults& results, const LockoutVerdict& verdict);

}  // namespace vcnc
