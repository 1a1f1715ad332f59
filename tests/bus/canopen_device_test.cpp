// A module as a CANopen device: what it says on the bus, cycle by cycle.
#include "bus/canopen_device.hpp"

#include <gtest/gtest.h>

#include <map>

#include "bus/fault.hpp"
#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"
#include "bus/sdo_client.hpp"
#include "bus/wire_docs.hpp"
#include "toy_machine.hpp"

namespace vcnc::canopen_device_test {
namespace {

constexpr Tick kPeriod = 100;

/// A module with one object of its own that says emergencies when told to.
class Module : public Node {
 public:
  explicit Module(int id, Tick heartbeat = kPeriod) : id_(id), heartbeat_(heartbeat) {}
  int id() const override { return id_; }
  std::string_view name() const override { return "module"; }
  bool accepts(std::uint16_t id) const override {
    return id == kCommandId || id == kStatusBase + kOvertravelNode;
  }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    heard.assign(inputs.begin(), inputs.end());
    out.push_back(encode(DriveStatus{.node = id_, .tick = low16(k), .position = 0.5}));
    for (const std::uint16_t code : errors)
      out.push_back(encode(Emergency{.node = id_,
                                     .code = code,
                                     .error_register = static_cast<std::uint8_t>(code ? 0x21 : 0),
                                     .detail = {7}}));
    errors.clear();
  }
  DeviceProfile profile() const override { return {kServoDrive, kAxisDriveProduct, heartbeat_}; }
  void declare(ObjectDictionary& objects) override {
    objects.add({0x6065, 0, "Window", ObjectType::u32, ObjectAccess::read_write, "um",
                 [this] { return window; },
                 [this](std::int64_t v) {
                   window = v;
                   return SdoAbort::none;
                 }});
  }
  void nc_unit_lost(bool lost) override { nc_lost.push_back(lost); }

  std::vector<std::uint16_t> errors;
  std::vector<bool> nc_lost;
  Frames heard;
  std::int64_t window = 1000;

 private:
  int id_;
  Tick heartbeat_;
};

struct Bench {
  Module module{3};
  CanopenDevice device{module};
  Tick k = 0;
  Frames out;

