// Real programs for truth: `vcnc run` with a process killed, stopped or restarted at any moment.
//
// Each run plays a drawn crash or an ordinary scan on real processes over the hub, paced to real
// time, while one of its ten processes (drives, spindle, probe, overtravel module, NC unit,
// analysis) is killed, stopped or restarted, or the disk of the analysis is full, at a drawn moment
// of host time between the first start of a program and the end. Number i of a seed is a pure
// function of (seed, i); what the host makes of it is not, which is the point. Afterwards
//   * vcnc ended by itself, with exit code 0 or 3 and the trace hash of the same scenario in one
//     process, or with 1 and a message that names the process;
//   * none of its processes is left, nor a folder of sockets;
//   * its recording opens, or the run never began and nothing is there;
//   * a module that died is in an alarm 3201 of the recording, where the analysis lived to see it;
//   * the axes stand at the end: in the last rows where the NC unit lived, else by what the drives
//     tell of their run-down; the spindle stands or, without NC unit, says that it is locked.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/lockout_suite.hpp"

namespace vcnc {

struct ProcessSuite {
  std::uint64_t seed = 1, runs = 0;
  std::vector<std::string> machines;
  std::string program;  ///< vcnc itself
  int jobs = 1;
  std::string only;  ///< "process-N": this one alone
  const std::atomic<bool>* stop = nullptr;
  std::function<void(std::size_t done, std::size_t bad)> progress{};

  /// Verdicts in the order of their numbers; fewer when `stop` was set.
  std::vector<LockoutVerdict> run() const;
};

}  // namespace vcnc
