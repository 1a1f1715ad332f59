#include "controller/gcode/interpreter.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "controller/player.hpp"
#include "tests/controller/program_file.hpp"

namespace vcnc::interpreter_test {
namespace {

Machine test_machine() {
  Machine machine;
  for (std::size_t i = kX; i <= kZ; ++i) machine.axes[i].limits.start = 0.1 * (1 + double(i));
  machine.kinematics.p_MA = Vec3(0, 0, -0.05);
  machine.kinematics.p_MC = Vec3(0, 0.01, -0.05);
  machine.setup.work_offset[0] = Vec3(0.01, 0.02, 0.03);
  machine.setup.work_offset[1] = Vec3(-0.01, 0, 0.05);
  machine.setup.tool_length = {0.15, 0.1};
  return machine;
}

Coordinates coordinates(double x, double y, double z, double a, double c) {
  Coordinates result;
  result << x * 1e-3, y * 1e-3, z * 1e-3, a * kDegree, c * kDegree;
  return result;
}

Move only_move(const std::string& text, const Machine& machine = test_machine()) {
  const auto moves = read_moves(text + "\nM30\n", machine);
  EXPECT_EQ(moves.size(), 1u) << text;
  return moves.empty() ? Move() : moves.back();
}

Move last_move(const std::string& text, const Machine& machine = test_machine()) {
  const auto moves = read_moves(text + "\nM30\n", machine);
  EXPECT_FALSE(moves.empty()) << text;
  return moves.empty() ? Move() : moves.back();
}

void expect_near(const Coordinates& a, const Coordinates& b, double tolerance = 1e-12) {
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), tolerance) << a.transpose() << " vs " << b.transpose();
}

TEST(Gcode, WordsAreAxisPositionsInTheWorkOffset) {
  const Move move = only_move("G0 X1 Y2 Z3 A4 C5");
  EXPECT_EQ(move.kind, Move::Kind::rapid);
  EXPECT_FALSE(move.frame.rtcp);
  expect_near(move.start, coordinates(100, 200, 300, 0, 0));
  expect_near(move.end, coordinates(11, 22, 33, 4, 5));
}

TEST(Gcode, ToolLengthIsAddedOnZ) {
  expect_near(last_move("G43 H2 G0 Z3").end, coordinates(100, 200, 133, 0, 0));
  expect_near(last_move("G43 H1\nG0 Z3\nG49\nZ3 X1").end, coordinates(11, 200, 33, 0, 0));
  expect_near(last_move("G43 H0 G0 Z3").end, coordinates(100, 200, 33, 0, 0));
}

TEST(Gcode, EveryWorkOffsetIsKnown) {
  Machine machine = test_machine();
  for (int i = 0; i < 6; ++i) {
    machine.setup.work_offset[static_cast<std::size_t>(i)] = Vec3(0.01 * i, 0, 0);
    expect_near(
        only_move(std::string("G").append(std::to_string(54 + i)).append(" G0 X1"), machine).end,
        coordinates(1 + 10 * i, 200, 300, 0, 0));
  }
}

TEST(Gcode, IncrementalAndInch) {
  expect_near(only_move("G91 G0 X1 C-10").end, coordinates(101, 200, 300, 0, -10));
  expect_near(only_move("G20 G0 X1 A5").end, coordinates(35.4, 200, 300, 5, 0));
  EXPECT_NEAR(only_move("G20 G1 X1 F60").feed, 25.4e-3, 1e-15);
  expect_near(last_move("G20 G91 G0 X1\nG21 G90 X1").end, coordinates(11, 200, 300, 0, 0));
}

TEST(Gcode, FeedModes) {
  const Move tip = only_move("G1 X0 A1 F600");
  EXPECT_EQ(tip.feed_mode, Move::Feed::tip);
  EXPECT_NEAR(tip.feed, 0.01, 1e-15);
  const Move rotary = only_move("G1 A1 F600");
  EXPECT_EQ(rotary.feed_mode, Move::Feed::rotary);
  EXPECT_NEAR(rotary.feed, 10 * kDegree, 1e-15);
  const Move time = only_move("G93 G1 X0 F30");
  EXPECT_EQ(time.feed_mode, Move::Feed::time);
  EXPECT_NEAR(time.feed, 2.0, 1e-15);
  EXPECT_NEAR(last_move("G93 G1 X0 F30\nG94 X1 F60").feed, 1e-3, 1e-15);
  EXPECT_EQ(only_move("F100 G0 X0").feed_mode, Move::Feed::none);
}

