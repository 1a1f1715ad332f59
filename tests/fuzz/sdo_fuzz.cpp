// SDO servers of real modules in their shells, fed with any requests: eight bytes each, after a
// first byte that chooses the module and whether it is in operation. Before a request a byte tells
// how many cycles pass.
//
// Whatever was asked: at most one answer to a request, well-formed; what can be written stays in
// its range; afterwards a client can still read every object.
#include <memory>

#include "bus/canopen_device.hpp"
#include "bus/node_shell.hpp"
#include "bus/sdo_client.hpp"
#include "fuzz.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace {

using namespace vcnc;

constexpr int kMostCycles = 400;

std::unique_ptr<Node> module_of(int choice, TruthPort& truth) {
  const Machine machine;
  switch (choice % 4) {
    case 0:
      return std::make_unique<SpindleNode>(machine);
    case 1:
      return std::make_unique<OvertravelNode>(machine);
    case 2:
      return std::make_unique<DriveNode>(kA, machine, 1, truth);
    default:
      return std::make_unique<DriveNode>(kX, machine, 1, truth);
  }
}

int count_answers(const Frames& frames, const Node& node) {
  int answers = 0;
  for (const Frame& frame : frames) {
    if (frame.id != kSdoAnswerBase + node.id()) continue;
    ++answers;
    fuzz::require(frame.len == 8 && !frame.fd);
    const int specifier = frame.data[0] >> 5;
    fuzz::require(specifier <= 4);
    const auto m = *decode_sdo_answer(frame);
    if (specifier != 4) continue;
    std::uint32_t code = 0;
    for (std::size_t i = 0; i < 4; ++i) code |= std::uint32_t{m.data[i]} << (8 * i);
    fuzz::require(text_of(static_cast<SdoAbort>(code)) != "unknown abort code");
  }
  return answers;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const int choice = bytes.byte();
  const auto truth = open_local_truth();
  const std::unique_ptr<Node> module = module_of(choice, *truth);
  CanopenDevice device(*module);
  NodeShell shell(device);
  Frames out;
  Tick k = 0;
  shell.boot(out);
  const bool operates = (choice & 4) != 0;
  if (operates) shell.feed(encode(Nmt{NmtCommand::start, 0}), out);
  const auto sync = [&] {
    if (k < kMostCycles) shell.feed(encode(Sync{sync_counter(k++)}), out);
  };
  while (!bytes.empty()) {
    for (int cycles = bytes.byte() % 16; cycles > 0; --cycles) sync();
    out.clear();
    Frame request;
    request.id = static_cast<std::uint16_t>(kSdoRequestBase + device.id());
    const auto payload = bytes.take(8);
    request.len = static_cast<std::uint8_t>(payload.size());
    std::copy(payload.begin(), payload.end(), request.data.begin());
    shell.feed(request, out);
    if (operates) sync();
    fuzz::require(count_answers(out, device) <= 1);
  }
  for (const ObjectEntry& e : device.objects().entries()) {
    if (e.access == ObjectAccess::read_write && e.type != ObjectType::text)
      fuzz::require(e.get() >= e.least && e.get() <= e.most);
    SdoClient client(device.id());
    std::optional<Frame> next = client.upload(e.index, e.sub);
    while (next) {
      out.clear();
      device.request(*next, out);
      fuzz::require(out.size() == 1);
      next = client.feed(out[0]);
    }
    fuzz::require(client.done() && client.aborted() == SdoAbort::none);
  }
  return 0;
}
