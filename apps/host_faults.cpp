#include "apps/host_faults.hpp"

#include <csignal>
#include <cstdio>

namespace vcnc {

namespace {

constexpr double kSlowPeriod = 0.02;  ///< stopped so long, running so long [s]

}  // namespace

HostFaults::HostFaults(const BusFaults& faults) {
  for (const BusFault& fault : faults)
    if (fault.of_host()) faults_.push_back({fault});
}

void HostFaults::note(const std::string& progress) {
  double t = 0;
  if (std::sscanf(progress.c_str(), "t %lf s", &t) == 1) simulated_ = t;
}

void HostFaults::act(Launcher& launcher) {
  for (Armed& armed : faults_)
    if (!armed.over) act(armed, launcher);
}

void HostFaults::act(Armed& armed, Launcher& launcher) {
  const BusFault& fault = armed.fault;
  const double host = clock_.elapsed();
  const double now = fault.wall_s >= 0 ? host : simulated_;
  if (!armed.begun) {
    if (now < (fault.wall_s >= 0 ? fault.wall_s : seconds(fault.from))) return;
    armed.begun = true;
    armed.since = now;
    if (fault.kind == BusFault::Kind::kill) {
      launcher.signal(fault.node, SIGKILL);
      armed.over = true;
      return;
    }
  }
  armed.over = fault.cycles > 0 && now - armed.since >= seconds(fault.cycles);
  const bool toggle = fault.kind == BusFault::Kind::slow && host - armed.toggled_at >= kSlowPeriod;
  const bool stop = !armed.over &&
                    (toggle ? !armed.stopped : fault.kind == BusFault::Kind::stop || armed.stopped);
  if (stop == armed.stopped) return;
  launcher.signal(fault.node, stop ? SIGSTOP : SIGCONT);
  armed.stopped = stop;
  armed.toggled_at = host;
}

}  // namespace vcnc
