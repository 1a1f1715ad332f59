// Faults of the host on real processes: kill, stop and slow them at a time of the run or of the
// wall.
#pragma once

#include <string>

#include "apps/launcher.hpp"
#include "bus/fault.hpp"
#include "bus/pacer.hpp"

namespace vcnc {

class HostFaults {
 public:
  /// Takes those of the host; the process of "drive Y" has the launcher's name "drive Y".
  explicit HostFaults(const BusFaults& faults);

  bool empty() const { return faults_.empty(); }
  /// The progress as the analysis tells it, "t    1.20 s ...": simulated time, in steps of 0.2 s.
  void note(const std::string& progress);
  /// Does what is due. Call it every few milliseconds.
  void act(Launcher& launcher);

 private:
  struct Armed {
    BusFault fault;
    bool begun = false, over = false;
    bool stopped = false;   ///< SIGSTOP is in force
    double since = 0;       ///< host or simulated time at which it began [s]
    double toggled_at = 0;  ///< host time [s]
  };
  void act(Armed& armed, Launcher& launcher);

  std::vector<Armed> faults_;
  Pacer clock_;
  double simulated_ = -1;  ///< [s]
};

}  // namespace vcnc
