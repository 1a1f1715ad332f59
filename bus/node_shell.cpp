#include "bus/node_shell.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace vcnc {

namespace {

constexpr int kSyncPeriod = 240;  // the counter runs 1..240

/// PDOs come once per cycle and sender; emergencies and requests may come several times.
bool is_cyclic(std::uint16_t id) { return id >= kStatusBase && id < kSdoAnswerBase; }

}  // namespace

NodeShell::NodeShell(Node& node) : node_(node) {
  if (node.id() < 1 || node.id() > 127)
    throw std::invalid_argument("node id " + std::to_string(node.id()) + " of " +
                                std::string(node.name()) + ": allowed is 1..127");
  for (std::uint16_t id = kSyncId + 1; id < kHeartbeatBase; ++id) accepted_[id] = node.accepts(id);
  for (int other = 1; other <= 127; ++other)
    accepted_[static_cast<std::size_t>(kHeartbeatBase + other)] = node.watches(other);
  constexpr std::size_t kExpectedFrames = 32;
  arriving_.reserve(kExpectedFrames);
  inputs_.reserve(kExpectedFrames);
}

void NodeShell::boot(Frames& out) {
  state_ = NmtState::pre_operational;
  started_ = false;
  arriving_.clear();
  out.push_back(encode(Heartbeat{node_.id(), NmtState::boot_up}));
}

void NodeShell::feed(const Frame& frame, Frames& out) {
  if (frame.id == kSyncId) {
    if (const auto sync = decode_sync(frame)) on_sync(*sync, out);
  } else if (frame.id == kNmtId) {
    if (const auto nmt = decode_nmt(frame)) on_nmt(*nmt, out);
  } else if (frame.id >= accepted_.size() || !accepted_[frame.id]) {
    return;
  } else if (state_ == NmtState::pre_operational && frame.id == kSdoRequestBase + node_.id()) {
    node_.request(frame, out);
  } else if (state_ == NmtState::operational) {
    if (arriving_.size() == kMostFrames) {
      ++surplus_;
      return;
    }
    if (is_cyclic(frame.id) && std::any_of(arriving_.begin(), arriving_.end(),
                                           [&](const Frame& f) { return f.id == frame.id; }))
      ++fault_count_[kDouble];
    arriving_.push_back(frame);
  }
}

void NodeShell::on_nmt(const Nmt& nmt, Frames& out) {
  if (nmt.node != 0 && nmt.node != node_.id()) return;
  switch (nmt.command) {
    case NmtCommand::start:
      if (state_ == NmtState::operational) return;
      state_ = NmtState::operational;
      next_tick_ = 0;
      started_ = true;
      arriving_.clear();
      fault_count_ = {};
      surplus_ = 0;
      reported_ = {};
      out.push_back(encode(Heartbeat{node_.id(), NmtState::operational}));
      return;
    case NmtCommand::stop:
      state_ = NmtState::stopped;
      return;
    case NmtCommand::preop:
      if (state_ == NmtState::pre_operational) return;
      state_ = NmtState::pre_operational;
      arriving_.clear();
      out.push_back(encode(Heartbeat{node_.id(), state_}));
      return;
    case NmtCommand::reset_node:
    case NmtCommand::reset_comm:
      boot(out);
      return;
  }
}

void NodeShell::on_sync(const Sync& sync, Frames& out) {
  if (state_ == NmtState::pre_operational && started_) return stand_by(out);
  if (state_ != NmtState::operational) return;
  const int ahead = (sync.counter - sync_counter(next_tick_) + kSyncPeriod) % kSyncPeriod;
  if (ahead == kSyncPeriod - 1) {  // the previous one again: this cycle has been stepped already
    ++fault_count_[kRepeated];
    return;
  }
  fault_count_[kMissed] += static_cast<std::uint64_t>(ahead);
  const Tick k = next_tick_ + ahead;
  next_tick_ = k + 1;

  inputs_.swap(arriving_);
  arriving_.clear();
  sort_by_id(inputs_);
  const std::size_t first = out.size();
  node_.step(k, inputs_, out);
  if (node_.faulted()) {
    if (!node_.speechless()) report_faults(out);
    Frame& token = out.emplace_back();
    token.id = static_cast<std::uint16_t>(kTokenBase + node_.id());
    if (const auto wasted = static_cast<std::uint64_t>(node_.wasted_ns()); wasted > 0) {
      token.len = 4;
      for (std::size_t i = 0; i < 4; ++i)
        token.data[i] = static_cast<std::uint8_t>(wasted >> (8 * i));
    }
    return;
  }
  if (out.size() == first || out[first].id != kStatusBase + node_.id())
    throw std::logic_error(std::string(node_.name()) +
                           ": the answer to SYNC must begin with the node's cyclic frame");
  report_faults(out);
  std::rotate(out.begin() + static_cast<std::ptrdiff_t>(first),
              out.begin() + static_cast<std::ptrdiff_t>(first) + 1, out.end());
}

/// Time goes on for a module that has been taken out of operation, but it hears no PDO and sends
/// none.
void NodeShell::stand_by(Frames& out) {
  const std::size_t first = out.size();
  node_.step(next_tick_++, {}, out);
  std::size_t kept = first;
  for (std::size_t i = first; i < out.size(); ++i) {
    const bool heartbeat = out[i].id == kHeartbeatBase + node_.id();
    if (!heartbeat && out[i].id != kEmcyBase + node_.id()) continue;
    out[kept++] = heartbeat ? encode(Heartbeat{node_.id(), state_}) : out[i];
  }
  out.resize(kept);
}

void NodeShell::report_faults(Frames& out) {
  fault_count_[kLost] = host_lost_ + surplus_;
  for (std::size_t fault = 0; fault < kFaults; ++fault) {
    if (fault_count_[fault] == 0 || reported_[fault]) continue;
    reported_[fault] = true;
    Emergency emergency{.node = node_.id(),
                        .code = fault == kLost ? kOverrunError : kCommunicationError,
                        .error_register = 0x11};
    emergency.detail[0] = static_cast<std::uint8_t>(fault + 1);
    for (std::size_t byte = 0; byte < 4; ++byte)
      emergency.detail[byte + 1] = static_cast<std::uint8_t>(fault_count_[fault] >> (8 * byte));
    out.push_back(encode(emergency));
    node_.note(emergency);
  }
}

}  // namespace vcnc
