#include "bus/barrier.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace vcnc {

namespace {

constexpr int kWaitSliceMs = 100;  // how soon a stop from outside is noticed

bool stop_asked(const std::atomic<bool>* flag) {
  return flag != nullptr && flag->load(std::memory_order_relaxed);
}

}  // namespace

Barrier::Barrier(Transport& bus, const Roster& roster, const std::atomic<bool>* stop)
    : bus_(bus), roster_(roster), stop_(stop) {
  if (roster.empty()) throw std::invalid_argument("the roster of the bus is empty");
  for (const RosterEntry& entry : roster) {
    if (entry.id < 1 || entry.id > 127)
      throw std::invalid_argument(
          fmt::format("node id {} of {}: allowed is 1..127", entry.id, entry.name));
    const auto id = static_cast<std::size_t>(entry.id);
    if (expected_[id])
      throw std::invalid_argument(fmt::format("node id {} of {} is used twice", id, entry.name));
    expected_.set(id);
    tokens_.set(id, entry.token);
  }
}

const std::string& Barrier::name(int id) const {
  return std::find_if(roster_.begin(), roster_.end(),
                      [id](const RosterEntry& e) { return e.id == id; })
      ->name;
}

std::string Barrier::missing() const {
  std::string names;
  for (const RosterEntry& entry : roster_)
    if (!arrived_[static_cast<std::size_t>(entry.id)])
      names += (names.empty() ? "" : ", ") + entry.name;
  return names;
}

void Barrier::lose(Tick k, std::size_t id, const std::string& why) {
  expected_.reset(id);
  gone_.set(id);
  lost_.push_back({static_cast<int>(id), name(static_cast<int>(id)), k, why});
}

/// Whether the frame is one for the master.
bool Barrier::note(Tick k, const Frame& frame) {
  const auto node_of = [&](int base) {
    return frame.id > base && frame.id < base + 128 ? static_cast<std::size_t>(frame.id - base) : 0;
  };
  if (const std::size_t id = node_of(kTokenBase)) {
    if (!expected_[id] || !tokens_[id]) return false;
    arrived_.set(id);
    std::uint32_t ns = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(frame.len, 4); ++i)
      ns |= std::uint32_t{frame.data[i]} << (8 * i);
    wasted_ns_ += ns;
    return false;
  }
  for (const int base : {kEmcyBase, kStatusBase, kHeartbeatBase})
    if (const std::size_t id = node_of(base); id > 0 && gone_[id]) {
      ++late_frames_;
      return false;
    }
  if (const std::size_t id = node_of(kStatusBase)) {
    if (!expected_[id] || tokens_[id]) return true;
    if (arrived_[id]) {
      lose(k, id, fmt::format("{} answered twice in cycle {}", name(static_cast<int>(id)), k));
      return false;
    }
    arrived_.set(id);
  } else if (const auto heartbeat = decode_heartbeat(frame)) {
    const auto node = static_cast<std::size_t>(heartbeat->node);
    // Of a module with faults the frame may be spoiled: that is for the master to judge.
    if (!expected_[node] || tokens_[node]) return true;
    if (heartbeat->state == NmtState::pre_operational)
      lose(k, node, fmt::format("{} went pre-operational in cycle {}", name(heartbeat->node), k));
    if (heartbeat->state == NmtState::boot_up)
      lose(k, node, fmt::format("{} restarted in cycle {}", name(heartbeat->node), k));
    if (heartbeat->state == NmtState::stopped)
      lose(k, node, fmt::format("{} left the bus in cycle {}", name(heartbeat->node), k));
  }
  return true;
}

bool Barrier::collect(Tick k, Frames& answers, int timeout_ms) {
  forget();
  wasted_ns_ = 0;
  int waited_ms = 0;  // since the last frame that arrived
  while (!complete()) {
    if (stop_asked(stop_)) return false;
    const std::size_t known = answers.size();
    const int slice_ms = std::min(kWaitSliceMs, timeout_ms - waited_ms);
    switch (bus_.receive(answers, slice_ms)) {
      case Transport::Received::closed:
        throw BarrierError(fmt::format("the bus was closed in cycle {}", k));
      case Transport::Received::timeout:
        waited_ms += slice_ms;
        if (waited_ms < timeout_ms) break;
        for (std::size_t id = 1; id < expected_.size(); ++id)
          if (expected_[id] && !arrived_[id])
            lose(k, id,
                 fmt::format("no answer within {} ms in cycle {} from: {}", timeout_ms, k,
                             name(static_cast<int>(id))));
        break;
      case Transport::Received::frames: {
        std::size_t kept = known;
        for (std::size_t i = known; i < answers.size(); ++i)
          if (note(k, answers[i])) {
            if (kept != i) answers[kept] = answers[i];
            ++kept;
          }
        answers.resize(kept);
        break;
      }
    }
  }
  return true;
}

Transport::Received Barrier::hear(NmtState state, int timeout_ms) {
  scratch_.clear();
  const Transport::Received received = bus_.receive(scratch_, timeout_ms);
  if (received == Transport::Received::closed)
    throw BarrierError("the bus was closed during start-up");
  for (const Frame& frame : scratch_) {
    const auto heartbeat = decode_heartbeat(frame);
    if (!heartbeat || !expected_[static_cast<std::size_t>(heartbeat->node)]) continue;
    if (heartbeat->state == NmtState::stopped)
      throw BarrierError(fmt::format("{} left the bus during start-up", name(heartbeat->node)));
    if (heartbeat->state == state) arrived_.set(static_cast<std::size_t>(heartbeat->node));
  }
  return received;
}

}  // namespace vcnc
