#include "bus/pacer.hpp"

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

namespace vcnc {

namespace {

using Clock = std::chrono::steady_clock;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

}  // namespace

Pacer::Pacer(double speed) : made_ns_(now_ns()) {
  if (!(speed >= 0) || !std::isfinite(speed))
    throw std::invalid_argument("pace: must be 0 (free-running) or a positive factor of real time");
  if (speed > 0) period_ns_ = std::max<std::int64_t>(1, std::llround(1e9 * kCycle / speed));
}

void Pacer::wait(Tick k) {
  if (!paced()) return;
  if (!started_) {
    started_ = true;
    start_ns_ = now_ns() - k * period_ns_;
    return;
  }
  const std::int64_t due_ns = start_ns_ + k * period_ns_;
  const std::int64_t late_ns = now_ns() - due_ns;
  if (late_ns > period_ns_ / 10) ++overruns_;
  if (late_ns < 0)
    std::this_thread::sleep_until(Clock::time_point(std::chrono::nanoseconds(due_ns)));
}

double Pacer::elapsed() const { return static_cast<double>(now_ns() - made_ns_) * 1e-9; }

}  // namespace vcnc
