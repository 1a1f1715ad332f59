#include "bus/main_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "bus/canopen_device.hpp"
#include "bus/messages.hpp"
#include "bus/sdo_client.hpp"
#include "bus/timed_bus.hpp"
#include "bus/trace_hash.hpp"

namespace vcnc {

namespace {

constexpr int kResetPeriodMs = 200, kSdoTimeoutMs = 2000;

bool is_set(const std::atomic<bool>* flag) {
  return flag != nullptr && flag->load(std::memory_order_relaxed);
}

void send(Transport& bus, const Frame& frame) { bus.send({&frame, 1}); }

/// Listens for heartbeats until all nodes show `state` or the period is over. A time-out ends the
/// period even if the transport gave up at once, so a bus on which nothing can arrive ends too.
void listen(Barrier& barrier, NmtState state, const Pacer& pacer) {
  const double end_s = pacer.elapsed() + kResetPeriodMs * 1e-3;
  while (!barrier.complete()) {
    const int left_ms = static_cast<int>((end_s - pacer.elapsed()) * 1e3);
    if (left_ms <= 0 || barrier.hear(state, left_ms) == Transport::Received::timeout) return;
  }
}

/// Waits until all nodes show `state`, `periods` times at most. False if stopped from outside.
bool await_state(Barrier& barrier, Transport& bus, NmtCommand command, bool repeat, NmtState state,
                 const MainLoopOptions& options, int& periods) {
  barrier.forget();
  send(bus, encode(Nmt{command, 0}));
  while (!is_set(options.stop)) {
    listen(barrier, state, options.pacer);
    if (barrier.complete()) return true;
    if (--periods <= 0)
      throw BarrierError(fmt::format(
          "not on the bus within {:.3g} s: {}; the machine starts no program without it",
          options.start_timeout_ms * 1e-3, barrier.missing()));
    if (repeat) send(bus, encode(Nmt{command, 0}));
  }
  return false;
}

/// One object of the boot-up procedure: what it says of each module, and what it must say.
struct Question {
  const char* what;
  std::uint16_t index;
  std::uint8_t sub;
  std::uint32_t (*expected)(const RosterEntry&);
};

constexpr std::array<Question, 3> kQuestions{{
    {"device type", 0x1000, 0, [](const RosterEntry& e) { return e.device_type; }},
    {"vendor", 0x1018, 1, [](const RosterEntry&) { return kVendorId; }},
    {"product code", 0x1018, 2, [](const RosterEntry& e) { return e.product_code; }},
}};

/// Asks all modules, which are pre-operational, at once. Names those that do not answer.
void ask(std::vector<SdoClient>& clients, const std::vector<const RosterEntry*>& modules,
         Transport& bus, const Question& question, const MainLoopOptions& options) {
  Frames slot, arrived;
  for (SdoClient& client : clients) slot.push_back(client.upload(question.index, question.sub));
  bus.send(slot);
  const double end_s = options.pacer.elapsed() + kSdoTimeoutMs * 1e-3;
  const auto done = [](const SdoClient& client) { return client.done(); };
  while (!std::all_of(clients.begin(), clients.end(), done)) {
    const int left_ms = static_cast<int>((end_s - options.pacer.elapsed()) * 1e3);
    arrived.clear();
    const auto received =
        left_ms > 0 ? bus.receive(arrived, left_ms) : Transport::Received::timeout;
    if (received == Transport::Received::closed)
      throw BarrierError("the bus was closed during start-up");
    if (received == Transport::Received::timeout) {
      std::string names;
      for (std::size_t i = 0; i < clients.size(); ++i)
        if (!clients[i].done()) names += (names.empty() ? "" : ", ") + modules[i]->name;
      throw BarrierError(
          fmt::format("no answer about object {:04X}h from: {}; the machine does "
                      "not start",
                      question.index, names));
    }
    slot.clear();
    for (const Frame& frame : arrived)
      for (SdoClient& client : clients)
        if (const auto next = client.feed(frame)) slot.push_back(*next);
    if (!slot.empty()) bus.send(slot);
  }
}

/// Whether every module is the one that the roster means (CiA 302-2, boot-up procedure): device
/// type, vendor, product. Throws BarrierError with the name of one that is not.
void identify(Transport& bus, const Roster& roster, const MainLoopOptions& options) {
  std::vector<SdoClient> clients;
  std::vector<const RosterEntry*> modules;
  for (const RosterEntry& entry : roster) {
    if (entry.product_code == 0) continue;
    clients.emplace_back(entry.id);
    modules.push_back(&entry);
  }
  if (clients.empty()) return;
  for (const Question& question : kQuestions) {
    ask(clients, modules, bus, question, options);
    for (std::size_t i = 0; i < clients.size(); ++i) {
      const RosterEntry& entry = *modules[i];
      const std::string which = fmt::format("node {} is not the {} of this machine: {}", entry.id,
                                            entry.name, question.what);
      if (clients[i].aborted() != SdoAbort::none)
        throw BarrierError(fmt::format("{} refused ({}); the machine does not start", which,
                                       text_of(clients[i].aborted())));
      const std::uint32_t found = clients[i].number(), expected = question.expected(entry);
      if (found != expected)
        throw BarrierError(fmt::format("{} {:08X}h, expected {:08X}h; the machine does not start",
                                       which, found, expected));
    }
  }
}

bool start_up(Barrier& barrier, Transport& bus, const Roster& roster,
              const MainLoopOptions& options) {
  int periods = std::max(1, options.start_timeout_ms / kResetPeriodMs);
  if (!await_state(barrier, bus, NmtCommand::reset_comm, true, NmtState::boot_up, options, periods))
    return false;
  identify(bus, roster, options);
  return await_state(barrier, bus, NmtCommand::start, false, NmtState::operational, options,
                     periods);
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
    for (; told_ < barrier_.lost().size(); ++told_)
      master_.node_lost(barrier_.lost()[told_].id, barrier_.lost()[told_].why);
    return true;
  }

  /// Cycles since the first node was lost; 0: none is.
  Tick degraded(Tick k) const { return told_ == 0 ? 0 : k - barrier_.lost().front().cycle + 1; }

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
    load_ = bus_load(frames_, options_.rates) +
            static_cast<double>(barrier_.wasted_ns()) * 1e-9 / kCycle;
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
  std::size_t told_ = 0;  ///< lost nodes of which the master knows
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
      result.complete = cycle.degraded(k) == 0;
      return;
    }
    if (cycle.degraded(k) >= options.degraded_cycles) return;
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
      if (start_up(barrier, bus, roster, options))
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
  result.lost_nodes = barrier.lost();
  result.late_frames = barrier.late_frames();
  if (!barrier.lost().empty()) result.failure = barrier.lost().front().why;
  result.trace_hash = cycle.hash();
  return result;
}

}  // namespace vcnc
