// Fault confinement of one CAN node: its error counters and what follows from them.
//
//   transmit error counter  TEC  +8 for an error while sending, -1 for a frame sent
//   receive error counter   REC  +1 for an error while receiving (+8 if the node was the first to
//                                see it), -1 for a frame received; above 127 back to 127
//   error active   both below 128       warning from 96 on
//   error passive  one of them above 127
//   bus-off        TEC above 255: takes no part any more, neither sending nor receiving
//
// A sender that is error passive and only misses the acknowledgement does not count that, so a node
// that is alone on the bus never goes bus-off. After a request to return, bus-off ends with both
// counters at 0 when 128 sequences of 11 recessive bits have been seen: at least 1408 bit times.
//
// Source: ISO 11898-1:2015, 12.1.4 (fault confinement rules a to h).
#pragma once

#include <algorithm>
#include <cstdint>

namespace vcnc {

class ErrorCounters {
 public:
  enum class State { error_active, error_passive, bus_off };
  static constexpr int kWarning = 96, kPassive = 128, kBusOff = 256, kSequences = 128;

  State state() const {
    if (transmit_ >= kBusOff) return State::bus_off;
    return transmit_ >= kPassive || receive_ >= kPassive ? State::error_passive
                                                         : State::error_active;
  }
  bool warning() const { return transmit_ >= kWarning || receive_ >= kWarning; }
  int transmit() const { return transmit_; }
  int receive() const { return receive_; }

  void sent() {
    if (state() != State::bus_off) transmit_ = std::max(transmit_ - 1, 0);
  }
  void send_error() {
    if (state() != State::bus_off) transmit_ += 8;
  }
  void not_acknowledged() {
    if (state() != State::error_passive) send_error();
  }
  void received() {
    if (state() == State::bus_off) return;
    receive_ = receive_ >= kPassive ? kPassive - 1 : std::max(receive_ - 1, 0);
  }
  void receive_error(bool first_to_see) {
    if (state() != State::bus_off) receive_ = std::min(receive_ + (first_to_see ? 8 : 1), kBusOff);
  }
  /// Bus-off and asked to return: so many sequences of 11 recessive bits went by.
  void recessive(int sequences) {
    if (state() != State::bus_off) return;
    sequences_ += sequences;
    if (sequences_ >= kSequences) *this = {};
  }

 private:
  int transmit_ = 0, receive_ = 0, sequences_ = 0;
};

}  // namespace vcnc
