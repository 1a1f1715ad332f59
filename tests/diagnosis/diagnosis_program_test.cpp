#include "controller/diagnosis_program.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "configs/config.hpp"
#include "controller/player.hpp"
#include "diagnosis/records/stretches.hpp"
#include "tests/scratch.hpp"

namespace vcnc::diagnosis_program_test {
namespace {

Machine machine() {
  return load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml");
}

PieceParams ring() {
  PieceParams p;
  p.kind = PieceParams::Kind::ring;
  p.radius = 27.5e-3;
  return p;
}

ProgramOptions options() {
  ProgramOptions o;
  o.feed_mm_min = 2200;
  o.laps = 2;
  return o;
}

/// What the program commands, without running the machine.
Record commands_of(const std::string& text) {
  const TemporaryFile file("program.ngc", text);
  Player player(file.path(), machine());
  Record record;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    record.signals.push_back({SignalKind::command, i, std::string(kAxisNames[i]), {}, 0});
  for (int k = 0; k < 300000; ++k) {
    const PlayerStep step = player.step();
    for (std::size_t i = 0; i < kAxisCount; ++i)
      record.signals[i].value.push_back(step.position[i]);
    if (step.done) break;
  }
  return record;
}

TEST(DiagnosisProgram, ExcitesEveryAxisAndRepeatsMostOfIt) {
  const auto piece = make_piece(ring());
  const Record record = commands_of(diagnosis_program(machine(), piece.get(), options()));
  const double seconds = static_cast<double>(record.samples()) * record.period;
  EXPECT_GT(seconds, 60);
  EXPECT_LT(seconds, 150);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const std::vector<char> moves = moving(record, axis);
    EXPECT_GT(std::count(moves.begin(), moves.end(), true), 5000) << kAxisNames[axis];
  }
  std::map<int, int> repetitions;
  for (const Stretch& s : stretches_of(record))
    repetitions[s.condition] = std::max(repetitions[s.condition], s.repetition + 1);
  int repeated = 0;
  for (const auto& [condition, times] : repetitions) repeated += times >= 2;
  EXPECT_GE(repeated, 20);
}

/// Laps of 55 mm less the ball, plus the interference: 25 mm.
TEST(DiagnosisProgram, LapsFallBetweenPeriodsOfTheMains) {
  const auto piece = make_piece(ring());
  const std::string text = diagnosis_program(machine(), piece.get(), options());
  int checked = 0;
  for (std::size_t at = text.find("X25.00000 Y0.00000 I-25.00000"); at != text.npos;
       at = text.find("X25.00000 Y0.00000 I-25.00000", at + 1), ++checked) {
    const double feed = std::stod(text.substr(text.find(" F", at) + 2));
    const double periods = 50 * 60 * 2 * kPi * 25 / feed;
    EXPECT_NEAR(periods - std::floor(periods), 0.382, 1e-3);
  }
  EXPECT_EQ(checked, 2 * 7);  // three feeds both ways, and again
}

TEST(DiagnosisProgram, WithoutAPieceStaysInTheAir) {
  ProgramOptions o = options();
  o.radius_mm = 20;
  const Record record = commands_of(diagnosis_program(machine(), nullptr, o));
  EXPECT_GT(record.samples(), 30000u);
}

TEST(DiagnosisProgram, RefusesWhatItCannotUse) {
  const auto refusal = [](const PieceParams* params, const ProgramOptions& o) -> std::string {
    const std::unique_ptr<Piece> piece = params ? make_piece(*params) : nullptr;
    try {
      diagnosis_program(machine(), piece.get(), o);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  PieceParams sphere;
  sphere.kind = PieceParams::Kind::sphere;
  EXPECT_EQ(refusal(&sphere, options()),
            "piece: the program needs a ring that is probed inside, its axis along z");
  EXPECT_EQ(refusal(nullptr, options()), "radius_mm is needed without a ring");
  ProgramOptions once = options();
  once.laps = 1;
  const PieceParams good = ring();
  EXPECT_EQ(refusal(&good, once), "laps must be 2 to 100: one lap tells nothing of noise");
}

}  // namespace
}  // namespace vcnc::diagnosis_program_test