TEST(Gcode, PathModes) {
  const Machine machine = test_machine();
  EXPECT_EQ(only_move("G0 X0").tolerance, machine.nc.blend_tolerance);
  EXPECT_TRUE(only_move("G61 G0 X0").exact);
  const Move blended = only_move("G61\nG64 P0.02 G0 X0");
  EXPECT_FALSE(blended.exact);
  EXPECT_NEAR(blended.tolerance, 20e-6, 1e-18);
  EXPECT_EQ(only_move("G64 P0.02\nG64 G0 X0").tolerance, machine.nc.blend_tolerance);
  EXPECT_NEAR(only_move("G20 G64 P0.001 G0 X0").tolerance, 25.4e-6, 1e-18);
}

TEST(Gcode, DynamicsOfFanucAndSiemens) {
  using Dynamics = NcParams::Dynamics;
  const std::string text =
      "G0 X0\nG5.1 Q1 R1\nX1\nG5.1 Q1 R5\nX2\nG5.1 Q1 R6\nX3\nG5.1 Q1 R10\nX4\nG5.1 Q1\nX5\n"
      "DYNROUGH\nX6\nDYNFINISH\nX7\nDYNNORM\nX8\nDYNPOS X9\nDYNSEMIFIN\nX10\nG5.1 Q0\nX11\nM30\n";
  for (const Dynamics usual : {Dynamics::smooth, Dynamics::fast}) {
    Machine machine = test_machine();
    machine.nc.dynamics = usual;
    std::vector<Dynamics> found;
    for (const Move& move : read_moves(text, machine)) found.push_back(move.dynamics);
    const Dynamics s = Dynamics::smooth, f = Dynamics::fast;
    EXPECT_EQ(found, (std::vector<Dynamics>{usual, f, f, s, s, usual, f, s, usual, f, s, usual}));
  }
}

TEST(Gcode, MachineCoordinatesForOneBlock) {
  const auto moves = read_moves("G43 H1\nG53 G0 Z5\nZ5\nM30\n", test_machine());
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_TRUE(moves[0].alone);
  expect_near(moves[0].end, coordinates(100, 200, 5, 0, 0));
  expect_near(moves[1].end, coordinates(100, 200, 185, 0, 0));
  EXPECT_FALSE(moves[1].alone);
}

TEST(Gcode, ReferenceReturnGoesByTheViaPoint) {
  const auto moves = read_moves("G0 X0 Y0 Z0\nG28 X50 Z60\nM30\n", test_machine());
  ASSERT_EQ(moves.size(), 3u);
  expect_near(moves[1].end, coordinates(60, 20, 90, 0, 0));
  expect_near(moves[2].end, coordinates(100, 20, 300, 0, 0));
  EXPECT_TRUE(moves[1].alone && moves[2].alone);
  EXPECT_EQ(moves[2].kind, Move::Kind::rapid);
  // At the via point already: one move only.
  EXPECT_EQ(read_moves("G0 X0\nG91 G28 X0\nM30\n", test_machine()).size(), 2u);
}

TEST(Gcode, RtcpSpeaksOfTheControlledPoint) {
  const Machine machine = test_machine();
  const auto moves = read_moves("G0 A20 C30\nG43.4 H2\nG1 X10 Y20 Z30 F100\nM30\n", machine);
  ASSERT_EQ(moves.size(), 2u);
  const Move& move = moves[1];
  EXPECT_TRUE(move.frame.rtcp);
  EXPECT_EQ(move.frame.tool_length, 0.1);
  expect_near(move.end, coordinates(10, 20, 30, 20, 30));
  // The controlled point starts where the axes stand.
  const Kinematics kinematics(machine.kinematics, 0.1, machine.setup.work_offset[0]);
  const Vec3 p = kinematics.forward({0.1, 0.2, 0.3, 20 * kDegree, 30 * kDegree}).p_WT;
  EXPECT_LE((move.start.head<3>() - p).norm(), 1e-12);
}

