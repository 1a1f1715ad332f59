// Real nodes in their shells on one bus, fed with any frames. The first byte chooses which nodes
// are there and the machine; then come frames as {id, id, length, payload}, a length of FFh
// standing for the next SYNC, FEh for 1 + payload byte of them. The nodes hear each other.
//
// Whatever they are told: their states are numbers, and a drive that is enabled has been told a
// position.
#include <memory>
#include <vector>

#include "bus/node_shell.hpp"
#include "fuzz.hpp"
#include "model/geometry/piece.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace {

using namespace vcnc;

constexpr int kMostCycles = 200;

class Bus {
 public:
  explicit Bus(std::uint8_t choice) : truth_(open_local_truth()) {
    Machine machine;
    PieceParams piece;
    piece.kind = PieceParams::Kind::plane;
    piece.direction = Vec3::UnitX();
    if (choice & 1) machine.effects.axis[kX].get<Backlash>().gap = 5e-6;
    if (choice & 2) machine.probe.correction = ProbeParams::Correction::heydemann;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      if (axis == kX || !(choice & 4)) add(std::make_unique<DriveNode>(axis, machine, 1, *truth_));
    add(std::make_unique<SpindleNode>(machine));
    add(std::make_unique<ProbeNode>(machine, make_piece(piece), 1, *truth_));
    add(std::make_unique<OvertravelNode>(machine));
    Frames out;
    for (const auto& shell : shells_) shell->boot(out);
  }

  void send(const Frame& frame) {
    Frames said;
    for (const auto& shell : shells_) {
      try {
        if (!shell->over()) shell->feed(frame, said);
      } catch (const TruthError&) {
        // A drive that answers without its motion: the simulators' own channel has failed.
      }
      from_.resize(said.size(), shell.get());
    }
    Frames ignored;
    for (std::size_t i = 0; i < said.size(); ++i) {
      check(said[i]);
      for (const auto& shell : shells_)
        if (shell.get() != from_[i] && !shell->over()) shell->feed(said[i], ignored);
    }
    from_.clear();
  }
  void sync() {
    if (++cycles_ > kMostCycles) return;
    send(encode(Sync{sync_counter(k_++)}));
  }

 private:
  void add(std::unique_ptr<Node> node) {
    shells_.push_back(std::make_unique<NodeShell>(*node));
    nodes_.push_back(std::move(node));
  }
  static void check(const Frame& frame) {
    fuzz::require(valid_length(frame.len, frame.fd));
    if (const auto status = decode_drive_status(frame))
      fuzz::require(std::isfinite(status->position) && std::isfinite(status->second_encoder) &&
                    std::isfinite(status->force));
    if (const auto sample = decode_probe_sample(frame))
      for (const double d : sample->deflection) fuzz::require(std::isfinite(d));
  }

  std::unique_ptr<TruthPort> truth_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::unique_ptr<NodeShell>> shells_;
  std::vector<const NodeShell*> from_;
  Tick k_ = 0;
  int cycles_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  Bus bus(bytes.byte());
  bus.send(encode(Nmt{NmtCommand::start, 0}));
  bus.sync();
  while (!bytes.empty()) {
    Frame frame;
    frame.id = static_cast<std::uint16_t>(bytes.byte() | (bytes.byte() & 0x07) << 8);
    frame.len = bytes.byte();
    if (frame.len >= 0xfe) {
      const int times = frame.len == 0xfe ? 1 + bytes.byte() : 1;
      for (int i = 0; i < times; ++i) bus.sync();
      continue;
    }
    frame.fd = frame.len > 8;
    if (!valid_length(frame.len, frame.fd)) continue;
    const auto payload = bytes.take(frame.len);
    std::copy(payload.begin(), payload.end(), frame.data.begin());
    bus.send(frame);
  }
  return 0;
}
