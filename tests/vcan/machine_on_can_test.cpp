// The whole machine over a real SocketCAN interface gives the trace hash that it gives in one
// process.
#include <gtest/gtest.h>

#include "tests/processes/shell.hpp"

namespace vcnc::machine_on_can_test {
namespace {

TEST(MachineOnCan, SameHashAsInOneProcess) {
  const char* interface = std::getenv("VCNC_CAN_IF");
  const std::string bus = std::string("can://") + (interface && *interface ? interface : "vcan0");
  Scratch scratch;
  write_text(
      scratch / "short.ngc",
      "G90 G21 G54\nG64 P0.01\nM19\nG0 A7.88 C173.92\nG43.4 H1\nG0 X115.4 Y38.43 Z79\nG0 Z20\n"
      "G1 X110.8 Y35.44 F1000\nG1 X109 Y38 A8 C175 F2000\nG1 X115.4 Y38.43\nM30\n");
  const std::string run = bin("vcnc") + " run " + (scratch / "short.ngc") + " --machine " +
                          configs("machines/trunnion_measured.toml") + " --no-report";
  const Said alone = shell(scratch, run + " --in-process --out " + (scratch / "alone"));
  ASSERT_EQ(alone.code, 0) << alone.err;
  const Said on_can = shell(scratch, run + " --bus " + bus + " --out " + (scratch / "can"));
  ASSERT_EQ(on_can.code, 0) << on_can.err;
  const std::string a = read_text(scratch / "alone/summary.json"),
                    b = read_text(scratch / "can/summary.json");
  EXPECT_EQ(json_value(a, "trace_hash").size(), 32u);
  EXPECT_EQ(json_value(a, "trace_hash"), json_value(b, "trace_hash"));
  EXPECT_EQ(json_value(b, "gaps"), "0");
}

}  // namespace
}  // namespace vcnc::machine_on_can_test
