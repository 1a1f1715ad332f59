#include "analysis/tried_read.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <string_view>

#include "analysis/recording.hpp"

namespace vcnc {

void try_in_child(const std::filesystem::path& path, const char* died,
                  const std::function<void()>& read) {
  // HDF5 may also run for ever; a sound file takes a hundredth of this.
  constexpr rlim_t kShortest = 1, kBytesPerSecond = 10'000'000;
  std::error_code unknown;
  const rlim_t seconds = kShortest + std::filesystem::file_size(path, unknown) / kBytesPerSecond;
  std::array<int, 2> answer{-1, -1};  // the sentence, where the file is refused
  const pid_t child = pipe2(answer.data(), O_CLOEXEC) == 0 ? fork() : -1;
  if (child == 0) {
    for (const int deadly : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(deadly, SIG_DFL);
    const rlimit none{0, 0}, time{seconds, seconds};
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_CPU, &time);
    try {
      read();
    } catch (const RecordingError& e) {
      const std::string_view text = e.what();
      if (::write(answer[1], text.data(), text.size()) < 0) _exit(1);
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  close(answer[1]);
  std::string refusal;
  std::array<char, 512> part{};
  for (ssize_t got; child > 0 && (got = ::read(answer[0], part.data(), part.size())) != 0;)
    if (got > 0)
      refusal.append(part.data(), static_cast<std::size_t>(got));
    else if (errno != EINTR)
      break;
  close(answer[0]);
  if (child < 0) throw RecordingError(path.string() + ": no process to check the file in");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw RecordingError(path.string() + ": " + died);
  if (!refusal.empty()) throw RecordingError(refusal);
}

}  // namespace vcnc
