// CANopen on the whole machine: tools that read and write objects while it runs, heartbeats that
// fail, modules that are taken out of operation or fall off the bus.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>

#include "apps/objects_command.hpp"
#include "bus/sdo_client.hpp"
#include "servo_sim/spindle_node.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc::canopen_test {
namespace {

constexpr const char* kProgram =
    "G90 G21 G54\nG1 X50 Y30 Z-20 F3000\nG1 X-50 A10 C20\nG1 X0 Y0 Z0 A0 C0\nM30\n";

/// Another participant of the bus: says something before a SYNC and hears the answers.
class Tool : public Transport {
 public:
  explicit Tool(Transport& bus) : bus_(bus) {}
  void send(std::span<const Frame> slot) override {
    if (!slot.empty() && slot[0].id == kSyncId && before_sync)
      if (const auto frame = before_sync(cycle_)) bus_.send({&*frame, 1});
    if (!slot.empty() && slot[0].id == kSyncId) ++cycle_;
    bus_.send(slot);
  }
  Received receive(Frames& into, int timeout_ms) override {
    const std::size_t known = into.size();
    const Received received = bus_.receive(into, timeout_ms);
    for (std::size_t i = known; i < into.size(); ++i)
      if (hears) hears(cycle_ - 1, into[i]);
    return received;
  }
  std::function<std::optional<Frame>(Tick)> before_sync;
  std::function<void(Tick, const Frame&)> hears;

 private:
  Transport& bus_;
  Tick cycle_ = 0;
};

class Alarms : public TelemetrySink {
 public:
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow& row) override { rows.push_back(row); }
  void alarm(const Alarm& alarm) override { all.push_back(alarm); }
  void end(const RunEnd&) override {}
  const Alarm* first(int code) const {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Alarm& a) { return a.code == code; });
    return found == all.end() ? nullptr : &*found;
  }
  std::string told() const {
    std::string text;
    for (const Alarm& a : all)
      text += std::to_string(a.tick) + " " + a.source + ": " + a.text + "\n";
    return text;
  }
  std::vector<Alarm> all;
  std::vector<TelemetryRow> rows;
};

struct ToolRun {
  Machine machine;
  std::unique_ptr<VirtualMachine> modules;
  std::unique_ptr<InprocTransport> bus;
  std::unique_ptr<Tool> tool;
  Alarms seen;
  NcRunResult result;
  BusFaults faults;

  explicit ToolRun(const std::vector<std::string>& fault_texts = {},
                   const std::vector<std::string>& keys = {})
      : machine(load_machine(configs("machines/trunnion.toml"), keys)) {
    for (const std::string& text : fault_texts) faults.push_back(parse_fault(text));
    modules = std::make_unique<VirtualMachine>(machine, nullptr, 1, faults);
    bus = std::make_unique<InprocTransport>(modules->nodes());
    tool = std::make_unique<Tool>(*bus);
  }
  const ToolRun& play() {
    const TemporaryFile file("canopen.ngc", kProgram);
    NcRunOptions options;
    options.program = file.path();
    options.faults = faults;
    result = run_nc(machine, options, *tool, seen);
    return *this;
  }
  bool at_rest() const {
    for (int id = 1; id <= kSpindleNode; ++id)
      if (!modules->module(id).at_rest()) return false;
    return true;
  }
};

TEST(CanopenMachine, AToolReadsALiveDriveWithoutDisturbingTheRun) {
  ToolRun alone;
  alone.play();
  ASSERT_TRUE(alone.result.end.complete) << alone.seen.told();
  EXPECT_TRUE(alone.seen.all.empty()) << alone.seen.told();
  EXPECT_LT(alone.result.end.bus_load_worst, 1);

  ToolRun watched;
  SdoClient client(1);
  std::vector<std::pair<Tick, std::int32_t>> positions;
  watched.tool->before_sync = [&](Tick k) -> std::optional<Frame> {
    if (k % 50 != 20) return std::nullopt;
    return client.upload(0x6064, 0);
  };
  watched.tool->hears = [&](Tick k, const Frame& frame) {
    if (frame.id != 0x581 || k < 0) return;
    client.feed(frame);
    ASSERT_EQ(client.aborted(), SdoAbort::none);
    positions.emplace_back(k, static_cast<std::int32_t>(client.number()));
  };
  watched.play();
  EXPECT_TRUE(watched.result.end.complete);
  EXPECT_TRUE(watched.seen.all.empty()) << watched.seen.told();
  ASSERT_EQ(watched.seen.rows.size(), alone.seen.rows.size());
  for (std::size_t i = 0; i < alone.seen.rows.size(); ++i)
    ASSERT_EQ(watched.seen.rows[i].q_act, alone.seen.rows[i].q_act) << i;
  ASSERT_GT(positions.size(), 40u);
  for (const auto& [k, x] : positions) {  // answered in k: the end of cycle k, row k+1
    const auto row = static_cast<std::size_t>(k + 1);
    if (row >= watched.seen.rows.size()) continue;
    EXPECT_NEAR(x * 1e-7, watched.seen.rows[row].q_act[kX], 0.51e-7) << k;
  }
}

