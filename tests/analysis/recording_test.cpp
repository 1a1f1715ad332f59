#include "analysis/recording.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <bit>
#include <cstring>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>

#include "tests/scratch.hpp"

namespace vcnc::recording_test {
namespace {

TelemetryRow numbered(int k) {
  std::array<double, kRowWidth> values{};
  for (std::size_t i = 0; i < kRowWidth; ++i) values[i] = k + 1e-3 * static_cast<double>(i) / 3;
  auto row = std::bit_cast<TelemetryRow>(values);
  row.tick = k;
  return row;
}

bool same_bits(const TelemetryRow& a, const TelemetryRow& b) {
  return std::memcmp(&a, &b, sizeof(a)) == 0;
}

const RunBegin kBegin{"run-42", "part.nc", "name = \"m\"\n", "name = \"p\"\n",
                      18446744073709551615u};

RunEnd complete_end() {
  RunEnd end{true, "program end", 2500, "ab12", 1.25, 0.8125, 3};
  return end;
}

void expect_rows(const RecordingReader& reader, std::size_t count) {
  ASSERT_EQ(reader.rows(), count);
  int k = 0;
  reader.for_each([&](const TelemetryRow& row) {
    ASSERT_TRUE(same_bits(row, numbered(k))) << k;
    ++k;
  });
  EXPECT_EQ(static_cast<std::size_t>(k), count);
}

std::string message_of(const std::filesystem::path& path) {
  try {
    RecordingReader reader(path);
  } catch (const RecordingError& e) {
    return e.what();
  }
  return "";
}

TEST(Recording, ReadsBackEveryBit) {
  const Scratch dir;
  {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0; k < 1500; ++k) writer.row(numbered(k));
    writer.alarm({1499, 7305, "probe", "overtravel: Δ = 2.1 mm"});
    for (int k = 1500; k < 2500; ++k) writer.row(numbered(k));
    writer.finish(complete_end());
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "recording.h5.partial"));
  const RecordingReader reader(dir.path());
  expect_rows(reader, 2500);
  EXPECT_TRUE(reader.missing().empty());
  EXPECT_EQ(reader.begin().run_id, kBegin.run_id);
  EXPECT_EQ(reader.begin().program_name, kBegin.program_name);
  EXPECT_EQ(reader.begin().declared_toml, kBegin.declared_toml);
  EXPECT_EQ(reader.begin().piece_toml, kBegin.piece_toml);
  EXPECT_EQ(reader.begin().seed, kBegin.seed);
  const RunEnd end = complete_end();
  EXPECT_TRUE(reader.end().complete);
  EXPECT_EQ(reader.end().reason, end.reason);
  EXPECT_EQ(reader.end().cycles, end.cycles);
  EXPECT_EQ(reader.end().trace_hash, end.trace_hash);
  EXPECT_EQ(reader.end().wall_seconds, end.wall_seconds);
  EXPECT_EQ(reader.end().bus_load_worst, end.bus_load_worst);
  EXPECT_EQ(reader.end().gaps, end.gaps);
  ASSERT_EQ(reader.alarms().size(), 1u);
  EXPECT_EQ(reader.alarms()[0].tick, 1499);
  EXPECT_EQ(reader.alarms()[0].code, 7305);
  EXPECT_EQ(reader.alarms()[0].source, "probe");
  EXPECT_EQ(reader.alarms()[0].text, "overtravel: Δ = 2.1 mm");
}

TEST(Recording, KilledWriterLeavesAReadableFile) {
  const Scratch dir;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0; k < 3700; ++k) writer.row(numbered(k));
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(std::filesystem::exists(dir / "recording.h5"));
  const RecordingReader reader(dir.path());
  expect_rows(reader, 3000);  // up to the last whole block
  ASSERT_EQ(reader.missing().size(), 1u);
  EXPECT_EQ(reader.missing()[0], "end of the run");
  EXPECT_FALSE(reader.end().complete);
  EXPECT_EQ(reader.end().reason, "interrupted");
}

/// Writes until it is killed, which is when it has begun row `last` or soon after: the block it is
/// in may be anywhere on its way to the file. Every 700th row brings an alarm.
int rows_begun_by_a_writer_killed_at(const Scratch& dir, int last) {
  void* shared =
      ::mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto* row = static_cast<std::atomic<int>*>(shared);
  const pid_t child = fork();
  if (child == 0) {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0;; ++k) {
      row->store(k, std::memory_order_release);
      if (k % 700 == 699) writer.alarm({k, 1003, "probe", "out of range"});
      writer.row(numbered(k));
    }
  }
  while (row->load(std::memory_order_acquire) < last) {
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const int begun = row->load();
  ::munmap(shared, sizeof(int));
  return begun;
}