TEST(Gcode, LeavingRtcpOrChangingTheOffsetKeepsTheAxesWhereTheyAre) {
  const Machine machine = test_machine();
  const std::string begin = "G43.4 H1\nG1 X10 Y20 Z30 A10 C20 F100\n";
  const auto plain = read_moves(begin + "G49\nG91 G0 X1\nM30\n", machine);
  const Kinematics kinematics(machine.kinematics, 0.15, machine.setup.work_offset[0]);
  const AxisVector q = kinematics.inverse(Vec3(0.01, 0.02, 0.03), 10 * kDegree, 20 * kDegree);
  expect_near(plain.back().start, coordinates(q[0] * 1e3, q[1] * 1e3, q[2] * 1e3, 10, 20));
  const auto shifted = read_moves(begin + "G55\nG91 G1 X1\nM30\n", machine);
  const FrameMap before(machine.kinematics, plain.front().frame);
  const FrameMap after(machine.kinematics, shifted.back().frame);
  expect_near(after.to_axes(shifted.back().start), before.to_axes(plain.front().end));
}

TEST(Gcode, ArcByCentreAndByRadiusAgree) {
  for (const std::string g : {"G2", "G3"}) {
    const std::string begin = std::string("G54 G0 X0 Y0 Z0\n").append(g);
    const double turn = g == "G3" ? 1 : -1;
    const Move centre = last_move(begin + " X10 Y" + (turn > 0 ? "10" : "-10") + " I0 J" +
                                  (turn > 0 ? "10" : "-10") + " F100");
    const Move radius = last_move(begin + " X10 Y" + (turn > 0 ? "10" : "-10") + " R10 F100");
    EXPECT_NEAR(centre.arc.sweep, turn * kPi / 2, 1e-12);
    EXPECT_NEAR(radius.arc.sweep, turn * kPi / 2, 1e-9);
    EXPECT_LE((centre.arc.centre - radius.arc.centre).norm(), 1e-12);
    const Move longer = last_move(begin + " X10 Y" + (turn > 0 ? "10" : "-10") + " R-10 F100");
    EXPECT_NEAR(longer.arc.sweep, turn * 1.5 * kPi, 1e-9);
  }
}

TEST(Gcode, FullCirclesHelicesAndPlanes) {
  EXPECT_NEAR(last_move("G0 X0 Y0\nG2 I5 F100").arc.sweep, -2 * kPi, 1e-12);
  const Move helix = last_move("G0 X0 Y0 Z0\nG3 X0 Y0 Z-7 I5 F100");
  EXPECT_NEAR(helix.arc.sweep, 2 * kPi, 1e-12);
  EXPECT_NEAR(helix.end[kZ] - helix.start[kZ], -7e-3, 1e-15);
  // G18: from +Z to +X is counter-clockwise about +Y; G19: from +Y to +Z about +X.
  const Move zx = last_move("G18 G0 X0 Y0 Z10\nG3 X10 Z0 K-10 F100");
  EXPECT_EQ(zx.arc.normal, std::size_t{kY});
  EXPECT_NEAR(zx.arc.sweep, kPi / 2, 1e-12);
  const Move yz = last_move("G19 G0 X0 Y10 Z0\nG3 Y0 Z10 J-10 F100");
  EXPECT_EQ(yz.arc.normal, std::size_t{kX});
  EXPECT_NEAR(yz.arc.sweep, kPi / 2, 1e-12);
  const Move modal = last_move("G17 G0 X0 Y0 Z0\nG3 X10 Y10 J10 F100\nX0 Y20 I-10");
  EXPECT_NEAR(modal.arc.sweep, kPi / 2, 1e-12);
}

TEST(Gcode, RadiusMismatchWithinTheToleranceIsASpiral) {
  const Move move = last_move("G0 X0 Y0\nG3 X9.995 Y10 J10 F100");
  EXPECT_NEAR(move.arc.sweep, kPi / 2, 1e-9);
  expect_near(move.end, coordinates(19.995, 30, 300, 0, 0));
}

