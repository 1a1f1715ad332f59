// Runs one scenario on the whole machine in this process and judges it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/lockout_case.hpp"
#include "apps/lockout_trip.hpp"
#include "bus/telemetry.hpp"

namespace vcnc {

/// How a run on real processes ended.
struct ProcessEnd {
  const char* phase = "";  ///< in which its fault was meant to fall
  int exit_code = -1;
  double seconds = 0;   ///< of host time
  bool struck = false;  ///< the fault came before the end
};

struct LockoutVerdict {
  std::string id;    ///< "crash-17", "ordinary-3" or the file it came from
  std::string name;  ///< of the scenario
  Scenario::Kind kind = Scenario::Kind::program;
  Scenario::Expect expect = Scenario::Expect::trip;
  TripFigures figures{};
  TripEnd end{};
  std::size_t cycles = 0;
  bool within_limit = true;  ///< as the scenario says
  std::string trace_hash{};
  std::vector<std::string> faults{};    ///< as they were played, in time of the run
  std::optional<ProcessEnd> process{};  ///< of a run on real processes
  std::vector<std::string> failures{};  ///< empty: as expected

  bool passed() const { return failures.empty(); }
};

/// What the protection's two places are given instead of the machine: for trying out whether the
/// suite would see a protection that does not work.
using Sabotage = std::function<void(Machine& module, Machine& nc)>;

struct LockoutRunOptions {
  std::string work_folder;  ///< where the program file is put for the time of the run
  Sabotage sabotage{};
  TelemetrySink* also = nullptr;  ///< is told everything too
};

/// Throws InputError, beginning with `file`, where the scenario of that file cannot be made or its
/// own program could not run on this machine even without a probe. What the probe forbids, the run
/// itself shows. `work_folder`: see LockoutRunOptions.
void check_runnable(const Scenario& scenario, const std::string& file,
                    const std::string& work_folder);

/// Also what cannot be made or fails is in the verdict. `log` is filled anew.
LockoutVerdict run_lockout(const std::string& id, const Scenario& scenario,
                           const LockoutRunOptions& options, TripLog& log);

}  // namespace vcnc
