// vcnc-analysis: subscribes to the machine's telemetry, computes the dynamic error live, records
// the run and writes the results. It is given nothing but what the NC unit publishes.
#include "analysis/session.hpp"
#include "apps/control_pipe.hpp"
#include "apps/live_line.hpp"
#include "apps/node_options.hpp"
#include "bus/dds/dds_subscriber.hpp"

namespace {

int analysis(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options = parse_node_options(argc, argv, "Live analysis of a run", "o");
  const ControlPipe launcher(options.control_fd);
  AnalysisSession session(
      {.folder = options.out, .report = !options.no_report, .csv = options.csv});
  LiveLine live(session, [&](const std::string& text) { launcher.progress(text); });
  DdsSubscriber subscriber(live);
  launcher.ready();
  subscriber.wait_for_end();
  return session.summary() ? kExitOk : kExitFailure;
}

}  // namespace

int main(int argc, char** argv) {
  return vcnc::guarded_main("vcnc-analysis", analysis, argc, argv);
}
