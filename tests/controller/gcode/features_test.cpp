// What the words do, against values computed by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "controller/gcode/arc_geometry.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/program_error.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/scratch.hpp"

namespace vcnc::features_test {
namespace {

InterpreterOptions bare() {
  InterpreterOptions options;
  ToolTable tools;
  tools.entry(1).offset[kZ] = 0.05;
  tools.entry(1).diameter = 0.010;
  tools.entry(2).offset << 0.001, -0.002, 0.1, 0, 0;
  tools.entry(2).diameter = 0.004;
  options.tools = tools;
  options.bare = true;
  return options;
}

std::vector<Block> blocks_of_file(const std::string& path, InterpreterOptions options = bare(),
                                  const Machine& machine = Machine()) {
  GcodeInterpreter program(path, machine, std::move(options));
  std::vector<Block> blocks;
  for (Block block = program.next(); !std::holds_alternative<ProgramEnd>(block);
       block = program.next())
    blocks.push_back(std::move(block));
  return blocks;
}

std::vector<Block> blocks_of(const std::string& text, InterpreterOptions options = bare(),
                             const Machine& machine = Machine()) {
  const ProgramFile file(text + "\nM30\n");
  return blocks_of_file(file.path(), std::move(options), machine);
}

std::vector<Move> moves_among(const std::vector<Block>& blocks) {
  std::vector<Move> moves;
  for (const Block& block : blocks)
    if (const Move* move = std::get_if<Move>(&block)) moves.push_back(*move);
  return moves;
}

std::vector<Move> moves_of(const std::string& text, InterpreterOptions options = bare(),
                           const Machine& machine = Machine()) {
  return moves_among(blocks_of(text, std::move(options), machine));
}

/// End points [mm] of X, Y, Z of all moves, as text: "r 1 2 3; l 4 5 6; a 7 8 9".
std::string path_of(const std::vector<Move>& moves) {
  std::string path;
  for (const Move& move : moves) {
    path += path.empty() ? "" : "; ";
    path += move.probe != Move::Probe::none  ? "p"
            : move.kind == Move::Kind::rapid ? "r"
            : move.kind == Move::Kind::arc   ? "a"
                                             : "l";
    for (Eigen::Index i = 0; i < 3; ++i) {
      char number[32];
      const double mm = std::round(move.end[i] * 1e7) / 1e4;
      std::snprintf(number, sizeof number, " %g", mm == 0 ? 0.0 : mm);
      path += number;
    }
  }
  return path;
}

std::string path_of(const std::string& text, InterpreterOptions options = bare()) {
  return path_of(moves_of(text, std::move(options)));
}

std::string refused(const std::string& text, InterpreterOptions options = bare()) {
  try {
    blocks_of(text, std::move(options));
  } catch (const ProgramError& error) {
    const std::string what = error.what();
    return what.substr(what.find(':') + 1);
  }
  return "accepted";
}

// ------------------------------------------------------------------------------------- offsets

TEST(GcodeOffsets, WorkOffsetsRotationAndShiftsAddUp) {
  EXPECT_EQ(path_of("G10 L2 P1 X10 Y20\nG0 X1 Y1"), "r 11 21 0");
  EXPECT_EQ(path_of("G10 L2 P7 X5\nG59.1 G0 X1"), "r 6 0 0");
  EXPECT_EQ(path_of("G0 X3\nG92 X0\nX1\nG92.2\nX1\nG92.3\nX2\nG92.1\nX7"),
            "r 3 0 0; r 4 0 0; r 1 0 0; r 5 0 0; r 7 0 0");
  EXPECT_EQ(path_of("G52 X10\nG0 X1\nG52 X0\nX1"), "r 11 0 0; r 1 0 0");
  EXPECT_EQ(path_of("G10 L2 P1 X10 R90\nG0 X1 Y0"), "r 10 1 0");
  EXPECT_EQ(path_of("G10 L2 P1 R90\nG91 G1 X1 F9\nX1"), "l 0 1 0; l 0 2 0");
  EXPECT_EQ(path_of("G68 X10 Y0 R90\nG0 X11 Y0\nG69 X1"), "r 10 1 0; r 1 1 0");
  EXPECT_EQ(path_of("G0 X7 Y8\nG10 L20 P1 X1 Y0\nG0 X0 Y0"), "r 7 8 0; r 6 8 0");
  EXPECT_EQ(path_of("G20 G10 L2 P1 X1\nG21 G0 X0"), "r 25.4 0 0");
}

TEST(GcodeOffsets, ToolOffsets) {
  EXPECT_EQ(path_of("G43 H1 G0 Z1"), "r 0 0 51");
  EXPECT_EQ(path_of("T2 M6\nG43 G0 X0 Y0 Z1"), "r 1 -2 101");
  EXPECT_EQ(path_of("G43.1 Z7\nG0 Z1"), "r 0 0 8");
  EXPECT_EQ(path_of("G43 H1\nG43.2 H2\nG0 Z0"), "r 0 0 150");
  EXPECT_EQ(path_of("G10 L1 P1 Z30\nG43 H1 G0 Z1"), "r 0 0 31");
  EXPECT_EQ(refused("G43 H9"), "1:5: unknown H9; allowed are 0 1 2");
}

TEST(GcodeOffsets, ReferencePointsAndProbing) {
  EXPECT_EQ(path_of("G0 X5\nG28.1\nX1 Y1\nG28"), "r 5 0 0; r 1 1 0; r 5 0 0");
  EXPECT_EQ(path_of("G30 X9 Y9"), "r 9 9 0; r 0 0 0");
  EXPECT_EQ(path_of("G38.2 Z-4 F50\nG0 X[#5063] Y#5070"), "p 0 0 -4; r -4 1 -4");
  EXPECT_EQ(refused("G38.2 F10"), "1:1: G38.2 without axis words");
}

TEST(GcodeOffsets, ParametersShowTheState) {
  EXPECT_EQ(path_of("G10 L2 P3 Y4\nG56\nG0 X#5220 Y[#5262+1]"), "r 3 9 0");
  EXPECT_EQ(path_of("G0 X2 Y3\nG0 Z[#5420+#5421]"), "r 2 3 0; r 2 3 5");
  EXPECT_EQ(path_of("#5221=8\nG0 X1\nG54 X1"), "r 1 0 0; r 9 0 0");
  EXPECT_EQ(path_of("T2 M6\nG0 X#5400 Y#5410"), "r 2 4 0");
}

// --------------------------------------------------------------------------------------- feeds

TEST(GcodeFeeds, PerTurnAndInverseTime) {
  const auto per_turn = moves_of("S600 M3\nG95 F0.2\nG1 X10");
  ASSERT_EQ(per_turn.size(), 1u);
  EXPECT_NEAR(per_turn[0].feed, 0.2e-3 * 10, 1e-15);
  EXPECT_NEAR(per_turn[0].feed_per_turn, 0.2e-3, 1e-18);
  EXPECT_NE(refused("G95 F1\nG1 X1").find("feed per turn (G95) without S"), std::string::npos);
  EXPECT_NEAR(moves_of("G93 G1 X10 F4")[0].feed, 15, 1e-12);
}

TEST(GcodeArcs, TurnsAndAbsoluteCentres) {
  EXPECT_NEAR(moves_of("G3 I5 P3 F9")[0].arc.sweep, 6 * kPi, 1e-12);
  EXPECT_NEAR(moves_of("G2 X10 I5 P2 F9")[0].arc.sweep, -3 * kPi, 1e-12);
  const Move absolute = moves_of("G90.1 G10 L2 P1 X1\nG0 X0 Y0\nG3 X10 I5 J0 F9")[1];
  EXPECT_NEAR(absolute.arc.centre[0], 6e-3, 1e-15);
  EXPECT_NE(refused("G90.1 G3 X10 I5 F9").find("needs I and J"), std::string::npos);
  EXPECT_NE(refused("G3 I5 P0 F9").find("turns of an arc"), std::string::npos);
}

// ----------------------------------------------------------------------- cutter compensation

TEST(GcodeCompensation, SquareFromOutsideAndInside) {
  // Tool of 10 mm; a square of 40 mm clockwise with the tool on its left: outside.
  const auto moves = moves_of("G0 Y-40\nF100\nG41 D1 G1 X0 Y-20\nY40\nX40\nY0\nX-20\nG40 Y-30");
  // entry, side, corner, side, corner, side, corner, side, exit
  ASSERT_EQ(moves.size(), 10u);
  const auto at = [&](std::size_t i) { return Vec2(moves[i].end[0] * 1e3, moves[i].end[1] * 1e3); };
  EXPECT_LE((at(1) - Vec2(-5, -20)).norm(), 1e-9);
  EXPECT_LE((at(2) - Vec2(-5, 40)).norm(), 1e-9);
  EXPECT_EQ(moves[3].kind, Move::Kind::arc);
  EXPECT_NEAR(moves[3].arc.sweep, -kPi / 2, 1e-12);
  EXPECT_LE((at(3) - Vec2(0, 45)).norm(), 1e-9);
  EXPECT_LE((at(4) - Vec2(40, 45)).norm(), 1e-9);
  EXPECT_LE((at(5) - Vec2(45, 40)).norm(), 1e-9);
  EXPECT_LE((at(8) - Vec2(-20, -5)).norm(), 1e-9);
  EXPECT_LE((at(9) - Vec2(-20, -30)).norm(), 1e-9);
  // The same square with the tool on the right: inside, cut corners.
  EXPECT_EQ(path_of("F100\nG42 D1 G1 X0 Y10\nY40\nX40\nY0\nX10\nG40 X20 Y20"),
            "l 5 10 0; l 5 35 0; l 35 35 0; l 35 5 0; l 10 5 0; l 20 20 0");
}

TEST(GcodeCompensation, ArcsKeepCentreAndAngle) {
  // Round a circle of 30 mm, tangent entry: outside 35, inside 25.
  const auto outside = moves_of("F100\nG0 X30 Y-20\nG42 D1 G1 X30 Y0\nG3 I-30\nG40 G1 X30 Y20");
  ASSERT_EQ(outside.size(), 4u);
  EXPECT_NEAR(outside[2].end[0], 0.035, 1e-12);
  EXPECT_NEAR(outside[2].arc.sweep, 2 * kPi, 1e-12);
  const auto inside = moves_of("F100\nG0 X30 Y-20\nG41 D1 G1 X30 Y0\nG3 I-30\nG40 G1 X20 Y0");
  ASSERT_EQ(inside.size(), 4u);
  EXPECT_NEAR(inside[2].end[0], 0.025, 1e-12);
}

TEST(GcodeCompensation, InsideCornerOfLineAndArcIsWhereBothMeet) {
  // Along y = 0 to the right into a half circle about (20, 0) of 10 mm that goes up and back:
  // the shifted line y = 5 meets the circle of 5 mm about (20, 0) at its top... from the left.
  const auto moves =
      moves_of("F100\nG0 X-20 Y0\nG41.1 D4 G1 X0 Y0\nX30 Y0\nG3 X10 I-10\nG40 G1 X10 Y-30");
  ASSERT_EQ(moves.size(), 5u);
  const double x = 20 + std::sqrt(8.0 * 8.0 - 2.0 * 2.0);
  EXPECT_NEAR(moves[2].end[0] * 1e3, x, 1e-9);
  EXPECT_NEAR(moves[2].end[1] * 1e3, 2, 1e-9);
  EXPECT_NEAR((moves[3].start.head<2>() - moves[2].end.head<2>()).norm(), 0, 1e-15);
}

TEST(GcodeCompensation, WhatWouldGougeIsRefused) {
  EXPECT_NE(refused("F100\nG41 D1 G1 X3\nX9").find("must be longer than the tool's radius"),
            std::string::npos);
  EXPECT_NE(refused("F100\nG0 Y-9\nG41 D1 G1 Y0\nG3 X-4 I-2\nX5").find("gouge: the arc's radius"),
            std::string::npos);
  EXPECT_NE(refused("F100\nG42 D1 G1 Y20\nX4\nY0").find("too short for the inside corner"),
            std::string::npos);
  EXPECT_NE(refused("F9\nG41 D1\nG41 D1").find("G41 while cutter compensation is on"),
            std::string::npos);
  EXPECT_NE(refused("F9\nG41 D1 G1 X20\nG18").find("change of the plane while"), std::string::npos);
}

/// The centre never comes closer to a convex polygon than the radius, and stays at it.
TEST(GcodeCompensation, RandomConvexPolygonsAreFollowedAtTheRadius) {
  std::mt19937_64 random(7);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
  for (int round = 0; round < 50; ++round) {
    std::vector<Vec2> corners;
    for (double angle = 0.3 * uniform(); angle < 5.9; angle += 0.3 + uniform())
      corners.emplace_back(40 * std::cos(-angle), 40 * std::sin(-angle));  // clockwise
    std::string text = "F500\nG0 X100 Y100\nG41 D1 G1 X70 Y60\n";
    for (std::size_t i = 0; i <= corners.size(); ++i) {
      const Vec2& c = corners[i % corners.size()];
      text.append("X").append(std::to_string(c[0])).append(" Y").append(std::to_string(c[1]));
      text += '\n';
    }
    const auto moves = moves_of(text + "G40 X100 Y-100");
    const auto distance = [&](const Vec2& p) {
      double least = 1e9;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec2 a = corners[i], d = corners[(i + 1) % corners.size()] - a;
        const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
        least = std::min(least, (a + t * d - p).norm());
      }
      return least;
    };
    int checked = 0;
    for (std::size_t i = 4; i + 2 < moves.size(); ++i) {
      const Vec2 p = moves[i].end.head<2>() * 1e3;
      EXPECT_NEAR(distance(p), 5, 2e-5);
      ++checked;
      if (moves[i].kind == Move::Kind::line) {
        EXPECT_NEAR(distance(0.5e3 * (moves[i].start + moves[i].end).head<2>()), 5, 2e-5);
      }
    }
    EXPECT_GT(checked, 3);
  }
}

// -------------------------------------------------------------------------------------- cycles

TEST(GcodeCycles, DrillingAndRetract) {
  EXPECT_EQ(
      path_of("F9 G0 Z10\nG98 G81 X1 Y2 Z-3 R1\nX5\nG80"),
      "r 0 0 10; r 1 2 10; r 1 2 1; l 1 2 -3; r 1 2 10; r 5 2 10; r 5 2 1; l 5 2 -3; r 5 2 10");
  EXPECT_EQ(path_of("F9 G0 Z10\nG99 G81 X1 Z-3 R1\nG80 G0 X0"),
            "r 0 0 10; r 1 0 10; r 1 0 1; l 1 0 -3; r 1 0 1; r 0 0 1");
  EXPECT_EQ(path_of("F9 G0 Z10\nG91 G99 G81 X1 Z-3 R-8 L2"),
            "r 0 0 10; r 1 0 10; r 1 0 2; l 1 0 -1; r 1 0 2; r 2 0 2; l 2 0 -1; r 2 0 2");
}

TEST(GcodeCycles, PecksAndChipBreaks) {
  EXPECT_EQ(path_of("F9 G0 Z2\nG99 G83 X0 Z-5 R0 Q3"),
            "r 0 0 2; r 0 0 0; l 0 0 -3; r 0 0 0; r 0 0 -2.746; l 0 0 -5; r 0 0 0");
  EXPECT_EQ(path_of("F9 G0 Z2\nG99 G73 X0 Z-5 R0 Q3"),
            "r 0 0 2; r 0 0 0; l 0 0 -3; r 0 0 -2.746; l 0 0 -5; r 0 0 0");
}

TEST(GcodeCycles, BoringAndTapping) {
  EXPECT_EQ(path_of("F9 G0 Z2\nG98 G85 X0 Z-5 R0"), "r 0 0 2; r 0 0 0; l 0 0 -5; l 0 0 0; r 0 0 2");
  int spindle = 0, dwell = 0;
  for (const Block& block : blocks_of("F9 S9 M3\nG99 G84 X1 Z-5 R0 P0.5")) {
    spindle += std::holds_alternative<SpindleWord>(block);
    dwell += std::holds_alternative<Dwell>(block);
  }
  EXPECT_EQ(spindle, 5);  // M3; off, reversed, off, on
  EXPECT_EQ(dwell, 1);
  EXPECT_EQ(path_of("F9 S9 M3 G0 Z2\nG99 G76 X0 Z-5 R0 Q1 P0.1"),
            "r 0 0 2; r 0 0 0; l 0 0 -5; r 1 0 -5; r 1 0 0; r 0 0 0");
  EXPECT_NE(refused("F9\nG84 X1 Z-5 R0").find("spindle at rest"), std::string::npos);
  EXPECT_NE(refused("F9\nG81 X1 Z5 R0").find("is below Z"), std::string::npos);
  EXPECT_NE(refused("F9\nG83 X1 Z-5 R0").find("needs Q greater than 0"), std::string::npos);
}

// ---------------------------------------------------------------------------------------- flow

TEST(GcodeFlow, SubroutinesWithArgumentsAndValues) {
  EXPECT_EQ(
      path_of(
          "O100 sub\nG0 X[#1+#2]\nO100 endsub [#1*2]\n#1=7\nO100 call [1] [2]\nG0 Y#1 Z#<_value>"),
      "r 3 0 0; r 3 7 2");
  EXPECT_EQ(path_of("O<fac> sub\nO1 if [#1 le 1]\nO<fac> return [1]\nO1 endif\nO<fac> call [#1-1]\n"
                    "O<fac> endsub [#1*#<_value>]\nO<fac> call [5]\nG0 X#<_value>"),
            "r 120 0 0");
  EXPECT_EQ(path_of("O7 sub\nG0 X1\nO7 endsub\n#3=7\nO[#3] call"), "r 1 0 0");
}

TEST(GcodeFlow, BranchesAndLoops) {
  for (const auto& [value, x] : {std::pair{"1", 10}, {"2", 20}, {"3", 30}}) {
    const std::string text = std::string("#1=") + value +
                             "\nO1 if [#1 eq 1]\nG0 X10\nO1 elseif [#1 eq 2]\nG0 X20\nO1 else\nG0 "
                             "X30\nO1 endif";
    EXPECT_EQ(path_of(text), std::string("r ").append(std::to_string(x)).append(" 0 0"));
  }
  EXPECT_EQ(path_of("#1=0\nO1 while [#1 lt 5]\n#1=[#1+1]\nO2 if [#1 eq 2]\nO1 continue\nO2 endif\n"
                    "O3 if [#1 eq 4]\nO1 break\nO3 endif\nG0 X#1\nO1 endwhile"),
            "r 1 0 0; r 3 0 0");
  EXPECT_EQ(path_of("#1=0\nO1 do\n#1=[#1+1]\nG0 X#1\nO1 while [#1 lt 2]"), "r 1 0 0; r 2 0 0");
  EXPECT_EQ(path_of("O1 repeat [2]\nO2 repeat [2]\nG91 G0 X1\nO2 endrepeat\nO1 endrepeat"),
            "r 1 0 0; r 2 0 0; r 3 0 0; r 4 0 0");
}

TEST(GcodeFlow, FanucMacros) {
  EXPECT_EQ(path_of("#1=1\nWHILE [#1 LE 3] DO1\nG0 X#1\n#1=#1+1\nEND1"),
            "r 1 0 0; r 2 0 0; r 3 0 0");
  EXPECT_EQ(path_of("#1=0\nN10 #1=#1+1\nG0 X#1\nIF [#1 LT 2] GOTO 10"), "r 1 0 0; r 2 0 0");
  EXPECT_EQ(path_of("GOTO 20\nG0 X1\nN20 IF [1 EQ 1] THEN #5=4\nG0 X#5 Y#6"), "r 4 0 0");
  EXPECT_EQ(path_of("G65 P900 L2 A3 X4\nG0 Z1\nM30\nO900\nG0 X#1 Y#24\nG91 G0 Z1\nG90\nM99"),
            "r 3 4 0; r 3 4 1; r 3 4 2; r 3 4 1");
  EXPECT_EQ(path_of("M98 P900 L2\nM30\nO900\nG91 G0 X1\nM99"), "r 1 0 0; r 2 0 0");
  EXPECT_EQ(path_of("G66 P900 A5\nG0 X1\nX2\nG67\nX3\nM30\nO900\nG0 Z#1\nZ0\nM99"),
            "r 1 0 0; r 1 0 5; r 1 0 0; r 2 0 0; r 2 0 5; r 2 0 0; r 3 0 0");
  EXPECT_NE(refused("IF [1 EQ 1] THEN #3000=7 (NO TOOL)").find("raises alarm 7 (NO TOOL)"),
            std::string::npos);
  EXPECT_EQ(path_of("M98 P900\nG0 Y1\nN7 G0 Z1\nM30\nO900\nG0 X1\nM99 P7"), "r 1 0 0; r 1 0 1");
}

TEST(GcodeFlow, SubroutinesInFilesBesideTheProgram) {
  const Scratch folder;
  folder.write("beside.ngc", "O<beside> sub\nG0 X#1\nO<beside> endsub\n");
  folder.write("8123.nc", "%\nO8123\nG0 Y2\nM99\n");
  const std::string program = folder.write("program.nc", "O<beside> call [4]\nM98 P8123\nM30\n");
  EXPECT_EQ(path_of(moves_among(blocks_of_file(program))), "r 4 0 0; r 4 2 0");
  EXPECT_NE(refused("O<beside> call").find("there is no O<beside> sub"), std::string::npos);
}

TEST(GcodeFlow, WhatDoesNotEndOrFitIsRefused) {
  EXPECT_EQ(refused("O1 while [1]\nO1 endwhile"),
            "2:1: more than 2000000 passes of loops, calls and jumps; does the program end?");
  EXPECT_NE(refused("O1 sub\nO1 call\nO1 endsub\nO1 call").find("nested deeper than 50"),
            std::string::npos);
  EXPECT_NE(refused("O1 if [1]").find("1: O1 IF without its end"), std::string::npos);
  EXPECT_NE(refused("O1 endwhile").find("O1 ENDWHILE without its begin"), std::string::npos);
  EXPECT_NE(refused("O1 while [0]\nO2 endwhile").find("while O1 WHILE of line 1 is open"),
            std::string::npos);
  EXPECT_NE(refused("O1 break").find("outside a loop"), std::string::npos);
  EXPECT_NE(refused("GOTO 5").find("there is no block N5"), std::string::npos);
  EXPECT_NE(refused("M99").find("M99 in the main program"), std::string::npos);
}

TEST(GcodeFlow, BlockDeleteAndModes) {
  EXPECT_EQ(path_of("/G0 X1\nG0 Y1"), "r 1 0 0; r 1 1 0");
  InterpreterOptions options = bare();
  options.block_delete = true;
  EXPECT_EQ(path_of("/G0 X1\nG0 Y1", options), "r 0 1 0");
  EXPECT_EQ(path_of("M70\nG91 G20\nM72\nG0 X1"), "r 1 0 0");
  EXPECT_EQ(path_of("O1 sub\nM73\nG91\nG0 X1\nO1 endsub\nG0 X1\nO1 call\nG0 X1"),
            "r 1 0 0; r 2 0 0; r 1 0 0");
}

// ----------------------------------------------------------------------------------- five axes

TEST(GcodeFiveAxes, ToolVectorGivesTheRotaryAxes) {
  // A = 20, C = 30: d = (0.171010072, -0.296198133, 0.939692621)
  const std::string vector = "I0.171010072 J-0.296198133 K0.939692621";
  for (const std::string& text :
       {std::string("G43.5 H1\nG1 X1 ").append(vector).append(" F9"),
        std::string("TRAORI\nG1 X1 A3=0.171010072 B3=-0.296198133 C3=0.939692621 F9")}) {
    const auto moves = moves_of(text);
    ASSERT_EQ(moves.size(), 1u);
    EXPECT_NEAR(moves[0].end[kA] / kDegree, 20, 1e-6);
    EXPECT_NEAR(moves[0].end[kC] / kDegree, 30, 1e-6);
    EXPECT_NEAR(moves[0].end[kX], 1e-3, 1e-15);
  }
  EXPECT_NE(refused("G43.5 H1\nG1 I0 J0 K0 F9").find("direction of the tool is 0"),
            std::string::npos);
  EXPECT_NE(refused("G1 X1 A3=1 F9").find("without TRAORI"), std::string::npos);
}

TEST(GcodeFiveAxes, TiltedPlane) {
  Machine machine;
  machine.kinematics.p_MA = Vec3(0, 0, -0.05);
  machine.kinematics.p_MC = Vec3(0, 0.01, -0.05);
  // A plane turned about x by 20 and before that about z by 30 degrees.
  const auto moves =
      moves_of("G43 H1\nG68.2 X10 Y20 Z30 I30 J20 K0\nG53.1\nG1 X1 Y2 Z3 F9\nG3 I5\nG69\nG0 X0",
               bare(), machine);
  ASSERT_EQ(moves.size(), 4u);
  EXPECT_NEAR(moves[0].end[kA] / kDegree, 20, 1e-9);
  EXPECT_NEAR(moves[0].end[kC] / kDegree, 30, 1e-9);
  EXPECT_EQ(moves[0].end.head<3>(), moves[0].start.head<3>());
  // p_W = o + Rz(30) Rx(20) p, through the kinematics of the machine.
  const Vec3 p = Vec3(0.01, 0.02, 0.03) +
                 (Eigen::AngleAxisd(30 * kDegree, Vec3::UnitZ()) *
                  Eigen::AngleAxisd(20 * kDegree, Vec3::UnitX()) * Vec3(1e-3, 2e-3, 3e-3));
  const AxisVector q =
      Kinematics(machine.kinematics, 0.05, Vec3::Zero()).inverse(p, 20 * kDegree, 30 * kDegree);
  const Coordinates axes = FrameMap(machine.kinematics, moves[1].frame).to_axes(moves[1].end);
  for (Eigen::Index i = 0; i < 5; ++i)
    EXPECT_NEAR(axes[i], q[static_cast<std::size_t>(i)], 1e-12) << i;
  EXPECT_EQ(moves[2].kind, Move::Kind::arc);
  EXPECT_FALSE(moves[3].frame.rtcp);
  EXPECT_NE(refused("G53.1").find("G53.1 without G68.2"), std::string::npos);
}

TEST(GcodeFiveAxes, SiemensWords) {
  EXPECT_EQ(path_of("G0 X=10 Y=2*3"), "r 10 6 0");
  EXPECT_EQ(path_of("G3 X10 CR=5 F9"), "a 10 0 0");
  const auto moves = moves_of("TRAORI\nG0 X1\nTRAFOOF\nG0 X1");
  EXPECT_TRUE(moves[0].frame.rtcp);
}

// -------------------------------------------------------------------------------- tool tables

TEST(GcodeTools, TableOfLinuxCnc) {
  const ProgramFile file("T1 P1 Z10.5 D6 ; end mill\n; nothing\nT12 P2 X1 Z-2\n");
  const ToolTable table = ToolTable::read(file.path(), 25.4e-3);
  EXPECT_NEAR(table.find(1)->offset.z(), 0.2667, 1e-12);
  EXPECT_NEAR(table.find(1)->diameter, 0.1524, 1e-12);
  EXPECT_NEAR(table.find(12)->offset.x(), 0.0254, 1e-12);
  EXPECT_EQ(table.find(2), nullptr);
  const ProgramFile wrong("T1 Z1\nT1 Z2\n");
  EXPECT_THROW(ToolTable::read(wrong.path(), 1e-3), ProgramError);
}

// --------------------------------------------------------------- threads, back boring, overrides

// K per turn at S: v = K S / 60, along the way.
TEST(GcodeThreads, RunAtTheFeedOfTheSpindle) {
  const auto moves = moves_of("S600 M3\nG0 X10 Z5\nG33 Z-15 K1.5\nX13 Z-19 K2\nG0 Z5\nM5");
  ASSERT_EQ(moves.size(), 4u);
  EXPECT_NEAR(moves[1].feed, 1.5e-3 * 10, 1e-15);
  EXPECT_NEAR(moves[2].feed, 2e-3 * 10, 1e-15);
  EXPECT_EQ(moves[1].panel, Move::Panel::locked);
  EXPECT_NEAR(moves[1].feed_per_turn, 1.5e-3, 1e-18);
  EXPECT_EQ(path_of("S600 M3\nG33 Z-15 K1.5"), "l 0 0 -15");
}

TEST(GcodeThreads, RigidTappingGoesBackWithTheSpindleReversed) {
  const auto blocks = blocks_of("S500 M3\nG0 X5 Z3\nG33.1 Z-10 K1.25");
  ASSERT_EQ(blocks.size(), 6u);
  EXPECT_NEAR(std::get<Move>(blocks[2]).end[kZ], -10e-3, 1e-15);
  EXPECT_EQ(std::get<SpindleWord>(blocks[3]).mode, SpindleWord::Mode::counter_clockwise);
  EXPECT_NEAR(std::get<Move>(blocks[4]).end[kZ], 3e-3, 1e-15);
  EXPECT_EQ(std::get<SpindleWord>(blocks[5]).mode, SpindleWord::Mode::clockwise);
}

TEST(GcodeThreads, AreRefusedWithTheReason) {
  EXPECT_NE(refused("S100 M3\nG33 Z1").find("G33 without K"), std::string::npos);
  EXPECT_NE(refused("S100\nG33 Z1 K1").find("spindle at rest"), std::string::npos);
  EXPECT_NE(refused("S100 M3\nG33 Z1 K0").find("more than 0"), std::string::npos);
  EXPECT_NE(refused("S100 M3\nG33 Z0 K1").find("ends where it starts"), std::string::npos);
}

// Into the bore beside the wall, up at feed, and out the same way.
TEST(GcodeCycles, BackBoringCutsUpwards) {
  EXPECT_EQ(path_of("S500 M3 F100\nG0 X10 Z20\nG98 G87 X30 R-10 Z-5 Q2\nG80"),
            "r 10 0 20; r 30 0 20; r 32 0 20; r 32 0 -10; r 30 0 -10; l 30 0 -5; r 32 0 -5; "
            "r 32 0 20; r 30 0 20");
  EXPECT_NE(refused("S500 M3 F100\nG0 Z20\nG87 X30 R-5 Z-10 Q2").find("bores upwards"),
            std::string::npos);
  EXPECT_NE(refused("S500 M3 F100\nG0 Z20\nG99 G87 X30 R-10 Z-5 Q2").find("allowed is G98"),
            std::string::npos);
}

TEST(GcodeOverrides, SayWhatTheOperatorMayDo) {
  using Panel = Move::Panel;
  const auto moves = moves_of(
      "F100\nG1 X1\nM49\nX2\nM48\nX3\nM50 P0\nX4\nM50\nX5\nG31 X6\nS500 M3\nG98 G84 X7 Z-1 "
      "R1\nG80");
  std::vector<Panel> panels;
  for (const Move& move : moves)
    if (move.kind == Move::Kind::line) panels.push_back(move.panel);
  EXPECT_EQ(panels, (std::vector<Panel>{Panel::acts, Panel::fixed, Panel::acts, Panel::fixed,
                                        Panel::acts, Panel::fixed, Panel::locked, Panel::locked}));
}

TEST(GcodeTools, HaveOffsetsOfTheRotaryAxes) {
  InterpreterOptions options = bare();
  options.tools->entry(3).offset << 0.001, 0, 0.03, 5 * kDegree, -10 * kDegree;
  const auto moves = moves_of("G43 H3\nG0 X0 Z0 A1 C2\nG43.1 A20\nC0 A0", options);
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_NEAR(moves[0].end[kA], 6 * kDegree, 1e-15);
  EXPECT_NEAR(moves[0].end[kC], -8 * kDegree, 1e-15);
  EXPECT_NEAR(moves[1].end[kA], 20 * kDegree, 1e-15);
  // The table is read again as it was written.
  const ProgramFile table(options.tools->to_text(1e-3));
  const ToolTable again = ToolTable::read(table.path(), 1e-3);
  ASSERT_EQ(again.all().size(), options.tools->all().size());
  for (const auto& [number, tool] : options.tools->all()) {
    EXPECT_LE((again.find(number)->offset - tool.offset).norm(), 1e-12) << number;
    EXPECT_NEAR(again.find(number)->diameter, tool.diameter, 1e-12);
  }
}

TEST(GcodeExpressions, AnUnknownOperatorIsNamed) {
  EXPECT_NE(refused("G0 X[1 % 2]").find("'%' is no operator; allowed are ** * /"),
            std::string::npos);
  EXPECT_NE(refused("G0 X[1 + 2").find("'[' without its ']'"), std::string::npos);
}

// ------------------------------------------------------------------------------ surface speed

std::vector<SpindleWord> spindle_words(const std::string& text) {
  std::vector<SpindleWord> words;
  for (const Block& block : blocks_of(text))
    if (const SpindleWord* word = std::get_if<SpindleWord>(&block)) words.push_back(*word);
  return words;
}

TEST(SurfaceSpeed, IsThatOfTheRadiusUpToTheLimit) {
  // n = v / (2 pi r): 100 m/min at 20 mm are 795.77 rpm; G54 and G92 move the axis of rotation.
  const auto words =
      spindle_words("G10 L2 P1 X30\nG54 G0 X20\nG96 S100 D2000 M3\nG0 X5\nS200\nG97\nS500");
  ASSERT_EQ(words.size(), 4u);
  EXPECT_NEAR(words[0].speed * 30 / kPi, 100e3 / (2 * kPi * 20), 1e-9);
  ASSERT_TRUE(words[0].surface);
  EXPECT_NEAR(words[0].surface->axis, 30e-3, 1e-15);
  EXPECT_NEAR(words[0].surface->at(30e-3 - 40e-3) * 30 / kPi, 100e3 / (2 * kPi * 40), 1e-9);
  EXPECT_NEAR(words[0].surface->at(30e-3) * 30 / kPi, 2000, 1e-9);
  EXPECT_NEAR(words[1].speed * 30 / kPi, 2000, 1e-9);  // 200 m/min at 5 mm would be 6366 rpm
  EXPECT_FALSE(words[2].surface);
  EXPECT_NEAR(words[2].speed * 30 / kPi, 2000, 1e-9);  // G97 keeps what it has become
  EXPECT_NEAR(words[3].speed * 30 / kPi, 500, 1e-9);
  // In inches S is in ft/min: 328.084 of them are 100 m/min.
  EXPECT_NEAR(spindle_words("G20 G0 X1\nG96 S328.084 M3")[0].speed * 30 / kPi,
              100e3 / (2 * kPi * 25.4), 1e-3);
}

TEST(SurfaceSpeed, GivesTheFeedPerTurnItsSpeed) {
  const auto moves = moves_of("G0 X20\nG96 S100 D3000 M3\nG95 F0.2 G1 X10");
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_NEAR(moves[1].feed_per_turn, 0.2e-3, 1e-15);
  EXPECT_NEAR(moves[1].feed, 0.2e-3 * (100.0 / 60) / (2 * kPi * 10e-3), 1e-12);
}

TEST(SurfaceSpeed, IsRefusedWhereItMakesNoSense) {
  EXPECT_NE(refused("G96 M3").find("1:1: G96 without S"), std::string::npos);
  EXPECT_NE(refused("G96 S0 M3").find("greater than 0"), std::string::npos);
  EXPECT_NE(refused("G0 X9\nG96 S10 M3\nG33 Z1 K1").find("G33 under G96"), std::string::npos);
}

// ------------------------------------------------------------------------------------ Siemens

InterpreterOptions siemens() {
  InterpreterOptions options = bare();
  options.dialect = InterpreterOptions::Dialect::siemens;
  return options;
}

TEST(Siemens, RParametersAreSetAndUsed) {
  EXPECT_EQ(path_of("R1=10 R2=R1*(R1+2)/4\nR[R1]=SIN(30)*6\nG0 X=R1 Y=R2 Z=R10", siemens()),
            "r 10 30 3");
  EXPECT_EQ(path_of("G0 X=ATAN2(1,1) Y=POT(3) Z=TRUNC(-2.5)", siemens()), "r 45 9 -2");
}

TEST(Siemens, WordsCountAsTheyAreWritten) {
  EXPECT_EQ(path_of("G90 G0 X10 Y10\nX=IC(5) Y=AC(3)\nG91 X=AC(1) Y2", siemens()),
            "r 10 10 0; r 15 3 0; r 1 5 0");
  const auto moves = moves_of("G0 C350\nC=DC(10)\nC=ACN(20)\nC=ACP(20)\nC=ACP(10)", siemens());
  ASSERT_EQ(moves.size(), 4u);  // ACP(20) is where C stands
  EXPECT_NEAR(moves[1].end[kC] / kDegree, 370, 1e-9);
  EXPECT_NEAR(moves[2].end[kC] / kDegree, 20, 1e-9);
  EXPECT_NEAR(moves[3].end[kC] / kDegree, 370, 1e-9);
}

TEST(Siemens, ACircleGoesThroughThePointBetween) {
  // The three points lie on the circle of radius 5 about (4, 3), which goes through 0.
  const auto ccw = moves_of("G1 F100 X0 Y0\nCIP X8 Y6 I1=8 J1=0", siemens());
  ASSERT_EQ(ccw.size(), 1u);
  EXPECT_NEAR(ccw[0].arc.centre.x(), 4e-3, 1e-12);
  EXPECT_NEAR(ccw[0].arc.centre.y(), 3e-3, 1e-12);
  EXPECT_NEAR(ccw[0].arc.sweep, kPi, 1e-9);
  const auto cw = moves_of("G91 G1 F100\nCIP X8 Y6 I1=0 J1=6 TURN=2", siemens());
  ASSERT_EQ(cw.size(), 1u);
  EXPECT_NEAR(cw[0].arc.sweep, -5 * kPi, 1e-9);
  EXPECT_NE(refused("F100\nCIP X2 Y2 I1=1 J1=1", siemens()).find("lie on a line"),
            std::string::npos);
  EXPECT_NE(refused("F100\nCIP X2 Y2 Z1 I1=1", siemens()).find("active plane"), std::string::npos);
}

TEST(Siemens, ADwellTakesNoFeedAndNoSpeed) {
  const auto blocks = blocks_of("S600 M3\nG1 F100 X1\nG4 F2.5\nG4 S20\nX2", siemens());
  ASSERT_EQ(blocks.size(), 5u);
  EXPECT_DOUBLE_EQ(std::get<Dwell>(blocks[2]).seconds, 2.5);
  EXPECT_NEAR(std::get<Dwell>(blocks[3]).seconds, 2, 1e-12);
  EXPECT_NEAR(std::get<Move>(blocks[4]).feed, 0.1 / 60, 1e-15);
}

TEST(Siemens, JumpsGoToLabelsAndBlocks) {
  EXPECT_EQ(path_of("R1=0\nAGAIN: R1=R1+1\nG0 X=R1\nIF R1<3 GOTOB AGAIN\nGOTO _END1\nX9\n"
                    "_END1: Y2",
                    siemens()),
            "r 1 0 0; r 2 0 0; r 3 0 0; r 3 2 0");
  EXPECT_EQ(path_of("GOTOF N40\nN30 G0 X1\nN40 G0 Y1\nGOTOC NOWHERE\nZ1", siemens()),
            "r 0 1 0; r 0 1 1");
  EXPECT_NE(refused("TOP: G0 X1\nGOTOF TOP", siemens()).find("2:1: GOTOF TOP: there is no such"),
            std::string::npos);
}

TEST(Siemens, StructuresNest) {
  EXPECT_EQ(
      path_of("FOR R1=1 TO 2\nIF R1==2\nG0 X=R1\nELSE\nG0 Y=R1\nENDIF\nENDFOR\nZ=R1", siemens()),
      "r 0 1 0; r 2 1 0; r 2 1 3");
  EXPECT_EQ(path_of("R1=5\nFOR R2=R1 TO 1\nG0 X99\nENDFOR\nG0 X=R2", siemens()), "r 5 0 0");
  EXPECT_EQ(path_of("REPEAT\nR1=R1+1\nUNTIL R1>=4\nG0 X=R1", siemens()), "r 4 0 0");
  EXPECT_EQ(path_of("WHILE (R1<3) OR FALSE\nR1=R1+1\nENDWHILE\nG0 X=R1", siemens()), "r 3 0 0");
}

/// Relations bind least, so that AND belongs to its neighbours (Siemens, priorities).
TEST(Siemens, OperatorsHaveTheirOwnRanks) {
  EXPECT_EQ(path_of("R1=7 DIV 2 R2=7 MOD 4 R3=NOT 0\nG0 X=R1 Y=R2 Z=R3", siemens()), "r 3 3 1");
  EXPECT_EQ(path_of("R1=(2<3) AND (4<>4)\nR2=1 AND 1==1\nR3=0 OR 1 AND 0\nG0 X=R1+5 Y=R2 Z=R3+2",
                    siemens()),
            "r 5 1 2");
}

TEST(Siemens, FramesReplaceOrAddUp) {
  EXPECT_EQ(path_of("TRANS X10 Y5\nG0 X1 Y0\nAROT RPL=90\nX1 Y0\nROT RPL=90\nX1 Y0\nROT\nX1 Y0",
                    siemens()),
            "r 11 5 0; r 10 6 0; r 0 1 0; r 1 0 0");
  const Move turned = moves_of("MIRROR X0\nG0 X1 Y0\nG3 X0 Y1 I-1 J0 F9", siemens())[1];
  EXPECT_NEAR(turned.arc.sweep, -kPi / 2, 1e-12);
  EXPECT_LE((turned.end.head<3>() - Vec3(0, 1e-3, 0)).norm(), 1e-15);
  EXPECT_NE(refused("SCALE X2\nG0 X1\nG3 X0 Y1 I-1 J0 F9", siemens()).find("3:1: G2 or G3 while"),
            std::string::npos);
  // In the plane ZX a turn of 90 deg takes Z to X and X to -Z.
  EXPECT_EQ(path_of("G18\nROT RPL=90\nG0 Z1 X2", siemens()), "r 1 0 -2");
}

TEST(Siemens, CirclesGoOnTangentially) {
  const Move ct = moves_of("G1 X10 F100\nCT X15 Y5", siemens())[1];
  EXPECT_LE((ct.arc.centre.head<2>() - Vec2(10e-3, 5e-3)).norm(), 1e-15);
  EXPECT_NEAR(ct.arc.sweep, kPi / 2, 1e-12);
  EXPECT_EQ(moves_of("G1 X10 F100\nCT X20", siemens())[1].kind, Move::Kind::line);
}

TEST(Siemens, Measures) {
  EXPECT_EQ(path_of("TRANS X10\nMEAS=1 G1 X5 F100\nR1=$AA_MW[X] R2=$AA_MM[X] R3=$AC_MEA[1]\n"
                    "TRANS\nG0 X=R1 Y=R2 Z=R3",
                    siemens()),
            "p 15 0 0; r 5 15 1");
}

TEST(Siemens, UnknownWordsAreNamed) {
  EXPECT_NE(refused("G1 F100 X1\nSPLINE X2", siemens()).find("2:1: unknown word SPLINE"),
            std::string::npos);
  EXPECT_NE(refused("CIP X8 Y6").find("1:1: unknown word CIP"), std::string::npos);
}

// -------------------------------------------------------------------------------- Fanuc's frames

InterpreterOptions fanuc() {
  InterpreterOptions options = bare();
  options.dialect = InterpreterOptions::Dialect::fanuc;
  return options;
}

TEST(Frames, PolarCoordinates) {
  EXPECT_EQ(path_of("G16\nG0 X10 Y30\nG91 Y60\nG90 X4\nG15 X1"),
            "r 8.6603 5 0; r 0 10 0; r 0 4 0; r 1 4 0");
  EXPECT_EQ(path_of("G18 G16\nG0 Z10 X90\nG15"), "r 10 0 0");
  EXPECT_EQ(path_of("G0 X5 Y5\nG91 G16 X2 Y90\nG15"), "r 5 5 0; r 3.5858 6.4142 0");
  EXPECT_EQ(path_of("F9 G99 G16 G81 X10 Y0 Z-1 R0\nY90\nG80 G15"),
            "r 10 0 0; l 10 0 -1; r 10 0 0; r 0 10 0; l 0 10 -1; r 0 10 0");
}

TEST(Frames, ScalingAndMirrors) {
  EXPECT_EQ(path_of("G51 X0 Y0 P2000\nG0 X3 Y4\nG50 X3"), "r 6 8 0; r 3 8 0");
  EXPECT_EQ(path_of("G51 X10 P0.5\nG0 X20"), "r 15 0 0");
  EXPECT_EQ(path_of("G51 X0 Y0 Z0 I-1000 J1000 K500\nG0 X3 Y4 Z4"), "r -3 4 2");
  EXPECT_EQ(path_of("G51.1 X5\nG0 X7\nG50.1 X0\nX7"), "r 3 0 0; r 7 0 0");
  EXPECT_EQ(path_of("G51.1 X0\nG68 X0 Y0 R90\nG0 X1 Y0"), "r 0 1 0") << "turned the other way";
  // #5041 is the position in the words of the program
  EXPECT_EQ(path_of("G51 X10 P2000\nG0 X15\n#1=#5420\nG50\nX#1"), "r 20 0 0; r 15 0 0");
  EXPECT_NE(refused("G51 P50").find("1:5: P50 of G51"), std::string::npos);
  EXPECT_NE(refused("G51.1 X0\nG92 X1").find("2:1: G92 under G51"), std::string::npos);
}

/// A contour on one side, mirrored, is the mirrored contour on the other side.
TEST(Frames, AMirrorChangesTheSideOfTheCutter) {
  const auto mirrored =
      moves_of("F500\nG0 X0 Y0\nG51.1 X0\nG42 D1 G1 X20 Y0\nX40\nG3 X50 Y10 J10\nG40 G1 X60 Y30");
  const auto by_hand =
      moves_of("F500\nG0 X0 Y0\nG41 D1 G1 X-20 Y0\nX-40\nG2 X-50 Y10 J10\nG40 G1 X-60 Y30");
  ASSERT_EQ(mirrored.size(), by_hand.size());
  for (std::size_t i = 0; i < mirrored.size(); ++i) {
    EXPECT_LE((mirrored[i].end - by_hand[i].end).norm(), 1e-12) << i;
    EXPECT_NEAR(mirrored[i].arc.sweep, by_hand[i].arc.sweep, 1e-9) << i;
  }
}

TEST(Frames, FurtherOffsets) {
  EXPECT_EQ(
      path_of("G10 L20 P3 X10 Y5\nG54.1 P3 G0 X1 Y1\n#7041=12\nG54.1 P3 X1\nG54 X#4130", fanuc()),
      "r 11 6 0; r 13 6 0; r 3 6 0");
  const ProgramFile file("G10 L20 P48 Y-7\nM30\n");
  GcodeInterpreter program(file.path(), Machine(), fanuc());
  while (!std::holds_alternative<ProgramEnd>(program.next())) {
  }
  InterpreterOptions next = fanuc();
  next.data = program.data();
  EXPECT_EQ(path_of("G54.1 P48 G0 Y0", next), "r 0 -7 0") << "kept";
  EXPECT_NE(to_text(next.data).find("G54.1 P48"), std::string::npos);
}

// --------------------------------------------------------------------------- places of errors

TEST(Errors, AlwaysNameLineAndColumn) {
  EXPECT_EQ(refused("G1 F9 X1\n  G38.2").substr(0, 5), "2:3: ");
  EXPECT_EQ(refused("o1 while [1]\no1 endwhile").substr(0, 5), "2:1: ");
  EXPECT_EQ(refused("o1 sub\n  o1 call\no1 endsub\no1 call").substr(0, 5), "2:3: ");
  EXPECT_EQ(refused("N10 o5 endif").substr(0, 5), "1:5: ");
  EXPECT_EQ(refused("N5 GOTO 5", fanuc()).substr(0, 5), "1:4: ");
  EXPECT_EQ(refused(std::string(5000, 'X')).substr(0, 8), "1:4097: ");
  EXPECT_EQ(refused("F9\nG41.1 D10 G1 X10 Y0\nX20\n Y1\nX19\nY-9\nG40 X40").substr(0, 5), "4:2: ");
}

// ------------------------------------------------------------------------- inputs and outputs

TEST(Inputs, AreOffSoThatWaitsForThemTimeOut) {
  const auto blocks = blocks_of("M66 P3 L3 Q1.5\nG0 X#5399\nM66 P3 L4 Q1\nX[#5399+7]\nM66 E1");
  ASSERT_EQ(blocks.size(), 3u);
  EXPECT_DOUBLE_EQ(std::get<Dwell>(blocks[0]).seconds, 1.5);
  EXPECT_NEAR(std::get<Move>(blocks[1]).end[kX], -1e-3, 1e-15);
  EXPECT_NEAR(std::get<Move>(blocks[2]).end[kX], 7e-3, 1e-15);
  for (const char* wrong : {"M66", "M66 P1 E1", "M66 P1 L1", "M66 E1 L1 Q1", "M66 P1 L9 Q1", "M62",
                            "M65 P1.5", "M67 Q1", "M68 E-1 Q1"})
    EXPECT_NE(refused(wrong), "accepted") << wrong;
}

// -------------------------------------------------------------------------------------- gouging

/// Down into a bulb through a neck 6 mm wide, and out again.
std::string neck(const std::string& diameter, const std::string& between = "") {
  return "F500\nG0 X-60 Y20\nG41.1 D" + diameter + " G1 X-40 Y0\nX0\nY-20\nX-17\n" + between +
         "Y-60\nX23\nY-20\nX6\nY0\nX40\nG40 X60 Y20";
}

TEST(Gouge, IsFoundBeyondNeighbours) {
  EXPECT_EQ(refused(neck("5.9")), "accepted");
  EXPECT_EQ(refused(neck("6")), "accepted");
  EXPECT_NE(refused(neck("6.02")).find("crosses what that of line"), std::string::npos);
  EXPECT_NE(refused(neck("8")).find("crosses what that of line"), std::string::npos);
  EXPECT_EQ(refused(neck("8", "Z5\n")), "accepted");  // above what stands, as far as one can know
}

TEST(Gouge, NeedsAWallOnTheToolsSide) {
  // Round a rib thinner than the tool, crossing the beginning at the end.
  EXPECT_EQ(refused("F500\nG0 X-20 Y-30\nG41.1 D8 G1 X0 Y-20\nY50\nX3\nY0\nX-20\nG40 X-40 Y-9"),
            "accepted");
  // A contour that crosses itself as it is programmed.
  EXPECT_EQ(refused("F500\nG0 X-20 Y-30\nG41.1 D8 G1 X0 Y-20\nY50\nX-60\nY0\nX20\nG40 X40"),
            "accepted");
}

}  // namespace
}  // namespace vcnc::features_test
