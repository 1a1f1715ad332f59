// Publishes a run over DDS without ever letting DDS into the machine's cycle.
//
// row() only copies into a bounded buffer; a thread of its own batches the rows and writes them. A
// free-running machine waits in row() while the buffer is full or the slowest subscriber is more
// than a window behind: it may slow down, it never loses a row. A paced machine never waits: rows
// that do not fit are dropped, counted, and known to every subscriber as a gap in the numbering.
// Best-effort readers (a dashboard) take part in neither.
#pragma once

#include <memory>

#include "bus/dds/domain.hpp"
#include "bus/telemetry.hpp"

namespace vcnc {

struct DdsPublisherOptions {
  bool paced = false;
  std::size_t buffer_rows = 16384;
  std::size_t window_rows = 65536;    ///< free-running: how far a subscriber may be behind
  std::shared_ptr<DdsDomain> domain;  ///< null: one of its own
};

class DdsPublisher : public TelemetrySink {
 public:
  explicit DdsPublisher(DdsPublisherOptions options = {});
  /// Without end() subscribers learn that the machine is gone.
  ~DdsPublisher() override;

  /// Waits until a subscriber is ready to receive every row. Throws DdsError when none comes.
  void wait_for_subscriber(int timeout_ms);

  void begin(const RunBegin& begin) override;
  void row(const TelemetryRow& row) override;
  void alarm(const Alarm& alarm) override;
  /// Returns when everything is delivered to all subscribers. Throws DdsError when that fails.
  void end(const RunEnd& end) override;

  std::uint64_t dropped() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vcnc