TEST(CanopenMachine, AFollowingWindowThatIsWrittenActs) {
  ToolRun run({}, {"axes.X.velocity_ff=0", "axes.X.kv_per_s=20"});  // lags 2.5 mm at 50 mm/s
  SdoClient client(1);
  run.tool->before_sync = [&](Tick k) -> std::optional<Frame> {
    if (k != 100) return std::nullopt;
    return client.download(0x6065, 0, {0xe8, 0x03, 0, 0});  // 0.1 mm
  };
  run.play();
  ASSERT_NE(run.seen.first(2101), nullptr) << run.seen.told();
  EXPECT_EQ(run.seen.first(2101)->source, "drive X");
  EXPECT_TRUE(run.at_rest());
  EXPECT_EQ(run.modules->device(1).objects().find(0x1003, 1)->get() & 0xffff, 0x8611);
  EXPECT_EQ(run.modules->device(1).objects().find(0x1001, 0)->get(), 0x21);
  // With a time-out of a minute the same window lets it pass.
  ToolRun patient({}, {"axes.X.velocity_ff=0", "axes.X.kv_per_s=20"});
  patient.tool->before_sync = [&](Tick k) -> std::optional<Frame> {
    if (k == 100) return client.download(0x6066, 0, {0x60, 0xea});
    if (k == 101) return client.download(0x6065, 0, {0xe8, 0x03, 0, 0});
    return std::nullopt;
  };
  patient.play();
  EXPECT_TRUE(patient.result.end.complete) << patient.seen.told();
}

TEST(CanopenMachine, AModuleWhoseHeartbeatIsTurnedOffStopsTheMachine) {
  ToolRun run;
  SdoClient client(7);
  run.tool->before_sync = [&](Tick k) -> std::optional<Frame> {
    if (k != 500) return std::nullopt;
    return client.download(0x1017, 0, {0, 0});
  };
  run.play();
  const Alarm* alarm = run.seen.first(3203);
  ASSERT_NE(alarm, nullptr) << run.seen.told();
  EXPECT_EQ(alarm->source, "probe");
  EXPECT_NE(alarm->text.find("probe, none for 300 ms"), std::string::npos) << alarm->text;
  // The last came in 443: (7 mod 16) * 100 / 16 = 43.
  EXPECT_EQ(alarm->tick, 443 + 301);
  EXPECT_EQ(run.result.exit_code(), 3);
  EXPECT_TRUE(run.at_rest());
}

TEST(CanopenMachine, ALostHeartbeatOfADriveNamesIt) {
  ToolRun run({"drive Z drop id=0x703 from_s=0.5"});
  run.play();
  const Alarm* alarm = run.seen.first(3203);
  ASSERT_NE(alarm, nullptr) << run.seen.told();
  EXPECT_EQ(alarm->source, "drive Z");
  EXPECT_EQ(alarm->tick, 418 + 301);
  EXPECT_TRUE(run.at_rest());
}

TEST(CanopenMachine, WithoutTheHeartbeatOfTheNcUnitDrivesBrakeAndTheSpindleLocks) {
  ToolRun run({"NC unit drop id=0x77f from_s=0.5"});
  run.play();
  // The last one left in 493 and was heard in 494.
  for (const char* name : {"drive X", "drive Y", "drive Z", "drive A", "drive C", "drive spindle",
                           "probe", "overtravel"})
    EXPECT_TRUE(std::any_of(
        run.seen.all.begin(), run.seen.all.end(),
        [&](const Alarm& a) { return a.code == 3203 && a.source == name && a.tick == 494 + 301; }))
        << name << "\n"
        << run.seen.told();
  EXPECT_TRUE(run.at_rest());
  EXPECT_TRUE(dynamic_cast<const SpindleNode&>(run.modules->module(kSpindleNode)).locked());
  EXPECT_EQ(run.result.exit_code(), 3);
}