TEST(Gcode, DwellStopsAndSpindle) {
  Machine machine = test_machine();
  machine.probe.in_spindle = false;
  const auto blocks = read_blocks("S600 M3\nG4 P1.5\nM4\nM5\nM19\nM0\nM1\nm2\nG999\n", machine);
  ASSERT_EQ(blocks.size(), 7u);
  using Mode = SpindleWord::Mode;
  EXPECT_EQ(std::get<SpindleWord>(blocks[0]).mode, Mode::clockwise);
  EXPECT_NEAR(std::get<SpindleWord>(blocks[0]).speed, 20 * kPi, 1e-12);
  EXPECT_EQ(std::get<Dwell>(blocks[1]).seconds, 1.5);
  EXPECT_EQ(std::get<SpindleWord>(blocks[2]).mode, Mode::counter_clockwise);
  EXPECT_EQ(std::get<SpindleWord>(blocks[3]).mode, Mode::off);
  EXPECT_EQ(std::get<SpindleWord>(blocks[4]).mode, Mode::orient);
  EXPECT_FALSE(std::get<ProgramStop>(blocks[5]).optional);
  EXPECT_TRUE(std::get<ProgramStop>(blocks[6]).optional);
  EXPECT_EQ(std::get<ProgramStop>(blocks[6]).line, 7);
}

TEST(Gcode, WhatFollowsTheEndIsNotRead) {
  EXPECT_TRUE(read_moves("M30\nG1 X1\nnonsense $$$\n", test_machine()).empty());
  EXPECT_EQ(read_moves("G0 X1 M2\nG12.3\n", test_machine()).size(), 1u);
}

TEST(Gcode, EveryAcceptedCodeIsAccepted) {
  Machine machine = test_machine();
  machine.probe.in_spindle = false;
  for (const char* code :
       {"G0 X1",     "G1 X1 F1",  "G2 I1 F1",   "G3 I1 F1",
        "G4 P1",     "G17",       "G18",        "G19",
        "G20",       "G21",       "G28 X0",     "G40",
        "G43 H1",    "G43.4 H1",  "G49",        "G53 G0 X1",
        "G54",       "G55",       "G56",        "G57",
        "G58",       "G59",       "G61",        "G64",
        "G64 P0.01", "G90",       "G91",        "G93",
        "G94",       "F100",      "S100",       "M0",
        "M1",        "M2",        "S1 M3",      "S1 M4",
        "M5",        "M19",       "M30",        "N10",
        "O1234",     "%",         "%1234",      "N10 G17 G21 G90 G94 G40 G49 G54 G64",
        "(comment)", "; comment", "g1 x 1 f 20"})
    EXPECT_NO_THROW(read_blocks(std::string(code) + "\nM30\n", machine)) << code;
}

// ----------------------------------------------------------------------------- wrong programs

struct WrongProgram {
  const char* text;
  int line;
  const char* message;
};

void PrintTo(const WrongProgram& wrong, std::ostream* out) { *out << wrong.text; }

class RefusedProgram : public testing::TestWithParam<WrongProgram> {};

TEST_P(RefusedProgram, NamesLineAndReason) {
  const WrongProgram& wrong = GetParam();
  const ProgramFile file(wrong.text);
  try {
    Player player(file.path(), test_machine());
    FAIL() << "accepted: " << wrong.text;
  } catch (const ProgramError& error) {
    const std::string what = error.what();
    const std::string expected = file.path() + ":" + std::to_string(wrong.line) + ":";
    EXPECT_EQ(what.substr(0, expected.size()), expected) << what;
    EXPECT_NE(what.find(wrong.message), std::string::npos) << what;
  }
}

