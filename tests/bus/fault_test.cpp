#include "bus/fault.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <thread>

#include "bus/fault_docs.hpp"
#include "bus/hub.hpp"
#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"
#include "bus/run_node.hpp"
#include "tests/scratch.hpp"
#include "toy_machine.hpp"

namespace vcnc::fault_test {
namespace {

using Kind = BusFault::Kind;

// ------------------------------------------------------------------------------ text form

TEST(FaultText, SaysNodeKindAndTimes) {
  const BusFault f = parse_fault("drive Y  mute from_s=1.5 for_s=0.005");
  EXPECT_EQ(f.node, "drive Y");
  EXPECT_EQ(f.kind, Kind::mute);
  EXPECT_EQ(f.from, 1500);
  EXPECT_EQ(f.cycles, 5);
  EXPECT_FALSE(f.active(1499));
  EXPECT_TRUE(f.active(1500));
  EXPECT_TRUE(f.active(1504));
  EXPECT_FALSE(f.active(1505));
  EXPECT_TRUE(parse_fault("bus stuck").active(1'000'000'000)) << "to the end";
  EXPECT_EQ(parse_fault("probe drop id=0x187").id, 0x187);
  EXPECT_EQ(parse_fault("probe corrupt id=391 bit=7").bit, 7);
  EXPECT_EQ(parse_fault("overtravel delay cycles=3").count, 3);
  EXPECT_EQ(parse_fault("NC unit babble frames=4").count, 4);
  EXPECT_DOUBLE_EQ(parse_fault("drive X encoder_jump um=-250").value, -250e-6);
  EXPECT_DOUBLE_EQ(parse_fault("drive C encoder_jump urad=30").value, 30e-6);
  EXPECT_EQ(parse_fault("probe wire_break channel=z").channel, 2);
  EXPECT_EQ(parse_fault("analysis kill wall_s=0.5").wall_s, 0.5);
  const BusFault loss = parse_fault("supply power_loss from_s=2 for_s=0.4");
  EXPECT_TRUE(loss.of_supply());
  EXPECT_FALSE(loss.of_module() || loss.of_host());
  EXPECT_EQ(loss.from, 2000);
  EXPECT_EQ(loss.cycles, 400);
}

TEST(FaultText, WhatIsWrongIsNamed) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "expected NODE KIND"},
      {"mute", "expected NODE KIND"},
      {"drive Y quiet", "kinds are mute, silent"},
      {"drive Q mute", "\"drive Q\": no such node"},
      {"probe mute from_s=x", "from_s=x: expected a number"},
      {"probe mute from_s=-1", "expected 0 or more"},
      {"probe mute from_s=nan", "from_s=nan: expected a number"},
      {"probe mute bit=3", "bit: unknown key; mute knows from_s, for_s"},
      {"probe mute 7", "expected key=value"},
      {"probe drop", "needs id="},
      {"probe drop id=0x780", "1 .. 1919"},
      {"probe drop id=0x080", "use lose_sync"},
      {"probe delay", "needs cycles="},
      {"drive X stuck", "stuck is a fault of the bus"},
      {"bus power_loss", "power_loss is a fault of the supply"},
      {"supply mute", "the supply knows power_loss"},
      {"supply kill", "the supply knows power_loss"},
      {"supply power_loss id=5", "power_loss knows from_s, for_s"},
      {"probe encoder_jump um=3", "is a fault of an axis drive"},
      {"drive spindle fault", "is a fault of an axis drive"},
      {"drive X encoder_jump", "needs um="},
      {"drive A encoder_jump um=3", "drive A is counted in urad"},
      {"overtravel wire_break", "is a fault of the probe"},
      {"NC unit lose_sync", "is a fault of modules"},
      {"bus babble", "is a fault of one node"},
      {"NC unit bus_off", "is a fault of one module"},
      {"bus kill", "is a fault of a process"},
      {"analysis mute", "no such node"}};
  for (const auto& [text, message] : cases) {
    try {
      parse_fault(text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(message), std::string::npos) << text << ": " << e.what();
    }
  }
}

// ------------------------------------------------------------------------------ one node

/// Writes down what it hears; says its cyclic frame and, in cycle 5, an emergency.
class Listener : public Node {
 public:
  int id() const override { return 3; }
  std::string_view name() const override { return "drive Z"; }
  bool accepts(std::uint16_t) const override { return true; }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    ticks.push_back(k);
    heard.emplace_back(inputs.begin(), inputs.end());
    out.push_back(encode(DriveStatus{.node = 3, .tick = low16(k)}));
    if (k == 5) out.push_back(encode(Emergency{.node = 3, .code = 0x1000}));
  }
  std::vector<Tick> ticks;
  std::vector<Frames> heard;
};