TEST(CanopenMachine, AModuleTakenOutOfOperationIsLostByName) {
  ToolRun run;
  run.tool->before_sync = [&](Tick k) -> std::optional<Frame> {
    if (k != 400) return std::nullopt;
    return encode(Nmt{NmtCommand::preop, 2});
  };
  run.play();
  EXPECT_EQ(run.result.end.reason, "drive Y went pre-operational in cycle 400");
  EXPECT_NE(run.seen.first(3201), nullptr) << run.seen.told();
  EXPECT_TRUE(run.at_rest()) << "it brakes on its own, the others are told to";
}

TEST(CanopenMachine, OfAModuleWithFaultsTheNcUnitJudgesTheState) {
  ToolRun run({"overtravel corrupt id=0x708 bit=1 from_s=0.3"});  // 05 becomes 07
  run.play();
  const Alarm* alarm = run.seen.first(3203);
  ASSERT_NE(alarm, nullptr) << run.seen.told();
  EXPECT_EQ(alarm->source, "overtravel");
  ToolRun stopped({"overtravel corrupt id=0x708 bit=0 from_s=0.3"});  // 05 becomes 04
  stopped.play();
  alarm = stopped.seen.first(3203);
  ASSERT_NE(alarm, nullptr) << stopped.seen.told();
  EXPECT_NE(alarm->text.find("overtravel says stopped"), std::string::npos) << alarm->text;
}

TEST(CanopenMachine, ADriveThatGoesBusOffBrakesAloneAndReportsWhenItIsBack) {
  ToolRun run({"drive X bus_off from_s=0.4 for_s=0.05"});
  run.play();
  const Alarm* silent = run.seen.first(3202);
  ASSERT_NE(silent, nullptr) << run.seen.told();
  EXPECT_EQ(silent->source, "drive X");
  EXPECT_EQ(silent->tick, 402);
  EXPECT_TRUE(std::any_of(run.seen.all.begin(), run.seen.all.end(), [](const Alarm& a) {
    return a.source == "drive X" && a.text.find("8140h") != std::string::npos;
  })) << run.seen.told();
  EXPECT_GT(run.result.end.bus_load_worst, 1) << "error frames take bus time";
  EXPECT_TRUE(run.at_rest());
}

TEST(CanopenMachine, NoHeartbeatIsADeclaredChoice) {
  ToolRun run({"drive Z drop id=0x703 from_s=0.1"}, {"bus.heartbeat_ms=0"});
  run.play();
  EXPECT_TRUE(run.result.end.complete) << run.seen.told();
}

TEST(CanopenMachine, EveryLineOfEveryDictionaryCanBeRead) {
  ToolRun run;
  std::size_t lines = 0;
  for (int id = 1; id <= kOvertravelNode; ++id) {
    const ObjectDictionary& objects = run.modules->device(id).objects();
    for (const ObjectEntry& e : objects.entries()) {
      ObjectBytes bytes;
      EXPECT_EQ(objects.read(e.index, e.sub, bytes), SdoAbort::none) << id << e.name;
      if (e.type != ObjectType::text) {
        EXPECT_EQ(bytes.size(), static_cast<std::size_t>(size_of(e.type))) << e.name;
      }
      if (e.access != ObjectAccess::read_write) {
        EXPECT_EQ(objects.write(e.index, e.sub, bytes), SdoAbort::read_only) << e.name;
      }
      ++lines;
    }
  }
  EXPECT_GT(lines, 800u);
}

/// The page in docs/ is the generated one. `vcnc objects` prints it.
TEST(CanopenMachine, PageInDocsIsCurrent) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/docs/objects.md");
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), objects_page()) << "vcnc objects > docs/objects.md";
}

TEST(CanopenMachine, DataSheetListsEveryObjectOnce) {
  const std::string eds = data_sheet("drive A", "");
  EXPECT_EQ(eds, data_sheet("4", ""));
  ToolRun run;
  const auto count = [&](const std::string& what) {
    std::size_t n = 0;
    for (std::size_t at = eds.find(what); at != std::string::npos; at = eds.find(what, at + 1)) ++n;
    return n;
  };
  for (const ObjectHead& head : run.modules->device(4).objects().heads()) {
    char index[16];
    std::snprintf(index, sizeof index, "%04X", head.index);
    EXPECT_EQ(count(std::string("\n[") + index + "]\n"), 1u) << index;
    EXPECT_EQ(count(std::string("=0x") + index + "\n"), 1u) << index << " in the lists";
  }
  EXPECT_NE(eds.find("\n[6065]\nParameterName=Following error window\nObjectType=0x7\n"
                     "DataType=0x0007\nAccessType=rw\n"),
            std::string::npos);
  EXPECT_NE(eds.find("\n[1018sub4]\n"), std::string::npos);
  EXPECT_THROW(data_sheet("drive Q", ""), InputError);
}

}  // namespace
}  // namespace vcnc::canopen_test