  /// One cycle; the frames besides the cyclic one.
  Frames step(const Frames& inputs = {}) {
    out.clear();
    device.step(k++, inputs, out);
    EXPECT_EQ(out.at(0).id, 0x183);
    return {out.begin() + 1, out.end()};
  }
  std::vector<Emergency> emergencies(const Frames& inputs = {}) {
    std::vector<Emergency> all;
    for (const Frame& frame : step(inputs))
      if (const auto e = decode_emergency(frame)) all.push_back(*e);
    return all;
  }
  std::int64_t value(std::uint16_t index, std::uint8_t sub = 0) {
    return device.objects().find(index, sub)->get();
  }
  void write(std::uint16_t index, std::uint8_t sub, const ObjectBytes& bytes) {
    ASSERT_EQ(device.objects().write(index, sub, bytes), SdoAbort::none);
  }
};

const Frame kNcBeat = encode(Heartbeat{kNcNode, NmtState::operational});

TEST(CanopenDevice, HeartbeatsComeOncePerPeriodAndNeverTwoInACycle) {
  std::map<Tick, int> beats_in;
  for (const int id : {1, 2, 3, 4, 5, 6, 7, 8, kNcNode}) {
    std::vector<Tick> beats;
    for (Tick k = 0; k < 1000; ++k)
      if (heartbeat_due(k, id, kPeriod)) beats.push_back(k);
    ASSERT_EQ(beats.size(), 10u) << id;
    for (std::size_t i = 1; i < beats.size(); ++i) EXPECT_EQ(beats[i] - beats[i - 1], kPeriod);
    for (const Tick k : beats) EXPECT_EQ(++beats_in[k], 1) << id << " " << k;
  }
  EXPECT_FALSE(heartbeat_due(0, 16, 0)) << "period 0: none";
}

TEST(CanopenDevice, SaysThatItLivesAsOftenAsObject1017Says) {
  Bench b;
  const auto beats = [&](int cycles) {
    int count = 0;
    for (int i = 0; i < cycles; ++i)
      for (const Frame& frame : b.step())
        count += frame == encode(Heartbeat{3, NmtState::operational});
    return count;
  };
  EXPECT_EQ(beats(1000), 10);
  b.write(0x1017, 0, {20, 0});
  EXPECT_EQ(beats(1000), 50);
  b.write(0x1017, 0, {0, 0});
  EXPECT_EQ(beats(1000), 0);
}

TEST(CanopenDevice, MissesTheNcUnitAfterThreePeriodsAndNotBeforeItsFirstHeartbeat) {
  Bench b;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(b.emergencies().empty());
  EXPECT_TRUE(b.emergencies({kNcBeat}).empty());
  for (Tick silent = 1; silent <= 300; ++silent) EXPECT_TRUE(b.emergencies().empty()) << silent;
  const auto lost = b.emergencies();
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].code, 0x8130);
  EXPECT_EQ(lost[0].error_register, 0x11);
  EXPECT_EQ(lost[0].detail[0], kNcNode);
  EXPECT_EQ(b.value(0x1001), 0x11);
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(b.emergencies().empty());
  const auto back = b.emergencies({kNcBeat});
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back[0].code, 0x0000);
  EXPECT_EQ(back[0].error_register, 0);
  EXPECT_EQ(back[0].detail[0] | back[0].detail[1] << 8, 0x8130);
  EXPECT_EQ(b.module.nc_lost, (std::vector<bool>{true, false}));
  EXPECT_TRUE(b.module.heard.empty()) << "heartbeats are not the module's business";
}

TEST(CanopenDevice, ConsumerTimeCanBeChangedForTheNcUnitOnly) {
  Bench b;
  EXPECT_EQ(b.value(0x1016, 1), 127 << 16 | 300);
  const auto& objects = b.device.objects();
  EXPECT_EQ(objects.write(0x1016, 1, {50, 0, 5, 0}), SdoAbort::value);
  b.write(0x1016, 1, {50, 0, 127, 0});
  b.step({kNcBeat});
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(b.emergencies().empty());
  EXPECT_EQ(b.emergencies().size(), 1u);
  b.write(0x1016, 1, {0, 0, 0, 0});
  b.step({kNcBeat});
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(b.emergencies().empty());
}

TEST(CanopenDevice, KeepsTheLastEightErrorsAndARegisterOfThoseThatHold) {
  Bench b;
  for (std::uint16_t code = 0x2301; code <= 0x230a; ++code) {
    b.module.errors = {code};
    EXPECT_EQ(b.emergencies().at(0).error_register, 0x21);
  }
  EXPECT_EQ(b.value(0x1003, 0), 8);
  for (std::uint8_t sub = 1; sub <= 8; ++sub)
    EXPECT_EQ(b.value(0x1003, sub), 0x7'0000 | (0x230a - sub + 1)) << "the newest first";
  EXPECT_EQ(b.device.objects().write(0x1003, 0, {1}), SdoAbort::too_high);
  b.write(0x1003, 0, {0});
  EXPECT_EQ(b.value(0x1003, 0), 0);
  EXPECT_EQ(b.value(0x1003, 1), 0);
  EXPECT_EQ(b.value(0x1001), 0x21) << "the error itself holds";
  // One of the protocol besides; the module's own then goes.
  b.device.note({.node = 3, .code = 0x8100, .error_register = 0x11});
  EXPECT_EQ(b.value(0x1001), 0x31);
  b.module.errors = {0};
  EXPECT_EQ(b.emergencies().at(0).error_register, 0x11);
  for (Tick quiet = 1; quiet < CanopenDevice::kQuiet; ++quiet)
    EXPECT_TRUE(b.emergencies().empty()) << quiet;
  std::vector<Emergency> gone;
  for (int i = 0; i < 3 && gone.empty(); ++i) gone = b.emergencies();
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_EQ(gone[0].code, 0);
  EXPECT_EQ(gone[0].error_register, 0);
  EXPECT_EQ(b.value(0x1001), 0);
}

TEST(CanopenDevice, APdoOfWrongLengthIsToldOnceUntilARightOneComes) {
  Bench b;
  Frame wrong = encode(GroupCommand{});
  wrong.len = 48;
  const auto told = b.emergencies({wrong});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].code, 0x8210);
  EXPECT_EQ(told[0].detail, (std::array<std::uint8_t, 5>{0x00, 0x02, 48, 0, 0}));
  EXPECT_TRUE(b.emergencies({wrong}).empty());
  const auto gone = b.emergencies({encode(GroupCommand{})});
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_EQ(gone[0].code, 0);
}

