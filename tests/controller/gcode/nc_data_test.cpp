// What programs change at the control, kept and taken over by the next one.
#include "controller/gcode/nc_data.hpp"

#include <gtest/gtest.h>

#include "controller/gcode/interpreter.hpp"
#include "controller/program_error.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/scratch.hpp"

namespace vcnc::nc_data_test {
namespace {

struct Played {
  NcData data;
  std::vector<Move> moves;
};

Played play(const std::string& text, const NcData& before = {},
            const Machine& machine = Machine()) {
  const ProgramFile file(text);
  InterpreterOptions options;
  options.data = before;
  GcodeInterpreter program(file.path(), machine, options);
  Played played;
  for (Block block = program.next(); !std::holds_alternative<ProgramEnd>(block);
       block = program.next())
    if (const Move* move = std::get_if<Move>(&block)) played.moves.push_back(*move);
  played.data = program.data();
  return played;
}

TEST(NcData, OfAProgramThatChangesNothingIsEmpty) {
  Machine machine;
  machine.setup.work_offset[0] = Vec3(0.1, 0.2, 0.3);
  machine.setup.work_offset[8] = Vec3(0.01, 0, 0);
  EXPECT_EQ(play("G0 X1 Y1\n#5=3\nM30\n", {}, machine).data, NcData{});
}

// Every number by hand: mm and degrees of the program, m and rad kept.
TEST(NcData, HoldsWhatAProgramHasChanged) {
  const NcData data = play(
                          "G10 L2 P2 X12.5 C30\nG10 L2 P9 Z-4\n#100=7.5\n#31=1\n#30=9\n#5001=8\n"
                          "G10 L1 P3 Z80 R4\nG28.1\nG92 X5\nM30\n")
                          .data;
  EXPECT_NEAR(data.parameters.at(5241), 0.0125, 1e-18);
  EXPECT_NEAR(data.parameters.at(5246), 30 * kDegree, 1e-15);
  EXPECT_NEAR(data.parameters.at(5383), -0.004, 1e-18);
  EXPECT_EQ(data.parameters.at(100), 7.5);
  EXPECT_EQ(data.parameters.at(31), 1);
  EXPECT_FALSE(data.parameters.contains(30)) << "local";
  EXPECT_FALSE(data.parameters.contains(5001));
  EXPECT_FALSE(data.parameters.contains(5221)) << "as the machine file has it";
  EXPECT_NEAR(data.parameters.at(5211), -0.005, 1e-18);
  EXPECT_FALSE(data.parameters.contains(5210)) << "the end of the program switches G92 off";
  ASSERT_EQ(data.tools.size(), 1u);
  EXPECT_NEAR(data.tools.at(3).offset[kZ], 0.08, 1e-18);
  EXPECT_NEAR(data.tools.at(3).diameter, 0.008, 1e-18);
}

// Two programs with the machine switched off in between do what one does.
TEST(NcData, TwoProgramsWithItAreLikeOne) {
  const std::string first =
      "G10 L2 P2 X12.345678 Y-1.1 R30\n#100=[1/3]\n#101=#100\nG10 L1 P2 Z33.3 R2\n";
  const std::string second = "G55 G43 H2\nG0 X#100 Y[#101*2]\nZ10\n";
  const auto whole = play(first + second + "M30\n");
  const auto one = play(first + "M30\n");
  const auto kept = decode_nc_data(encode_nc_data({{}, one.data}));
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->now, one.data);
  EXPECT_EQ(kept->begin, NcData{});
  const auto two = play(second + "M30\n", kept->now);
  ASSERT_EQ(two.moves.size(), whole.moves.size());
  for (std::size_t i = 0; i < two.moves.size(); ++i)
    EXPECT_EQ(two.moves[i].end, whole.moves[i].end) << "to the bit";
  EXPECT_EQ(two.data, whole.data);
}

TEST(NcData, OfMacrosAreTheirCommonVariables) {
  const NcData data = play("#500=4\n#100=5\n#499=6\nIF [1 EQ 1] THEN #501=2\nM30\n").data;
  EXPECT_EQ(data.parameters.size(), 2u);
  EXPECT_EQ(data.parameters.at(500), 4);
  EXPECT_EQ(data.parameters.at(501), 2);
  EXPECT_TRUE(play("#500=#0\nIF [1 EQ 1] THEN #501=#0\nM30\n", data).data.parameters.empty())
      << "vacant again";
}

TEST(NcData, AFileFollowsWhereNobodyHasChangedIt) {
  const NcData data = play("G10 L2 P1 X10\nM30\n").data;
  Machine machine;
  machine.setup.work_offset[0] = Vec3(0.5, 0.02, 0);
  const auto moves = play("G0 X1 Y1\nM30\n", data, machine).moves;
  EXPECT_NEAR(moves[0].end[kX], 0.011, 1e-15) << "changed by a program";
  EXPECT_NEAR(moves[0].end[kY], 0.021, 1e-15) << "of the machine file";
}

TEST(NcData, BytesThatAreNoneAreRefused) {
  NcData data;
  data.parameters = {{31, 1.5}, {5221, 0.1}};
  data.tools[4].diameter = 0.01;
  const ProbeTouch touch{7, true, 1.25, {1, 2, 3, 4, 5}, {2, 3, 4, 5, 6}, {3, 4, 5, 6, 7}};
  const auto bytes = encode_nc_data({data, data, {touch, touch}});
  EXPECT_EQ(decode_nc_data(bytes).value().touches, (std::vector<ProbeTouch>{touch, touch}));
  for (std::size_t cut = 0; cut < bytes.size(); ++cut)
    EXPECT_FALSE(decode_nc_data({bytes.data(), cut})) << cut;
  auto wrong = bytes;
  wrong[0] = 3;
  EXPECT_FALSE(decode_nc_data(wrong));
  EXPECT_EQ(to_var_file(data), "31\t1.5\n5221\t100\n");
  EXPECT_NE(to_text(data).find("G54          X100.0000\ntool 4"), std::string::npos);
}

TEST(ProgramPath, IsSearchedAfterThePrograms) {
  const Scratch folder;
  folder.write("deep/there.ngc", "o<there> sub\nG0 X5\no<there> endsub\n");
  Machine machine;
  const std::string text = "o<there> call\nM30\n";
  try {
    play(text, {}, machine);
    ADD_FAILURE();
  } catch (const ProgramError& e) {
    EXPECT_NE(std::string(e.what()).find("beside it"), std::string::npos);
  }
  machine.nc.program_path = folder / "none" + ":" + folder / "deep";
  const auto moves = play(text, {}, machine).moves;
  ASSERT_EQ(moves.size(), 1u);
  EXPECT_NEAR(moves[0].end[kX], 0.005, 1e-15);
}

}  // namespace
}  // namespace vcnc::nc_data_test
