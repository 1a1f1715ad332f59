// Receives one run over DDS and tells it to a sink, in the order in which it happened.
//
// The first run that begins is followed to its end: begin, then rows and alarms in their order,
// then end. Everything is called from the subscriber's own thread. When the machine vanishes
// without an end, the sink is told RunEnd{reason = "NC unit gone"} after what was still received.
// Rows lost on the way show as missing ticks; those lost before the first or after the last
// received row count in RunEnd::gaps. Whatever the sink throws ends the subscription and comes out
// of wait_for_end().
#pragma once

#include <memory>

#include "bus/dds/domain.hpp"
#include "bus/telemetry.hpp"

namespace vcnc {

struct DdsSubscriberOptions {
  std::shared_ptr<DdsDomain> domain;  ///< null: one of its own
};

class DdsSubscriber {
 public:
  explicit DdsSubscriber(TelemetrySink& sink, DdsSubscriberOptions options = {});
  ~DdsSubscriber();  ///< stops listening

  /// Returns true when the run has ended, false after timeout_ms (-1: never).
  bool wait_for_end(int timeout_ms = -1);

  std::uint64_t lost_rows() const;  ///< all gaps in the numbering so far

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vcnc