TEST(CanopenDevice, AnswersEachRequestOfACycleOnceAndTheModuleSeesNone) {
  Bench b;
  SdoClient client(3);
  const Frames said = b.step({client.upload(0x6065, 0), encode(GroupCommand{})});
  ASSERT_EQ(b.module.heard.size(), 1u);
  ASSERT_EQ(said.size(), 1u);
  client.feed(said[0]);
  EXPECT_TRUE(client.done());
  EXPECT_EQ(client.number(), 1000u);
  b.step({client.download(0x6065, 0, {0x39, 0x30, 0, 0})});
  EXPECT_EQ(b.module.window, 12345);
  // A half transfer is given up.
  b.step({client.upload(0x1008, 0)});
  int aborts = 0;
  for (Tick i = 0; i <= SdoServer::kTimeout + 5; ++i)
    for (const Frame& frame : b.step()) aborts += frame.id == 0x583;
  EXPECT_EQ(aborts, 1);
}

TEST(CanopenDevice, MapsItsPdosAsTheWireTableSays) {
  Bench b;
  GroupCommand command{.tick = 77, .controlword = 0x1f};
  command.axes[2].position = -0.25;
  b.step({encode(command)});
  const auto& objects = b.device.objects();
  // RPDOs in ascending order of their identifiers: overtravel, command.
  const std::map<std::uint16_t, std::uint16_t> pdos{
      {0x1400, 0x188}, {0x1401, 0x200}, {0x1800, 0x183}};
  int checked = 0;
  for (const WireMessage& m : wire_messages()) {
    for (int node = m.first_node; node <= m.last_node; ++node)
      for (const auto& [index, cob_id] : pdos) {
        if (cob_id != m.base + node) continue;
        EXPECT_EQ(b.value(index, 1) & 0x7ff, cob_id);
        EXPECT_EQ(b.value(index, 2), 1);
        const auto mapping = static_cast<std::uint16_t>(index + 0x200);
        ASSERT_EQ(b.value(mapping), static_cast<std::int64_t>(m.fields.size()));
        for (std::size_t f = 0; f < m.fields.size(); ++f, ++checked) {
          const std::int64_t mapped = b.value(mapping, static_cast<std::uint8_t>(f + 1));
          EXPECT_EQ(mapped & 0xff, 8 * m.fields[f].bytes);
          const ObjectEntry* target = objects.find(static_cast<std::uint16_t>(mapped >> 16),
                                                   static_cast<std::uint8_t>(mapped >> 8));
          ASSERT_NE(target, nullptr);
          EXPECT_EQ(target->name, m.fields[f].name);
          EXPECT_EQ(size_of(target->type), m.fields[f].bytes);
          EXPECT_EQ(is_signed(target->type), m.fields[f].is_signed);
        }
      }
  }
  EXPECT_EQ(checked, 4 + 15 + 5);
  EXPECT_EQ(b.value(0x2801, 1), 77);
  EXPECT_EQ(b.value(0x2801, 2), 0x1f);
  EXPECT_EQ(b.value(0x2a00, 3), 5000000000) << "0.5 m as sent";
  ObjectBytes bytes;
  ASSERT_EQ(objects.read(0x2801, 7, bytes), SdoAbort::none);
  EXPECT_EQ(bytes, (ObjectBytes{0x00, 0x07, 0xfd, 0x6a, 0xff, 0xff})) << "-2.5e9 in 48 bits";
}

