// A recording that was damaged: it opens and can be read, or is refused in one sentence.
#include <fcntl.h>
#include <pthread.h>

#include "analysis/recording.hpp"
#include "fuzz.hpp"

#ifdef __clang__
#include <sanitizer/common_interface_defs.h>
#endif

namespace {

// The reader tries files without a seal in a child; one that dies there is an answer, no finding.
void be_a_quiet_child() {
#ifdef __clang__
  __sanitizer_set_death_callback(nullptr);
#endif
  const int null = open("/dev/null", O_WRONLY);
  dup2(null, STDERR_FILENO);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  static const bool once = pthread_atfork(nullptr, nullptr, be_a_quiet_child) == 0;
  fuzz::require(once);
  static fuzz::MemoryFile file;
  file.hold(fuzz::text_of(data, size));
  try {
    const RecordingReader reader(file.path());
    std::uint64_t rows = 0;
    reader.for_each([&](const TelemetryRow&) { ++rows; });
    fuzz::require(rows == reader.rows());
  } catch (const RecordingError&) {
  }
  return 0;
}
