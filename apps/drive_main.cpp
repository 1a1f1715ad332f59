// vcnc-drive: one servo drive (X Y Z A C) or the spindle drive.
#include <algorithm>
#include <string>

#include "apps/memory_folder.hpp"
#include "apps/serve.hpp"
#include "apps/switch_on.hpp"
#include "bus/truth.hpp"
#include "configs/config.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace {

int drive(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options =
      parse_node_options(argc, argv, "A servo or spindle drive on the bus", "mbtaskw");
  const Machine machine = switched_on_at(load_machine(options.machine), options.switched_on_at);
  if (options.axis == "spindle") {
    SlotFiles memory(options.memory, "spindle");
    SpindleNode node(machine, options.memory.empty() ? nullptr : &memory);
    return serve(node, options, [&] {
      return std::string(node.locked() ? "the spindle is locked" : "the spindle is not locked");
    });
  }
  const auto truth = open_truth_writer(options.truth);
  DriveNode node(axis_named(options.axis), machine, options.seed, *truth);
  return serve(node, options);
}

}  // namespace

int main(int argc, char** argv) { return vcnc::guarded_main("vcnc-drive", drive, argc, argv); }