// ------------------------------------------------------------------------------ in its shell

TEST(CanopenDevice, InPreOperationalTheAnswerComesAtOnceAndStoppedThereIsNone) {
  Bench b;
  NodeShell shell(b.device);
  SdoClient client(3);
  Frames out;
  shell.boot(out);
  out.clear();
  shell.feed(client.upload(0x1000, 0), out);
  ASSERT_EQ(out.size(), 1u);
  client.feed(out[0]);
  EXPECT_EQ(client.number(), 0x00020192u);
  out.clear();
  shell.feed(encode(Nmt{NmtCommand::start, 0}), out);
  shell.feed(client.upload(0x1000, 0), out);
  EXPECT_EQ(out.size(), 1u) << "the heartbeat; the answer comes with the cycle's";
  out.clear();
  shell.feed(encode(Sync{1}), out);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].id, 0x583);
  EXPECT_EQ(out[1].id, 0x183) << "the cyclic frame is the last";
  shell.feed(encode(Nmt{NmtCommand::stop, 0}), out);
  out.clear();
  shell.feed(client.upload(0x1000, 0), out);
  EXPECT_TRUE(out.empty());
}

TEST(CanopenDevice, TakenOutOfOperationItSaysSoAndSendsNoPdo) {
  Bench b;
  NodeShell shell(b.device);
  Frames out;
  shell.boot(out);
  shell.feed(encode(Nmt{NmtCommand::start, 0}), out);
  shell.feed(encode(Sync{sync_counter(0)}), out);
  out.clear();
  shell.feed(encode(Nmt{NmtCommand::preop, 3}), out);
  const Frame beat = encode(Heartbeat{3, NmtState::pre_operational});
  EXPECT_EQ(out, Frames{beat});
  out.clear();
  b.module.errors = {0x2310};
  for (Tick k = 1; k <= 2 * kPeriod; ++k) shell.feed(encode(Sync{sync_counter(k)}), out);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[0].id, 0x083);
  EXPECT_EQ(out[1], beat);
  EXPECT_EQ(out[2], beat);
}

// ------------------------------------------------------------------------------ start-up

struct Started {
  std::string failure;
  Tick cycles = 0;
};

Started start(const Roster& roster) {
  Module a(1), b(2);
  CanopenDevice device_a(a), device_b(b);
  InprocTransport bus({&device_a, &device_b});
  toy::ToyMaster master(5);
  Pacer pacer;
  const auto result = run_main_loop(master, bus, roster, {.pacer = pacer});
  return {result.failure, result.cycles};
}

TEST(StartUp, AsksEveryModuleWhatItIsAndRefusesAWrongOneByName) {
  const RosterEntry one{1, "drive X", false, kServoDrive, kAxisDriveProduct};
  RosterEntry two{2, "drive Y", false, kServoDrive, kAxisDriveProduct};
  EXPECT_EQ(start({one, two}).failure, "");
  two = {2, "probe", false, kNoProfile, kProbeProduct};
  EXPECT_EQ(start({one, two}).failure,
            "node 2 is not the probe of this machine: device type 00020192h, expected 00000000h; "
            "the machine does not start");
  two = {2, "drive spindle", false, kServoDrive, kSpindleDriveProduct};
  const Started wrong = start({one, two});
  EXPECT_EQ(wrong.failure,
            "node 2 is not the drive spindle of this machine: product code 00000001h, expected "
            "00000002h; the machine does not start");
  EXPECT_EQ(wrong.cycles, 0);
}

