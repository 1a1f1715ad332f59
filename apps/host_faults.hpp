// Faults of the host on real processes: kill, stop, slow and restart them, and fill the disk of the
// analysis, at a time of the run or of the wall.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/launcher.hpp"
#include "bus/fault.hpp"
#include "bus/pacer.hpp"

namespace vcnc {

class HostFaults {
 public:
  /// Takes those of the host; the process of "drive Y" has the launcher's name "drive Y". Wall time
  /// counts from here. `folder` is where the analysis writes.
  HostFaults(const BusFaults& faults, std::filesystem::path folder);

  bool empty() const { return faults_.empty(); }
  /// The progress as the analysis tells it, "t    1.20 s ...": simulated time, in steps of 0.2 s.
  void note(const std::string& progress);
  /// Does what is due, to processes that run. Call it every few milliseconds.
  void act(Launcher& launcher);
  /// Those whose moment has not come, as they were written.
  std::vector<std::string> not_begun() const;

 private:
  struct Armed {
    BusFault fault;
    bool begun = false, over = false;
    bool stopped = false;   ///< SIGSTOP is in force
    double since = 0;       ///< host time at which it began [s]
    double toggled_at = 0;  ///< host time [s]
  };
  void act(Armed& armed, Launcher& launcher);
  std::uintmax_t largest_file() const;

  std::vector<Armed> faults_;
  std::filesystem::path folder_;
  Pacer clock_;
  double simulated_ = -1;  ///< [s]
};

}  // namespace vcnc
