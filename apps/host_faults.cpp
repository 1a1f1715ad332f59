#include "apps/host_faults.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace vcnc {

namespace {

constexpr double kSlowPeriod = 0.02;  ///< stopped so long, running so long [s]

}  // namespace

HostFaults::HostFaults(const BusFaults& faults, std::filesystem::path folder)
    : folder_(std::move(folder)) {
  for (const BusFault& fault : faults)
    if (fault.of_host()) faults_.push_back({fault});
}

void HostFaults::note(const std::string& progress) {
  double t = 0;
  if (std::sscanf(progress.c_str(), "t %lf s", &t) == 1) simulated_ = t;
}

void HostFaults::act(Launcher& launcher) {
  for (Armed& armed : faults_)
    if (!armed.over && (armed.begun || launcher.running(armed.fault.node))) act(armed, launcher);
}

std::vector<std::string> HostFaults::not_begun() const {
  std::vector<std::string> texts;
  for (const Armed& armed : faults_)
    if (!armed.begun) texts.push_back(armed.fault.text);
  return texts;
}

std::uintmax_t HostFaults::largest_file() const {
  std::uintmax_t largest = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error))
    if (entry.is_regular_file(error)) largest = std::max(largest, entry.file_size(error));
  return largest;
}

void HostFaults::act(Armed& armed, Launcher& launcher) {
  const BusFault& fault = armed.fault;
  const double host = clock_.elapsed();
  const double now = fault.wall_s >= 0 ? host : simulated_;
  if (!armed.begun) {
    if (now < (fault.wall_s >= 0 ? fault.wall_s : seconds(fault.from))) return;
    armed.begun = true;
    armed.since = host;
    armed.over = true;
    switch (fault.kind) {
      case BusFault::Kind::kill:
        return launcher.signal(fault.node, SIGKILL);
      case BusFault::Kind::restart:
        return launcher.restart(fault.node);
      case BusFault::Kind::disk_full:
        return launcher.limit_files(fault.node, largest_file());
      default:
        break;
    }
  }
  armed.over = fault.cycles > 0 && host - armed.since >= seconds(fault.cycles);
  const bool toggle = fault.kind == BusFault::Kind::slow && host - armed.toggled_at >= kSlowPeriod;
  const bool stop = !armed.over &&
                    (toggle ? !armed.stopped : fault.kind == BusFault::Kind::stop || armed.stopped);
  if (stop == armed.stopped) return;
  launcher.signal(fault.node, stop ? SIGSTOP : SIGCONT);
  armed.stopped = stop;
  armed.toggled_at = host;
}

}  // namespace vcnc