// At 200 seeded places, in the midst of whatever the writer does there: the recording opens, its
// rows are a beginning of what was written and lack at most the block being written, and what is
// missing is said, also in the summary.
TEST(Recording, AWriterKilledAnywhereLeavesAReadableFile) {
  std::mt19937 random(200);
  for (int i = 0; i < 200; ++i) {
    const Scratch dir;
    const int last = 1 + static_cast<int>(random() % 3000);
    const int begun = rows_begun_by_a_writer_killed_at(dir, last);
    SCOPED_TRACE("killed in row " + std::to_string(begun));
    const std::unique_ptr<RecordingReader> reader = [&]() -> std::unique_ptr<RecordingReader> {
      try {
        return std::make_unique<RecordingReader>(dir.path());
      } catch (const RecordingError& e) {
        ADD_FAILURE() << e.what();
        return nullptr;
      }
    }();
    if (!reader) continue;
    EXPECT_LE(reader->rows(), static_cast<std::uint64_t>(begun) + 1);
    EXPECT_GE(reader->rows() + 1000, static_cast<std::uint64_t>(begun));
    int k = 0;
    reader->for_each([&](const TelemetryRow& row) { ASSERT_TRUE(same_bits(row, numbered(k++))); });
    EXPECT_EQ(reader->missing(), std::vector<std::string>{"end of the run"});
    for (const Alarm& alarm : reader->alarms()) EXPECT_LE(alarm.tick, begun);
  }
}

// A file whose tail the disk never got: it opens and says what is missing, or is refused in one
// sentence that names it.
TEST(Recording, AFileCutOffAnywhereOpensOrSaysWhy) {
  const Scratch dir;
  {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0; k < 2345; ++k) writer.row(numbered(k));
    writer.finish(complete_end());
  }
  std::ifstream in(dir / "recording.h5", std::ios::binary);
  const std::string whole(std::istreambuf_iterator<char>(in), {});
  std::mt19937 random(7);
  int opened = 0;
  for (int i = 0; i < 200; ++i) {
    const std::string path = dir / "cut.h5";
    const std::size_t size = i == 0 ? whole.size() - 32 : random() % whole.size();
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    try {
      const RecordingReader reader(path);
      ++opened;
      EXPECT_FALSE(reader.missing().empty()) << "at least the seal";
    } catch (const RecordingError& e) {
      EXPECT_NE(std::string(e.what()).find("cut.h5: "), std::string::npos) << e.what();
    }
  }
  EXPECT_GE(opened, 1);
}

TEST(Recording, DestructorWithoutFinishKeepsAllRows) {
  const Scratch dir;
  {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0; k < 1234; ++k) writer.row(numbered(k));
  }
  expect_rows(RecordingReader(dir / "recording.h5"), 1234);
}

TEST(Recording, RefusesWhatIsNotARecording) {
  const Scratch dir;
  EXPECT_NE(message_of(dir / "none.h5").find("none.h5: no such file"), std::string::npos);
  EXPECT_NE(message_of(dir.path()).find("holds no recording.h5"), std::string::npos);
  std::ofstream(dir / "text.h5") << "hello";
  EXPECT_NE(message_of(dir / "text.h5").find("not an HDF5 file"), std::string::npos);
  std::ofstream(dir / "empty.h5");
  EXPECT_NE(message_of(dir / "empty.h5").find("not an HDF5 file"), std::string::npos);
}

TEST(Recording, CannotBeCreatedInAMissingFolder) {
  const Scratch dir;
  try {
    RecordingWriter writer(dir / "none/recording.h5", kBegin);
    FAIL() << "no exception";
  } catch (const RecordingError& e) {
    EXPECT_NE(std::string(e.what()).find("cannot be created"), std::string::npos) << e.what();
  }
}

// A file size limit stands for the full disk; in a child because the limit cannot be taken back.
TEST(Recording, FullDiskIsOneClearErrorAndTheFileStaysReadable) {
  const Scratch dir;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{2'000'000, 2'000'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      RecordingWriter writer(dir / "recording.h5", kBegin);
      for (int k = 0; k < 20000; ++k) writer.row(numbered(k));
    } catch (const RecordingError& e) {
      const std::string text = e.what();
      code = text.find("cannot be written: File too large") != std::string::npos ? 0 : 2;
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_FALSE(std::filesystem::exists(dir / "recording.h5"));
  const RecordingReader reader(dir.path());
  EXPECT_GE(reader.rows(), 5000u);
  expect_rows(reader, reader.rows());
}

TEST(Recording, CsvHoldsEveryNumberExactly) {
  const Scratch dir;
  {
    RecordingWriter writer(dir / "recording.h5", kBegin);
    for (int k = 0; k < 3; ++k) writer.row(numbered(k));
    writer.finish(complete_end());
  }
  write_csv(RecordingReader(dir.path()), dir / "rows.csv");
  std::ifstream csv(dir / "rows.csv");
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line.substr(0, 40), "tick [ms],line [1],state [1],feed [m/s],");
  EXPECT_NE(line.find("q_cmd.A [rad],"), std::string::npos);
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(std::getline(csv, line));
    const auto expected = std::bit_cast<std::array<double, kRowWidth>>(numbered(k));
    std::istringstream fields(line);
    std::string field;
    for (std::size_t i = 0; i < kRowWidth; ++i) {
      ASSERT_TRUE(std::getline(fields, field, ','));
      EXPECT_EQ(std::stod(field), expected[i]);
    }
  }
  EXPECT_FALSE(std::getline(csv, line));
}

}  // namespace
}  // namespace vcnc::recording_test
