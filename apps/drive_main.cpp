// vcnc-drive: one servo drive (X Y Z A C) or the spindle drive.
#include <algorithm>

#include "apps/serve.hpp"
#include "bus/truth.hpp"
#include "configs/config.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace {

int drive(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options =
      parse_node_options(argc, argv, "A servo or spindle drive on the bus", "mbtas");
  const Machine machine = load_machine(options.machine);
  if (options.axis == "spindle") {
    SpindleNode node(machine);
    return serve(node, options);
  }
  const auto axis =
      std::find(kAxisNames.begin(), kAxisNames.end(), options.axis) - kAxisNames.begin();
  const auto truth = open_truth_writer(options.truth);
  DriveNode node(static_cast<std::size_t>(axis), machine, options.seed, *truth);
  return serve(node, options);
}

}  // namespace

int main(int argc, char** argv) { return vcnc::guarded_main("vcnc-drive", drive, argc, argv); }
