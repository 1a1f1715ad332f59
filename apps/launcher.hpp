// Starts the programs of a machine, listens to them, and leaves none behind.
//
// Each child gets a control pipe (apps/control_pipe.hpp) and its stderr is kept in memory, so that
// when one fails the message can say which, how and its last words. Children are killed when the
// launcher dies, however it dies.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace vcnc {

/// A process that could not be started or failed: names it and says how.
class LaunchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A process that ended.
struct Exited {
  std::string name;
  int code = 0;                       ///< exit code, or 128 + signal
  std::string how{};                  ///< "exit code 1", "killed by signal 9 (Killed)"
  std::string last_words{};           ///< what it wrote to stderr, without the trailing newline
  std::vector<std::string> notes{};   ///< what it told the launcher to keep
  std::vector<std::string> struck{};  ///< faults that it says have had an effect

  std::string sentence() const;  ///< "drive X: killed by signal 9 (Killed): last words"
};

class Launcher {
 public:
  using OnProgress = std::function<void(const std::string&)>;

  Launcher() = default;
  ~Launcher() { kill_all(); }
  Launcher(const Launcher&) = delete;
  Launcher& operator=(const Launcher&) = delete;

  /// Starts a program; "--control-fd N" is appended to its arguments.
  void start(const std::string& name, std::vector<std::string> argv);

  /// Waits until every started process said that it is ready. Throws LaunchError naming the one
  /// that ended or stayed silent. `meanwhile` is called every few milliseconds, if given.
  void wait_all_ready(int timeout_ms, const std::function<void()>& meanwhile = nullptr);

  /// Waits up to timeout_ms for something to happen; gives an exit if there was one.
  std::optional<Exited> next(int timeout_ms, const OnProgress& on_progress);

  void signal(const std::string& name, int signal_number);
  /// Kills it; when next() gives its exit, it has been started again as before.
  void restart(const std::string& name);
  /// From now on its writes beyond this size of a file fail, as on a full disk.
  void limit_files(const std::string& name, std::uintmax_t bytes);
  /// Kills those that are stopped (SIGSTOP) and would not end by themselves, but for one.
  void kill_stopped(const std::string& but);
  bool stopped(const std::string& name) const;  ///< by SIGSTOP
  bool running(const std::string& name) const;
  std::size_t running() const { return children_.size(); }
  std::string names() const;  ///< of all that run
  void kill_all();

 private:
  struct Child {
    std::string name;
    pid_t pid = -1;
    int control = -1;
    int words = -1;  ///< memory file behind its stderr
    bool ready = false;
    std::string partial_line{};
    std::vector<std::string> notes{};
    std::vector<std::string> struck{};
    std::vector<std::string> argv{};
    bool again = false;  ///< start it anew when it has ended
  };
  static bool stopped(const Child& child);
  Exited reap(std::size_t index);
  bool read_lines(Child& child, const OnProgress& on_progress);  ///< false at end of file

  std::vector<Child> children_;
};

/// Directory of the running program, where its siblings are.
std::string program_directory();

}  // namespace vcnc
