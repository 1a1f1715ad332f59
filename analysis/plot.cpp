#include "analysis/plot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

extern char** environ;

namespace vcnc {
namespace {

struct FileClose {
  void operator()(FILE* f) const { fclose(f); }
};
using File = std::unique_ptr<FILE, FileClose>;

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 65536> part;
  while (true) {
    const ssize_t n = read(descriptor, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(part.data(), static_cast<std::size_t>(n));
  }
}

/// Starts gnuplot with the script as its input; the errno value, 0 if it runs.
int start(int input, int output, pid_t& child) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", 1, 0);
  std::string name = "gnuplot", plain = "-d";  // -d: without the user's own settings
  char* arguments[] = {name.data(), plain.data(), nullptr};
  const int error = posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

}  // namespace

std::optional<std::string> draw_svg(const std::string& script, std::string& why) {
  // The script goes through an unnamed file: with two pipes both sides could wait for each other.
  const File input(tmpfile());
  int pipe_ends[2];
  if (!input || fwrite(script.data(), 1, script.size(), input.get()) != script.size() ||
      fflush(input.get()) != 0 || pipe2(pipe_ends, O_CLOEXEC) != 0) {
    why = std::string("No figures: ") + std::strerror(errno) + ".";
    return std::nullopt;
  }
  rewind(input.get());
  pid_t child = 0;
  const int error = start(fileno(input.get()), pipe_ends[1], child);
  close(pipe_ends[1]);
  std::string svg;
  int status = 0;
  if (error == 0) {
    svg = read_all(pipe_ends[0]);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  close(pipe_ends[0]);
  const auto begin = svg.find("<svg");
  if (error == 0 && status == 0 && begin != std::string::npos) {
    svg.erase(0, begin);
    // Browsers show it as a tool tip.
    if (const auto title = svg.find("<title>Gnuplot</title>"); title != std::string::npos)
      svg.erase(title, std::strlen("<title>Gnuplot</title>"));
    return svg;
  }
  why = error == ENOENT || (WIFEXITED(status) && WEXITSTATUS(status) == 127)
            ? "No figures: gnuplot is not installed (Debian package gnuplot-nox)."
            : "No figures: gnuplot failed.";
  return std::nullopt;
}

}  // namespace vcnc