/// Ten cycles of a faulted Listener that is sent one command in each.
struct Played {
  Listener node;
  std::vector<Frames> said;
  explicit Played(const std::string& fault) {
    FaultedNode faulted(node, {parse_fault(fault)});
    for (Tick k = 0; k < 10; ++k) {
      const Frame command = encode(GroupCommand{.tick = low16(k - 1)});
      said.emplace_back();
      faulted.step(k, {&command, 1}, said.back());
    }
  }
  /// Ticks on the commands heard, or on the cyclic frames said, in cycle k.
  std::vector<int> commands(std::size_t k) const {
    std::vector<int> ticks;
    for (const Frame& f : node.heard[k])
      if (const auto c = decode_group_command(f))
        ticks.push_back(static_cast<std::int16_t>(c->tick));
    return ticks;
  }
  std::vector<int> answers(std::size_t k) const {
    std::vector<int> ticks;
    for (const Frame& f : said[k])
      if (const auto s = decode_drive_status(f)) ticks.push_back(s->tick);
    return ticks;
  }
  std::vector<int> emergencies(std::size_t k) const {
    std::vector<int> codes;
    for (const Frame& f : said[k])
      if (const auto e = decode_emergency(f)) codes.push_back(e->code);
    return codes;
  }
};

using Ints = std::vector<int>;

TEST(FaultedNode, MuteSilentAndDeafCutTheirWaysForTheirTimeAndTheNodeGoesOn) {
  for (const char* kind : {"mute", "silent", "deaf"}) {
    const Played p("drive Z " + std::string(kind) + " from_s=0.004 for_s=0.003");
    EXPECT_EQ(p.node.ticks.size(), 10u) << kind;
    const bool says = std::string(kind) == "deaf", hears = std::string(kind) == "silent";
    for (std::size_t k = 0; k < 10; ++k) {
      const bool cut = k >= 4 && k < 7;
      EXPECT_EQ(p.commands(k).size(), cut && !hears ? 0u : 1u) << kind << k;
      EXPECT_EQ(p.answers(k).size(), cut && !says ? 0u : 1u) << kind << k;
    }
    EXPECT_EQ(p.emergencies(5), says ? Ints{0x1000} : Ints{}) << kind;
  }
}

TEST(FaultedNode, WithoutSyncItSendsEmergenciesOnlyAndTellsTheMissedOnesAfterwards) {
  const Played p("drive Z lose_sync from_s=0.004 for_s=0.003");
  EXPECT_EQ(p.answers(5), Ints{});
  EXPECT_EQ(p.commands(5), Ints{});
  EXPECT_EQ(p.emergencies(5), Ints{0x1000});
  EXPECT_EQ(p.emergencies(7), Ints{0x8100});
  const auto told = decode_emergency(p.said[7].back());
  EXPECT_EQ(told->detail, (std::array<std::uint8_t, 5>{1, 3, 0, 0, 0}));
  EXPECT_EQ(p.emergencies(8), Ints{});
}

