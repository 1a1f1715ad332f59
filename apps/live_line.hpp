// Passes telemetry on to the analysis and tells, five times per simulated second, how things stand.
#pragma once

#include <functional>
#include <string>

#include "analysis/session.hpp"

namespace vcnc {

class LiveLine : public TelemetrySink {
 public:
  using Tell = std::function<void(const std::string&)>;
  LiveLine(AnalysisSession& session, Tell tell) : session_(session), tell_(std::move(tell)) {}

  void begin(const RunBegin& begin) override { session_.begin(begin); }
  void row(const TelemetryRow& row) override;
  void alarm(const Alarm& alarm) override { session_.alarm(alarm); }
  void end(const RunEnd& end) override;

 private:
  AnalysisSession& session_;
  Tell tell_;
  int rows_ = 0;
};

}  // namespace vcnc
