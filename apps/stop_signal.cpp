#include "apps/stop_signal.hpp"

#include <unistd.h>

#include <csignal>
#include <cstring>

namespace vcnc {

namespace {

std::atomic<bool> requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

const char* said = "";

extern "C" void on_signal(int number) {
  if (requested.exchange(true)) ::_exit(128 + number);
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, said, std::strlen(said));
}

}  // namespace

void catch_stop_signals(const char* says) {
  said = says;
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

const std::atomic<bool>& stop_requested() { return requested; }

}  // namespace vcnc