TEST(FaultedNode, DropDelayAndDuplicateActOnTheFrameNamedBothWays) {
  const Played dropped("drive Z drop id=0x200 from_s=0.002 for_s=0.002");
  EXPECT_EQ(dropped.commands(1), Ints{0});
  EXPECT_EQ(dropped.commands(2), Ints{});
  EXPECT_EQ(dropped.commands(4), Ints{3});
  EXPECT_EQ(dropped.answers(2), Ints{2});
  const Played late("drive Z delay id=0x183 cycles=2 from_s=0.002 for_s=0.003");
  EXPECT_EQ(late.answers(1), Ints{1});
  EXPECT_EQ(late.answers(2), Ints{});
  EXPECT_EQ(late.answers(3), Ints{});
  EXPECT_EQ(late.answers(4), Ints{2});
  EXPECT_EQ(late.answers(5), (Ints{3, 5}));
  EXPECT_EQ(late.answers(6), (Ints{4, 6}));
  EXPECT_EQ(late.commands(4), Ints{3});
  const Played twice("drive Z duplicate from_s=0.003");
  EXPECT_EQ(twice.answers(3), (Ints{3, 3}));
  EXPECT_EQ(twice.commands(3), Ints{2}) << "without id: what it sends";
}

TEST(FaultedNode, CorruptFlipsTheBitNamedOrOneToThreeDrawnFromCycleAndIdentifier) {
  const auto flipped = [](const Frame& a, const Frame& b) {
    int bits = 0;
    for (std::size_t i = 0; i < a.len; ++i)
      bits += __builtin_popcount(static_cast<unsigned>(a.data[i] ^ b.data[i]));
    return bits;
  };
  const Played one("drive Z corrupt bit=17 from_s=0.003");
  const Frame right = encode(DriveStatus{.node = 3, .tick = 4});
  EXPECT_EQ(one.said[4][0].data[2] ^ right.data[2], 1 << 1);
  EXPECT_EQ(flipped(one.said[4][0], right), 1);
  const Played drawn("drive Z corrupt"), again("drive Z corrupt");
  for (std::size_t k = 0; k < 10; ++k) {
    const int bits = flipped(drawn.said[k][0],
                             encode(DriveStatus{.node = 3, .tick = low16(static_cast<Tick>(k))}));
    EXPECT_GE(bits, 1);
    EXPECT_LE(bits, 3);
    EXPECT_EQ(drawn.said[k][0], again.said[k][0]);
  }
}

TEST(FaultedNode, AFlippedSignOfZeroIsNotANumber) {
  constexpr std::size_t kSignOfXVelocity = 13;
  Frame command = encode(GroupCommand{});
  EXPECT_TRUE(is_finite(*decode_group_command(command)));
  command.data[kSignOfXVelocity] ^= 0x80;
  EXPECT_FALSE(is_finite(*decode_group_command(command)));
  EXPECT_TRUE(is_finite(ProbeSample{}));
  EXPECT_FALSE(is_finite(ProbeSample{.deflection = {0, 0, std::nan("")}}));
  EXPECT_FALSE(is_finite(DriveStatus{.position = std::nan("")}));
}

TEST(FaultedNode, ABabblerAddsItsFramesToEachCycle) {
  const Played p("drive Z babble frames=7 from_s=0.003 for_s=0.001");
  EXPECT_EQ(p.said[2].size(), 1u);
  EXPECT_EQ(std::count_if(p.said[3].begin(), p.said[3].end(),
                          [](const Frame& f) { return f.id == 0x07f && f.len == 8; }),
            7);
}

TEST(FaultedNode, AFaultOfTheWholeBusActsOnceAtTheSender) {
  // Both ways it would flip the bit back.
  const Played p("bus corrupt id=0x200 bit=0");
  EXPECT_EQ(p.commands(3), Ints{2}) << "the NC unit's frame is spoiled where it is sent";
  FaultFilter sender({parse_fault("bus corrupt id=0x200 bit=0")}, kNcUnitName);
  const Frame command = encode(GroupCommand{.tick = 2});
  Frames out;
  sender.say(3, {&command, 1}, out);
  EXPECT_EQ(decode_group_command(out.at(0))->tick, 3);
}

// ------------------------------------------------------------------------------ layouts

BusFault toy_fault(int node, Kind kind, Tick from, Tick cycles) {
  BusFault f;
  f.node = node == 0 ? std::string(kWholeBus) : toy::toy_name(node);
  f.kind = kind;
  f.from = from;
  f.cycles = cycles;
  return f;
}