const WrongProgram kWrong[] = {
    // words
    {"G1 X1 F100 $\nM30", 1, "unexpected '$'"},
    {"G0 X\nM30", 1, "1:5: X: a number is missing"},
    {"G0 X1.2.3\nM30", 1, "1:5: X: malformed number 1.2.3"},
    {"\nG0 X+-1\nM30", 2, "2:5: X: malformed number +-1"},
    {"G0 X1 X2\nM30", 1, "1:7: X given twice"},
    {"G1 X1 F100 F200\nM30", 1, "1:12: F given twice"},
    {"G0 X99999999\nM30", 1, "number too large"},
    {"(open\nM30", 1, "comment without closing"},
    {"G0 B10\nM30", 1, "unknown word B10"},
    {"T3\nM30", 1, "unknown T3; allowed are 0 1 2"},
    {"D1\nM30", 1, "D1 belongs to no word of this block"},
    {"G0 X1e3\nM30", 1, "unknown word E3"},
    {"1 2 3\nM30", 1, "a word is a letter followed by a number"},
    {"#1\nM30", 1, "a parameter at the begin of a word is set"},
    {"\xFFG0\nM30", 1, "unexpected byte 0xff"},
    // codes
    {"G12.3\nM30", 1, "unknown G12.3; allowed are G0 G1"},
    {"G5.1\nM30", 1, "G5.1 without Q"},
    {"G5.1 Q1 R11\nM30", 1, "1:9: R of G5.1 must be a level from 1 (fast) to 10 (smooth)"},
    {"G5.1 Q1 R2.5\nM30", 1, "R of G5.1 must be a level"},
    {"G31 X1\nM30", 1, "G31 without F"},
    {"G33 Z1 K1\nM30", 1, "G33 with the spindle at rest"},
    {"G87 X1 R2 Z1 F9\nM30", 1, "G87 with the spindle at rest"},
    {"G-1\nM30", 1, "unknown G-1"},
    {"G0.05 X1\nM30", 1, "unknown G0.05"},
    {"M12\nM30", 1, "unknown M12; allowed are M0"},
    {"M3.5\nM30", 1, "unknown M3.5"},
    {"M99\n", 1, "M99 in the main program would repeat it without end"},
    {"G0 G1 X1\nM30", 1, "G0 and G1 in one block"},
    {"G17 G18\nM30", 1, "G17 and G18 in one block"},
    {"G90 G91\nM30", 1, "G90 and G91 in"},
    {"G20 G21\nM30", 1, "G20 and G21 in"},
    {"G54 G55\nM30", 1, "G54 and G55 in"},
    {"G61 G64\nM30", 1, "G61 and G64 in"},
    {"G93 G94\nM30", 1, "G93 and G94 in"},
    {"G43 H1 G49\nM30", 1, "1:8: G43 and G49 in one block"},
    {"G28 X0 G53\nM30", 1, "G28 and G53 in"},
    {"G1 G1 X1 F1\nM30", 1, "G1 and G1 in one block"},
    {"M0 M30\n", 1, "M0 and M30 in"},
    {"M5 M19\nM30", 1, "M5 and M19 in"},
    // feed and spindle
    {"G1 X1\nM30", 1, "G1 without F"},
    {"G2 I5\nM30", 1, "G2 without F"},
    {"G1 X1 F0\nM30", 1, "F0 must be greater than 0"},
    {"F-10\nM30", 1, "F-10 must be greater than 0"},
    {"F100\nG93 G1 X1\nM30", 2, "G1 without F; under G93"},
    {"G93 G1 X1 F10\nX2\nM30", 2, "under G93 every block needs its own"},
    {"G93 G1 X1 F10\nG94 X2\nM30", 2, "G1 without F"},
    {"S100 M3\nM30", 1, "probe in spindle: only M19 is allowed"},
    {"S100 M4\nM30", 1, "probe in spindle: only M19 is allowed"},
    {"S-1\nM30", 1, "S-1 is out of range"},
    {"S99999\nM30", 1, "allowed is 0 to 12000 rpm"},
    {"G1 X0 F0.0001\nM30", 1, "the move would last"},
    {"G93 G1 X0 F0.0001\nM30", 1, "the move would last"},
    // motion
    {"X1\nM30", 1, "axis words without G0, G1, G2, G3 or a cycle"},
    {"G1 X1 I5 F100\nM30", 1, "1:7: I5 belongs to no word of this block"},
    {"G0 X1\nG0 R5\nM30", 2, "2:4: R5 belongs to no word"},
    {"G2 F100\nM30", 1, "arc without end point and centre"},
    {"G2 X10 Y10 F100\nM30", 1, "arc without centre"},
    {"G2 X10 Y10 I5 R5 F100\nM30", 1, "arc with R and with I J K"},
    {"G17 G2 X10 K5 F100\nM30", 1, "K does not lie in the plane G17"},
    {"G18 G2 X10 J5 F100\nM30", 1, "J does not lie in the plane G18"},
    {"G19 G2 Y10 I5 F100\nM30", 1, "I does not lie in the plane G19"},
    {"G0 X0 Y0\nG2 X10 Y0 I4 F100\nM30", 2, "radius mismatch"},
    {"G0 X0 Y0\nG3 X9.98 Y10 J10 F100\nM30", 2, "radius mismatch"},
    {"G0 X0 Y0\nG2 X10 Y0 R4 F100\nM30", 2, "R4 is shorter than half the chord, 5.0000 mm"},
    {"G2 R5 F100\nM30", 1, "arc by R that ends where it starts"},
    {"G2 I0 J0 F100\nM30", 1, "arc of radius 0"},
    // modes
    {"G4\nM30", 1, "G4 without P"},
    {"G4 P-1\nM30", 1, "P of G4 must be 0 to 36000"},
    {"G4 P1 X1\nM30", 1, "G4 takes no axis words"},
    {"G0 G4 P1\nM30", 1, "G4 or G28 together with a motion word"},
    {"G28 G0 X1\nM30", 1, "G28 together with a motion word"},
    {"G4 G64 P1\nM30", 1, "G4 and G64 in one block"},
    {"P1\nM30", 1, "P1 belongs to no word of this block"},
    {"G64 P0\nM30", 1, "P of G64 must be a tolerance"},
    {"G64 P-0.01\nM30", 1, "P of G64 must be a tolerance"},
    {"G64 P10\nM30", 1, "P of G64 must be a tolerance"},
    {"G53\nM30", 1, "G53 without axis words"},
    {"G2 G53 X1 I1 F1\nM30", 1, "G53 with G2 or G3"},
    {"G91 G53 G0 X1\nM30", 1, "G53 under G91"},
    {"G43.4\nM30", 1, "G43.4 without H"},
    {"G43 H3\nM30", 1, "1:5: unknown H3; allowed are 0 1 2"},
    {"G43.4 H-1\nM30", 1, "unknown H-1"},
    {"G43 H1.5\nM30", 1, "unknown H1.5"},
    {"H1\nM30", 1, "H1 belongs to no word of this block"},
    {"G49 H1\nM30", 1, "H1 belongs to no word of this block"},
    {"G43.4 H1\n\nG43.4 H1\nM30", 3, "G43.4 while G43.4 is active; cancel with G49 first"},
    {"G43.4 H1\nG43 H1\nM30", 2, "G43 while G43.4 is active"},
    {"G43.4 H1\nG53 G0 X1\nM30", 2, "G53 while G43.4 or G68.2 is active"},
    {"G43.4 H1\nG28 X1\nM30", 2, "G28 while G43.4 is active"},
    // the whole program
    {"\n", 1, "does not end with M2 or M30"},
    {"G0 X1\n", 1, "does not end with M2 or M30"},
    {"G0 X1\nG1 Y1 F100\n\n", 3, "does not end with M2 or M30"},
    {"%\nO1\nG0 X1\n;\nX2000\nM30", 5,
     "X would reach 2010.000 mm; allowed is -1000.000 to 1000.000"},
    {"G0 A-400\nM30", 1, "A would reach -400.000 deg"},
    {"G0 X990 Y0\nG3 X990 Y0 J100 F100\nM30", 2, "X would reach"},
    // Both ends are within the travel, the middle of the turn is not.
    {"G43.4 H1\nG0 X700 Y700 Z0\nG1 C90 F100\nM30", 3, "X would reach"},
};

