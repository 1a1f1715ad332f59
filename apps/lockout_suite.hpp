// Many scenarios at once: workers, results in the order of the scenarios, and what they add up to.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/lockout_run.hpp"

namespace vcnc {

struct LockoutItem {
  std::string id;
  Scenario scenario;
};

struct LockoutOptions {
  std::uint64_t seed = 1;
  std::uint64_t crashes = 500, ordinary = 500, faulted = 0;  ///< drawn scenarios
  std::vector<std::string> machines{};                       ///< for the drawn ones
  std::vector<std::string> files{};                          ///< scenario files
  std::string only{};                                        ///< an id: this one alone
  int jobs = 0;                                              ///< threads; 0: one per processor
};

/// The scenarios of a suite, in order. Throws InputError.
std::vector<LockoutItem> lockout_items(const LockoutOptions& options);

/// A private folder for the program files, gone at the end.
class LockoutFolder {
 public:
  LockoutFolder();
  ~LockoutFolder();
  LockoutFolder(const LockoutFolder&) = delete;
  LockoutFolder& operator=(const LockoutFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct LockoutRunner {
  int jobs = 0;
  Sabotage sabotage{};
  const std::atomic<bool>* stop = nullptr;
  /// Told now and then, in the calling thread: runs done so far, those not as expected.
  std::function<void(std::size_t, std::size_t)> progress{};

  /// Verdict i belongs to item i, whatever the number of threads. Throws what a scenario that
  /// cannot be made throws (InputError). Fewer verdicts when `stop` was set.
  std::vector<LockoutVerdict> run(const std::vector<LockoutItem>& items) const;
};

/// Sorted numbers and what one says of them.
struct Distribution {
  std::vector<double> sorted;
  Distribution() = default;
  explicit Distribution(std::vector<double> values);
  bool empty() const { return sorted.empty(); }
  double quantile(double share) const;  ///< nearest rank
  double min() const { return sorted.front(); }
  double max() const { return sorted.back(); }
  /// Counts in `bins` equal parts of [from, to]; what lies outside counts in the end ones.
  std::vector<std::size_t> histogram(double from, double to, std::size_t bins) const;
};

/// A suite as figures.
struct LockoutSummary {
  std::size_t runs = 0, crashes = 0, ordinary = 0, faulted = 0, processes = 0, as_expected = 0;
  std::size_t refused = 0, soft = 0, hard = 0, both = 0;
  std::size_t missed = 0;       ///< a stop was expected and none came
  std::size_t false_trips = 0;  ///< no stop was expected and one came
  std::size_t unsafe = 0;       ///< with a fault, not as it must be
  std::size_t borne = 0;        ///< with a fault, and the program came to its end
  std::size_t uncountable = 0;  ///< tripped while the ball was too fast for the sensor
  std::size_t early = 0;        ///< tripped before the range was left: the reading was lost
  /// Of the runs that tripped countably: from the range to the first action (hold or quick stop),
  /// and from the hard threshold to the quick stop [s].
  Distribution reaction, hard_reaction;
  Distribution stopping_distance;  ///< [m]
  Distribution limit_share;        ///< where it must stay below 1
  Distribution unchecked_share;    ///< of scenarios with within_limit = false
  Distribution lock_time;          ///< [s] from T to the locked spindle
  Distribution standstill_time;    ///< [s] from T
};
LockoutSummary summarise(const std::vector<LockoutVerdict>& verdicts);

}  // namespace vcnc
