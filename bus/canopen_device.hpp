// A module as a CANopen device: what CiA 301 asks of every node, around the module's own step.
//
//   object dictionary   1000h..1FFFh of the protocol, 2xxxh what its PDOs carry, and whatever the
//                       module declares itself (Node::declare)
//   SDO server          answers with the cycle's other frames; in pre-operational at once
//   heartbeat           produced every 1017h ms; consumed from the NC unit (1016h): its loss is
//                       EMCY 8130h (detail: its id) and the module is told
//   errors              EMCY messages of the module and of the protocol are entered in 1003h and
//                       make up 1001h; a PDO of wrong length is EMCY 8210h (detail: its COB-ID, 16
//                       bit, and its length); an error that is gone is EMCY 0000h with what is
//                       left of the register (detail: its code, 16 bit)
//
// A communication error holds as long as its cause: the silent producer, the PDO that has not yet
// come in its right length. Errors that only happen (missed SYNC, overrun, return from bus-off)
// are taken for gone after kQuiet cycles without another.
//
// Pure, like the module: it sees frames in cycles and owns nothing else.
#pragma once

#include <string>
#include <vector>

#include "bus/error_log.hpp"
#include "bus/heartbeat.hpp"
#include "bus/node.hpp"
#include "bus/object_dictionary.hpp"
#include "bus/sdo_server.hpp"

namespace vcnc {

struct WireMessage;

/// Vendor id (1018h) of all modules. Not one that CiA has assigned.
inline constexpr std::uint32_t kVendorId = 0x76636e63;

class CanopenDevice : public Node {
 public:
  static constexpr Tick kQuiet = 100;

  /// `module` outlives the device.
  explicit CanopenDevice(Node& module);

  int id() const override { return module_.id(); }
  std::string_view name() const override { return module_.name(); }
  bool accepts(std::uint16_t cob_id) const override;
  bool watches(int node) const override { return node == kNcNode; }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  bool at_rest() const override { return module_.at_rest(); }
  void leave_bus() override { module_.leave_bus(); }
  void suffer(const BusFault& fault) override { module_.suffer(fault); }
  void request(const Frame& frame, Frames& out) override;
  void note(const Emergency& emergency) override;

  const ObjectDictionary& objects() const { return objects_; }
  std::uint8_t error_register() const;

 private:
  /// A PDO, its fields and the last frame of it.
  struct Pdo {
    std::uint16_t id = 0;
    std::uint8_t length = 0;
    bool wrong_length = false;  ///< and no right one since
    Frame last{};
  };

  void declare_protocol();
  void declare_pdos();
  void declare_image(std::uint16_t index, const std::string& name, const WireMessage& message,
                     const Pdo& pdo);
  void hear(Tick k, std::span<const Frame> inputs, Frames& said);
  void enter_emergencies(std::size_t first, Frames& out);
  void raise(std::uint16_t code, std::array<std::uint8_t, 5> detail, Frames& said);
  void gone(std::uint16_t code, Frames& said);
  SdoAbort set_consumer(std::int64_t value);

  Node& module_;
  ObjectDictionary objects_;
  SdoServer server_;
  Tick period_;  ///< of the own heartbeat, 0: none
  HeartbeatWatch nc_unit_;
  ErrorLog errors_;
  std::uint8_t own_register_ = 0;  ///< errors of the module itself
  bool disturbed_ = false;         ///< a communication error happened
  Tick last_disturbance_ = 0;
  std::uint16_t disturbance_ = 0;
  Pdo sent_;
  std::vector<Pdo> received_;
  std::string label_;
  Tick tick_ = -1;
  Frames inputs_, said_;
};

}  // namespace vcnc
