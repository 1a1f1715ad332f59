// vcnc-overtravel: the overtravel protection. It sees only the bus.
#include "apps/memory_folder.hpp"
#include "apps/serve.hpp"
#include "configs/config.hpp"
#include "probe_sim/overtravel_node.hpp"

namespace {

int overtravel(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options =
      parse_node_options(argc, argv, "The overtravel protection on the bus", "mbk");
  SlotFiles memory(options.memory, "overtravel");
  OvertravelNode node(load_machine(options.machine), options.memory.empty() ? nullptr : &memory);
  return serve(node, options);
}

}  // namespace

int main(int argc, char** argv) {
  return vcnc::guarded_main("vcnc-overtravel", overtravel, argc, argv);
}