INSTANTIATE_TEST_SUITE_P(Gcode, RefusedProgram, testing::ValuesIn(kWrong));

TEST(RefusedPrograms, RandomTextIsRefusedOrReadButNeverWorse) {
  std::mt19937_64 random(5);
  constexpr std::string_view kPieces[] = {
      "G0",  "G1",  "G2",    "G3",   "X1",  "Y-2", "Z.5", "I1",  "J0",  "K",  "R5",  "F100",
      "G4",  "P1",  "G43.4", "H1",   "G49", "G28", "G53", "G61", "G64", "C9", "A-8", "(x)",
      "G91", "G18", "G20",   "G93",  "M19", "M5",  "S1",  "\n",  "\n",  "\n", ";",   "$",
      "G55", "N1",  "M0",    "X1e9", "--",  "\r",  "G54", "G19", "M1",  " ",  "G90", "%"};
  int read = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text;
    const std::size_t count = 1 + random() % 12;
    for (std::size_t k = 0; k < count; ++k) text += kPieces[random() % std::size(kPieces)];
    try {
      read_blocks(text + "\nM30\n", test_machine());
      ++read;
    } catch (const ProgramError&) {
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_LT(read, 2900);
}

TEST(RefusedPrograms, AnEmptyFileIsNamedWithoutALine) {
  const ProgramFile file("");
  try {
    Player player(file.path(), test_machine());
    FAIL();
  } catch (const ProgramError& error) {
    EXPECT_EQ(std::string(error.what()), file.path() + ": the program is empty");
  }
}

TEST(RefusedPrograms, AreMany) { EXPECT_GE(std::size(kWrong), 60u); }

}  // namespace
}  // namespace vcnc::interpreter_test
