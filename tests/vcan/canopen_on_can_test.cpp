// Third-party CAN tools against a module on a real SocketCAN interface: cansend asks, candump
// hears.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/processes/shell.hpp"

namespace vcnc::canopen_on_can_test {
namespace {

/// Runs for as long as the object lives.
class Background {
 public:
  explicit Background(const std::string& command) : pid_(::fork()) {
    if (pid_ != 0) return;
    ::execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
    ::_exit(127);
  }
  ~Background() {
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

 private:
  pid_t pid_;
};

/// candump on the interface, and what it has heard.
class Listener {
 public:
  Listener(const Scratch& scratch, const std::string& filter)
      : scratch_(scratch),
        interface_(interface_name()),
        log_(scratch / "log"),
        dump_("candump -L " + interface_ + "," + filter + " >" + log_ + " 2>/dev/null") {}

  static std::string interface_name() {
    const char* set = std::getenv("VCNC_CAN_IF");
    return set && *set ? set : "vcan0";
  }
  std::string heard() const { return read_text(log_); }
  bool wait_for(const std::string& line, int most = 400) const {
    for (int i = 0; i < most; ++i) {
      if (heard().find(line) != std::string::npos) return true;
      shell(scratch_, "sleep 0.05");
    }
    return false;
  }
  void send(const std::string& frame) const {
    EXPECT_EQ(shell(scratch_, "cansend " + interface_ + " " + frame).code, 0) << frame;
  }
  /// Until candump hears.
  bool ready() const {
    for (int i = 0; i < 100; ++i) {
      send("5FE#00");
      if (wait_for("5FE#00", 1)) return true;
    }
    return false;
  }

 private:
  const Scratch& scratch_;
  std::string interface_, log_;
  Background dump_;
};

bool can_utils_missing(const Scratch& scratch) {
  return shell(scratch, "command -v cansend && command -v candump").code != 0;
}

TEST(CanopenOnCan, CansendReadsAndWritesADriveThatIsPreOperational) {
  Scratch scratch;
  if (can_utils_missing(scratch)) GTEST_SKIP() << "can-utils are not installed";
  const Listener bus(scratch, "0:0");
  ASSERT_TRUE(bus.ready());
  const Background drive(bin("vcnc-drive") + " --machine " + configs("machines/trunnion.toml") +
                         " --bus can://" + Listener::interface_name() + " --truth " +
                         (scratch / "truth") + " --axis X 2>/dev/null");
  ASSERT_TRUE(bus.wait_for("701#00")) << bus.heard();
  const auto ask = [&](const char* what, const char* request, const char* answer) {
    bus.send(request);
    EXPECT_TRUE(bus.wait_for(answer)) << what << "\n" << bus.heard();
  };
  ask("device type", "601#4000100000000000", "581#4300100092010200");
  ask("device name: twelve bytes", "601#4008100000000000", "581#410810000C000000");
  ask("vcnc dr", "601#6000000000000000", "581#0076636E63206472");
  ask("ive X", "601#7000000000000000", "581#1569766520580000");
  ask("heartbeat: 500 ms", "601#2B171000F4010000", "581#6017100000000000");
  ask("heartbeat", "601#4017100000000000", "581#4B171000F4010000");
  ask("no such object", "601#4034120000000000", "581#8034120000000206");
  ask("start", "000#0101", "701#05");
}

TEST(CanopenOnCan, CansendTalksToAMachineThatRuns) {
  Scratch scratch;
  if (can_utils_missing(scratch)) GTEST_SKIP() << "can-utils are not installed";
  const Listener bus(scratch, "580:780,700:780");
  ASSERT_TRUE(bus.ready());
  write_text(scratch / "long.ngc", "G90 G21 G54\nG1 X50 F300\nM30\n");
  const Background machine(bin("vcnc") + " run " + (scratch / "long.ngc") + " --machine " +
                           configs("machines/trunnion.toml") + " --no-report --bus can://" +
                           Listener::interface_name() + " --out " + (scratch / "run") +
                           " >/dev/null 2>&1");
  ASSERT_TRUE(bus.wait_for("77F#05")) << "the NC unit lives\n" << bus.heard();
  const auto ask = [&](const char* what, const char* request, const char* answer) {
    bus.send(request);
    EXPECT_TRUE(bus.wait_for(answer)) << what << "\n" << bus.heard();
  };
  ask("position of X", "601#4064600000000000", "581#43646000");
  ask("following window", "601#23656000E8030000", "581#6065600000000000");
  ask("heartbeat of the probe off", "607#2B17100000000000", "587#6017100000000000");
  std::string summary;
  for (int i = 0; i < 400 && summary.empty(); ++i) {
    shell(scratch, "sleep 0.05");
    summary = read_text(scratch / "run/summary.json");
  }
  EXPECT_NE(summary.find("probe, none for 300 ms"), std::string::npos) << summary;
  EXPECT_EQ(json_value(summary, "gaps"), "0");
}

}  // namespace
}  // namespace vcnc::canopen_on_can_test