/// One of each on five toy nodes, some at the same time.
BusFaults one_of_each() {
  BusFaults all{toy_fault(1, Kind::mute, 20, 5),       toy_fault(2, Kind::silent, 30, 50),
                toy_fault(3, Kind::deaf, 32, 7),       toy_fault(4, Kind::drop, 40, 3),
                toy_fault(1, Kind::corrupt, 60, 20),   toy_fault(2, Kind::delay, 100, 9),
                toy_fault(4, Kind::duplicate, 90, 30), toy_fault(1, Kind::lose_sync, 120, 4),
                toy_fault(4, Kind::babble, 130, 10),   toy_fault(0, Kind::stuck, 150, 6),
                toy_fault(0, Kind::lose_sync, 170, 2), toy_fault(0, Kind::delay, 180, 9),
                toy_fault(0, Kind::duplicate, 200, 0)};
  all[3].id = kCommandId;
  all[5].count = 2;
  all[8].count = 30;
  all[8].id = 0x7f;
  all[11].count = 1;
  all[11].id = 0x181;
  BusFault nc = toy_fault(0, Kind::silent, 220, 3);
  nc.node = kNcUnitName;
  all.push_back(nc);
  return all;
}

constexpr int kNodes = 5;
constexpr Tick kCycles = 250;

Roster faulted_roster(const BusFaults& faults) {
  Roster roster = toy::roster(kNodes);
  for (RosterEntry& entry : roster) entry.token = concerns(faults, entry.name);
  return roster;
}

MainLoopResult play(Transport& bus, const BusFaults& faults) {
  toy::ToyMaster toy_master(kCycles);
  FaultedMaster master(toy_master, faults);
  Pacer pacer;
  return run_main_loop(master, bus, faulted_roster(faults), {.pacer = pacer});
}

MainLoopResult play_in_one_process(const BusFaults& faults) {
  auto toys = toy::make_nodes(kNodes);
  std::vector<std::unique_ptr<FaultedNode>> faulted;
  std::vector<Node*> nodes;
  for (const auto& node : toys) {
    faulted.push_back(std::make_unique<FaultedNode>(*node, faults));
    nodes.push_back(faulted.back()->harmless() ? static_cast<Node*>(node.get())
                                               : faulted.back().get());
  }
  InprocTransport bus(nodes);
  return play(bus, faults);
}

TEST(Faults, GiveOneHashInOneProcessAndOverTheHub) {
  const auto check = [](const BusFaults& faults, const std::string& what) {
    const MainLoopResult expected = play_in_one_process(faults);
    ASSERT_TRUE(expected.complete) << what << expected.failure;
    Scratch dir;
    Hub hub(dir / "bus");
    std::vector<std::thread> threads;
    for (int id = kNodes; id >= 1; --id)
      threads.emplace_back([&, id] {
        toy::ToyNode node(id);
        FaultedNode faulted(node, faults);
        const auto bus = open_transport(hub.uri(), id);
        run_node(faulted.harmless() ? static_cast<Node&>(node) : faulted, *bus);
      });
    const auto bus = open_transport(hub.uri(), 0);
    const MainLoopResult result = play(*bus, faults);
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(result.complete) << what << result.failure;
    EXPECT_EQ(result.trace_hash, expected.trace_hash) << what;
    EXPECT_EQ(result.lost, 0u);
  };
  const std::string without = play_in_one_process({}).trace_hash;
  for (const BusFault& fault : one_of_each()) {
    EXPECT_NE(play_in_one_process({fault}).trace_hash, without) << fault.from;
  }
  check({}, "none");
  check(one_of_each(), "all");
}

TEST(Faults, InTheFutureChangeNothing) {
  const std::string without = play_in_one_process({}).trace_hash;
  BusFaults later = one_of_each();
  for (BusFault& fault : later) fault.from += 10000;
  EXPECT_EQ(play_in_one_process(later).trace_hash, without)
      << "neither decorators nor tokens show on the bus";
}