TEST(StartUp, RefusesAModuleThatHasNoObjects) {
  auto nodes = toy::make_nodes(1);
  InprocTransport bus(toy::pointers(nodes));
  toy::ToyMaster master(5);
  Pacer pacer;
  const auto result = run_main_loop(
      master, bus, {{1, "drive X", false, kServoDrive, kAxisDriveProduct}}, {.pacer = pacer});
  EXPECT_EQ(result.failure,
            "no answer about object 1000h from: drive X; the machine does not start");
}

// ------------------------------------------------------------------------------ bus-off

TEST(BusOff, TheNodeFightsFallsSilentAndComesBack) {
  Module module(3);
  CanopenDevice device(module);
  FaultedNode node(device, {parse_fault("drive Z bus_off from_s=0.01 for_s=0.02")});
  EXPECT_TRUE(node.harmless()) << "another name";
  class DriveZ : public Module {
   public:
    using Module::Module;
    std::string_view name() const override { return "drive Z"; }
  } z(3, 0);
  CanopenDevice z_device(z);
  FaultedNode faulted(z_device, {parse_fault("drive Z bus_off from_s=0.01 for_s=0.02")});
  std::vector<std::vector<int>> said;
  std::vector<std::int64_t> wasted;
  std::vector<std::size_t> heard;
  for (Tick k = 0; k < 50; ++k) {
    Frames out;
    faulted.step(k, Frames{encode(GroupCommand{})}, out);
    std::vector<int> ids;
    for (const Frame& f : out) {
      const auto e = decode_emergency(f);
      ids.push_back(e ? e->code : f.id);
    }
    said.push_back(ids);
    wasted.push_back(faulted.wasted_ns());
    heard.push_back(z.heard.size());
  }
  using Ints = std::vector<int>;
  EXPECT_EQ(said[9], Ints{0x183});
  for (std::size_t k = 10; k < 32; ++k) EXPECT_EQ(said[k], Ints{}) << k;
  // An attempt is a 16-byte frame, 62 to 71 us at 1/5 Mbit/s, and an error frame of 23 us: ten or
  // eleven fit into a cycle, 32 are needed, so that the fourth cycle ends it at the latest.
  EXPECT_GT(wasted[10], 900'000);
  EXPECT_LE(wasted[10], 1'000'000);
  const std::int64_t total = wasted[10] + wasted[11] + wasted[12] + wasted[13];
  EXPECT_GT(total, 32 * (62 + 23) * 1000);
  EXPECT_LT(total, 32 * (71 + 23 + 8) * 1000);
  EXPECT_EQ(wasted[14], 0) << "off: it disturbs nobody any more";
  EXPECT_EQ(heard[11], 1u);
  for (std::size_t k = 14; k < 32; ++k) EXPECT_EQ(heard[k], 0u) << k;
  // 128 x 11 bits after the fault it speaks again: two cycles.
  EXPECT_EQ(said[32], (Ints{0x183, 0x8100, 0x8140}));
  EXPECT_EQ(said[33], Ints{0x183});
  EXPECT_EQ(z_device.objects().find(0x1003, 1)->get() & 0xffff, 0x8140);
}

TEST(BusOff, AShortDisturbanceOnlyMakesItPassive) {
  class DriveZ : public Module {
   public:
    using Module::Module;
    std::string_view name() const override { return "drive Z"; }
  } z(3, 0);
  CanopenDevice device(z);
  FaultedNode node(device, {parse_fault("drive Z bus_off from_s=0.01 for_s=0.002")});
  std::vector<int> codes;
  for (Tick k = 0; k < 20; ++k) {
    Frames out;
    node.step(k, {}, out);
    EXPECT_EQ(out.empty(), k == 10 || k == 11) << k;
    for (const Frame& f : out)
      if (const auto e = decode_emergency(f)) codes.push_back(e->code);
  }
  EXPECT_EQ(codes, std::vector<int>{0x8120});
}

}  // namespace
}  // namespace vcnc::canopen_device_test
