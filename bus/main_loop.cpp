#include "bus/main_loop.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bus/messages.hpp"
#include "bus/timed_bus.hpp"
#include "bus/trace_hash.hpp"

namespace vcnc {

namespace {

constexpr int kResetPeriodMs = 200;

bool is_set(const std::atomic<bool>* flag) {
  return flag != nullptr && flag->load(std::memory_order_relaxed);
}

void send(Transport& bus, const Frame& frame) { bus.send({&frame, 1}); }

/// Waits for a heartbeat of each node within what is left of the start-up time, repeating `request`.
/// A time-out counts as the time it was asked for even if the transport gave up at once, so a bus
/// without clock (in-process) ends too. False if stopped from outside.
bool await_state(Barrier& barrier, Transport& bus, Nmt request, bool repeat, NmtState state,
                 const MainLoopOptions& options, double& patience_s) {
  barrier.forget();
  send(bus, encode(request));
  for (;;) {
    if (is_set(options.stop)) return false;
    const double begin_s = options.pacer.elapsed();
    double left_s = kResetPeriodMs * 1e-3;
    bool heard = true;
    while (heard && left_s > 0) {
      const std::string before = barrier.missing();
      if (barrier.all_in_state(state, std::max(1, static_cast<int>(left_s * 1e3)))) return true;
      heard = barrier.missing() != before;
      left_s = kResetPeriodMs * 1e-3 - (options.pacer.elapsed() - begin_s);
    }
    patience_s -= kResetPeriodMs * 1e-3;
    if (patience_s <= 0)
      throw BarrierError(fmt::format("not on the bus within {:.3g} s: {}",
                                     options.start_timeout_ms * 1e-3, barrier.missing()));
    if (repeat) send(bus, encode(request));
  }
}

bool start_up(Barrier& barrier, Transport& bus, const MainLoopOptions& options) {
  double patience_s = options.start_timeout_ms * 1e-3;
  return await_state(barrier, bus, {NmtCommand::reset_comm, 0}, true, NmtState::boot_up, options,
                     patience_s) &&
         await_state(barrier, bus, {NmtCommand::start, 0}, false, NmtState::operational, options,
                     patience_s);
}

/// The verbs of a cycle; see the header for their order and meaning.
class Cycle {
 public:
  Cycle(Master& master, Transport& bus, Barrier& barrier, const MainLoopOptions& options)
      : master_(master), bus_(bus), barrier_(barrier), options_(options) {}

  void wait(Tick k) { options_.pacer.wait(k); }

  void sync(Tick k) {
    frames_.clear();
    frames_.push_back(encode(Sync{sync_counter(k)}));
    bus_.send(frames_);
  }

  bool collect(Tick k) {
    answers_.clear();
    if (!barrier_.collect(k, answers_, options_.answer_timeout_ms)) return false;
    if (bus_.lost() > 0)
      throw BarrierError(
          fmt::format("the host lost {} frames for the NC unit by cycle {}", bus_.lost(), k));
    sort_by_id(answers_);
    return true;
  }

  bool step(Tick k) {
    commands_.clear();
    master_.cycle_load(load_);
    return master_.step(k, answers_, commands_);
  }

  void command() {
    if (!commands_.empty()) bus_.send(commands_);
  }

  void log(Tick k, MainLoopResult& result) {
    frames_.insert(frames_.end(), answers_.begin(), answers_.end());
    frames_.insert(frames_.end(), commands_.begin(), commands_.end());
    sort_by_id(frames_);
    hash_.add(k, frames_);
    load_ = bus_load(frames_, options_.rates);
    result.bus_load_worst = std::max(result.bus_load_worst, load_);
    for (FrameTap* tap : options_.taps) tap->cycle(k, frames_);
    result.cycles = k + 1;
  }

  std::string hash() const { return hash_.hex(); }

 private:
  Master& master_;
  Transport& bus_;
  Barrier& barrier_;
  const MainLoopOptions& options_;
  Frames frames_, answers_, commands_;
  TraceHash hash_;
  double load_ = 0;
};

void run_cycles(Cycle& cycle, const MainLoopOptions& options, MainLoopResult& result) {
  for (Tick k = 0; !is_set(options.stop); ++k) {
    cycle.wait(k);
    cycle.sync(k);
    if (!cycle.collect(k)) break;
    const bool more = cycle.step(k);
    cycle.command();
    cycle.log(k, result);
    if (!more) {
      result.complete = true;
      return;
    }
  }
  result.failure = "interrupted";
}

/// Sends NMT "stop" when it goes out of scope, whatever the reason.
class StopAtEnd {
 public:
  explicit StopAtEnd(Transport& bus) : bus_(bus) {}
  ~StopAtEnd() {
    try {
      send(bus_, encode(Nmt{NmtCommand::stop, 0}));
    } catch (const BusError&) {
      // The bus is gone; so are the nodes.
    }
  }
  StopAtEnd(const StopAtEnd&) = delete;
  StopAtEnd& operator=(const StopAtEnd&) = delete;

 private:
  Transport& bus_;
};

}  // namespace

MainLoopResult run_main_loop(Master& master, Transport& bus, const Roster& roster,
                             const MainLoopOptions& options) {
  MainLoopResult result;
  Barrier barrier(bus, roster, options.stop);
  Cycle cycle(master, bus, barrier, options);
  {
    StopAtEnd stop(bus);
    try {
      if (start_up(barrier, bus, options))
        run_cycles(cycle, options, result);
      else
        result.failure = "interrupted";
    } catch (const BarrierError& error) {
      result.failure = error.what();
    } catch (const BusError& error) {
      result.failure = error.what();
    }
  }
  result.lost = bus.lost();
  result.trace_hash = cycle.hash();
  return result;
}

}  // namespace vcnc
