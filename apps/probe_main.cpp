// vcnc-probe: the scanning probe in contact with the piece, and its acquisition module.
#include <memory>

#include "apps/serve.hpp"
#include "apps/switch_on.hpp"
#include "bus/truth.hpp"
#include "configs/config.hpp"
#include "probe_sim/probe_node.hpp"

namespace {

int probe(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options =
      parse_node_options(argc, argv, "The scanning probe on the bus", "mbtsw");
  const Machine machine = switched_on_at(load_machine(options.machine), options.switched_on_at);
  std::unique_ptr<Piece> piece;
  if (!machine.setup.piece.empty()) piece = make_piece(load_piece(machine.setup.piece));
  const auto truth = open_truth_reader(options.truth);
  ProbeNode node(machine, std::move(piece), options.seed, *truth);
  return serve(node, options);
}

}  // namespace

int main(int argc, char** argv) { return vcnc::guarded_main("vcnc-probe", probe, argc, argv); }
