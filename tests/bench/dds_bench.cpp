// Telemetry rows over DDS between two processes, free-running and reliable, against ddsperf with
// samples of the same size on the same machine in the same run.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "bus/dds/dds_publisher.hpp"
#include "bus/dds/dds_subscriber.hpp"
#include "tests/bench/stopwatch.hpp"

namespace vcnc {
namespace {

constexpr int kRows = 2'000'000;

class Counter : public TelemetrySink {
 public:
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow&) override { ++rows; }
  void alarm(const Alarm&) override {}
  void end(const RunEnd&) override {}
  std::int64_t rows = 0;
};

/// Rows per second from the first row() to the delivered end, 0 when one was lost.
double rows_per_second() {
  const pid_t child = ::fork();
  if (child == 0) {
    Counter counter;
    DdsSubscriber subscriber(counter);
    subscriber.wait_for_end();
    ::_exit(counter.rows == kRows ? 0 : 1);
  }
  double rate = 0;
  {
    DdsPublisher publisher;
    publisher.wait_for_subscriber(15000);
    publisher.begin({});
    const Stopwatch watch;
    TelemetryRow row;
    for (int i = 0; i < kRows; ++i) {
      row.tick = i;
      publisher.row(row);
    }
    publisher.end({});
    rate = kRows / watch.seconds();
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status == 0 ? rate : 0;
}

/// Samples per second that ddsperf's subscriber reports, median of its seconds.
double ddsperf() {
  const std::string command = fmt::format(
      "CYCLONEDDS_URI='<General><Interfaces><NetworkInterface "
      "name=\"lo\"/></Interfaces><AllowMulticast>false</AllowMulticast></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer "
      "Address=\"127.0.0.1\"/></Peers></Discovery>'; export CYCLONEDDS_URI; "
      "ddsperf -D 8 sub >/dev/null & ddsperf -D 8 -Qrss:10000 pub size {} 2>/dev/null >/dev/null & "
      "ddsperf -D 7 sub 2>/dev/null | "
      "sed -n 's/.* rate \\([0-9.]*\\) kS.*/\\1/p' | sort -n | awk '{{v[NR]=$1}} END {{print "
      "v[int((NR+1)/2)]}}'; wait",
      sizeof(TelemetryRow));
  FILE* pipe = ::popen(command.c_str(), "r");
  char line[64] = "";
  if (!pipe || !std::fgets(line, sizeof line, pipe)) line[0] = '\0';
  if (pipe) ::pclose(pipe);
  return std::atof(line) * 1e3;
}

}  // namespace
}  // namespace vcnc

int main() {
  ::setenv("VCNC_DDS_TAG", fmt::format("vcnc-bench-{}", ::getpid()).c_str(), 1);
  const double rows = vcnc::rows_per_second();
  const double samples = vcnc::ddsperf();
  fmt::print(
      "telemetry {:.0f} rows/s of {} bytes, nothing lost; ddsperf {:.0f} samples/s of the same "
      "size; ratio {:.2f}\n",
      rows, sizeof(vcnc::TelemetryRow), samples, samples > 0 ? rows / samples : 0.0);
  return rows > 0 ? 0 : 1;
}
