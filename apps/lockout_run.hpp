// Runs one scenario on the whole machine in this process and judges it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/lockout_case.hpp"
#include "apps/lockout_trip.hpp"
#include "bus/telemetry.hpp"

namespace vcnc {

struct LockoutVerdict {
  std::string id;    ///< "crash-17", "ordinary-3" or the file it came from
  std::string name;  ///< of the scenario
  Scenario::Kind kind = Scenario::Kind::program;
  Scenario::Expect expect = Scenario::Expect::trip;
  TripFigures figures{};
  TripEnd end{};
  std::size_t cycles = 0;
  bool within_limit = true;  ///< the feed check covers the way
  std::string trace_hash{};
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

/// Also what cannot be made or fails is in the verdict. `log` is filled anew.
LockoutVerdict run_lockout(const std::string& id, const Scenario& scenario,
                           const LockoutRunOptions& options, TripLog& log);

}  // namespace vcnc