/// Every kind at every node it may befall, with every key: text and data are the same thing.
TEST(FaultText, ParsesToItselfForEveryKindAndNode) {
  int count = 0;
  for (const FaultKind& kind : fault_kinds())
    for (const std::string_view node : nodes_of(kind)) {
      BusFault fault{.node = std::string(node), .kind = kind.kind, .from = 1234, .cycles = 7};
      const auto has = [&](std::string_view key) {
        return kind.keys.find(key) != std::string_view::npos;
      };
      if (has("id")) fault.id = 0x187;
      if (has("bit")) fault.bit = 13;
      if (has("cycles") || has("frames") || has("periods")) fault.count = 5;
      if (has("channel")) fault.channel = 2;
      if (has("um")) fault.value = -125e-6;
      if (has("wall_s")) fault.from = 0, fault.wall_s = 0.25;
      for (const bool contact : {false, true}) {
        fault.at_contact = contact && !fault.of_host();
        if (fault.at_contact) fault.from = -20;
        const std::string text = text_of(fault);
        const BusFault again = parse_fault(text);
        EXPECT_EQ(again.node, fault.node) << text;
        EXPECT_EQ(again.kind, fault.kind) << text;
        EXPECT_EQ(again.from, fault.from) << text;
        EXPECT_EQ(again.cycles, fault.cycles) << text;
        EXPECT_EQ(again.id, fault.id) << text;
        EXPECT_EQ(again.bit, fault.bit) << text;
        EXPECT_EQ(again.count, fault.count) << text;
        EXPECT_EQ(again.channel, fault.channel) << text;
        EXPECT_NEAR(again.value, fault.value, 1e-15) << text;
        EXPECT_EQ(again.wall_s, fault.wall_s) << text;
        EXPECT_EQ(again.at_contact, fault.at_contact) << text;
        EXPECT_EQ(text_of(again), text);
        ++count;
      }
    }
  EXPECT_GT(count, 200);
}

TEST(FaultText, OnlyAtContactCountsBackwards) {
  EXPECT_THROW(parse_fault("probe mute from_s=-0.1"), std::invalid_argument);
  EXPECT_EQ(parse_fault("probe mute from_s=-0.1 at=contact").from, -100);
  EXPECT_EQ(parse_fault("probe mute at=contact from_s=-0.1").from, -100);
  EXPECT_THROW(parse_fault("probe mute at=start"), std::invalid_argument);
  EXPECT_THROW(parse_fault("probe kill at=contact"), std::invalid_argument);
  EXPECT_THROW(parse_fault("probe disk_full"), std::invalid_argument);
  EXPECT_THROW(parse_fault("probe slip periods=0"), std::invalid_argument);
}

TEST(FaultFilter, KnowsWhichFaultsHaveStruck) {
  const BusFaults faults{parse_fault("probe drop id=0x187 from_s=0.002"),
                         parse_fault("probe drop id=0x555"), parse_fault("probe deaf from_s=1"),
                         parse_fault("probe silent from_s=0.001 for_s=0.001")};
  FaultFilter filter(faults, "probe");
  Frame frame;
  frame.id = 0x187;
  Frames out;
  const auto cycle = [&](Tick k) {
    out.clear();
    filter.hear(k, {}, out);
    filter.say(k, {&frame, 1}, out);
  };
  cycle(0);
  EXPECT_TRUE(filter.struck().empty());
  cycle(1);
  EXPECT_EQ(filter.struck(), std::vector<std::string>{faults[3].text});
  cycle(2);
  EXPECT_EQ(filter.struck(), (std::vector<std::string>{faults[0].text, faults[3].text}));
}

TEST(FaultDocs, ThePageInDocsIsTheGeneratedOne) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/docs/faults.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(page, faults_markdown()) << "vcnc faults > docs/faults.md";
  for (const FaultKind& kind : fault_kinds())
    EXPECT_NE(page.find("| `" + std::string(kind.name) + "` |"), std::string::npos) << kind.name;
}

}  // namespace
}  // namespace vcnc::fault_test
