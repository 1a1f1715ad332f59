#include "apps/launcher.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace vcnc {

namespace {

std::string system_error(const std::string& what) { return what + ": " + std::strerror(errno); }

std::string read_words(int fd) {
  std::string text(
      static_cast<std::size_t>(std::clamp<off_t>(::lseek(fd, 0, SEEK_END), 0, 1 << 16)), '\0');
  const ssize_t got = ::pread(fd, text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

}  // namespace

std::string Exited::sentence() const {
  return last_words.empty() ? fmt::format("{}: {}", name, how)
                            : fmt::format("{}: {}: {}", name, how, last_words);
}

std::string program_directory() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
}

void Launcher::start(const std::string& name, std::vector<std::string> argv) {
  int pipe_ends[2];
  if (::pipe2(pipe_ends, O_CLOEXEC) != 0) throw LaunchError(system_error(name + ": pipe"));
  Child child{.name = name, .control = pipe_ends[0], .argv = argv};
  child.words = ::memfd_create(name.c_str(), MFD_CLOEXEC);
  if (child.words < 0) throw LaunchError(system_error(name + ": memory file"));
  argv.push_back("--control-fd");
  argv.push_back(std::to_string(pipe_ends[1]));
  std::vector<char*> arguments;
  for (std::string& a : argv) arguments.push_back(a.data());
  arguments.push_back(nullptr);

  // The child must not meet a signal with this program's handlers.
  sigset_t all, before;
  ::sigfillset(&all);
  ::sigprocmask(SIG_BLOCK, &all, &before);
  const pid_t parent = ::getpid();
  child.pid = ::fork();
  if (child.pid != 0) ::sigprocmask(SIG_SETMASK, &before, nullptr);
  if (child.pid < 0) throw LaunchError(system_error(name + ": fork"));
  if (child.pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::setpgid(0, 0);  // Ctrl-C goes to the launcher, which ends the run in order
    ::signal(SIGINT, SIG_DFL);
    ::signal(SIGTERM, SIG_DFL);
    ::signal(SIGXFSZ, SIG_IGN);  // a file at its limit is an error of write, as a full disk is
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::fcntl(pipe_ends[1], F_SETFD, 0);
    ::dup2(child.words, STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::dprintf(STDERR_FILENO, "cannot be started: %s: %s", arguments[0], std::strerror(errno));
    ::_exit(127);
  }
  ::close(pipe_ends[1]);
  children_.push_back(std::move(child));
}

bool Launcher::read_lines(Child& child, const OnProgress& on_progress) {
  char buffer[4096];
  const ssize_t got = ::read(child.control, buffer, sizeof buffer);
  if (got < 0 && errno == EINTR) return true;
  if (got <= 0) return false;
  child.partial_line.append(buffer, static_cast<std::size_t>(got));
  std::size_t end;
  while ((end = child.partial_line.find('\n')) != std::string::npos) {
    const std::string line = child.partial_line.substr(0, end);
    child.partial_line.erase(0, end + 1);
    if (line == "ready") child.ready = true;
    if (line.starts_with("note ")) child.notes.push_back(line.substr(5));
    if (line.starts_with("struck ")) child.struck.push_back(line.substr(7));
    if (line.starts_with("progress ") && on_progress) on_progress(line.substr(9));
  }
  return true;
}

Exited Launcher::reap(std::size_t index) {
  Child child = std::move(children_[index]);
  children_.erase(children_.begin() + static_cast<std::ptrdiff_t>(index));
  int status = 0;
  while (::waitpid(child.pid, &status, 0) < 0 && errno == EINTR) {
  }
  Exited exited{.name = child.name,
                .last_words = read_words(child.words),
                .notes = child.notes,
                .struck = child.struck};
  if (WIFSIGNALED(status)) {
    exited.code = 128 + WTERMSIG(status);
    exited.how =
        fmt::format("killed by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  } else {
    exited.code = WEXITSTATUS(status);
    exited.how = fmt::format("exit code {}", exited.code);
  }
  ::close(child.control);
  ::close(child.words);
  if (child.again) {
    exited.how += ", started again";
    start(child.name, child.argv);
  }
  return exited;
}

std::optional<Exited> Launcher::next(int timeout_ms, const OnProgress& on_progress) {
  std::vector<pollfd> fds;
  for (const Child& child : children_) fds.push_back({child.control, POLLIN, 0});
  if (::poll(fds.data(), fds.size(), timeout_ms) <= 0) return std::nullopt;  // time-out or a signal
  for (std::size_t i = 0; i < fds.size(); ++i)
    if (fds[i].revents != 0 && !read_lines(children_[i], on_progress)) return reap(i);
  return std::nullopt;
}

void Launcher::wait_all_ready(int timeout_ms, const std::function<void()>& meanwhile) {
  const int step = meanwhile ? 5 : 50;
  for (int waited = 0;; waited += step) {
    if (meanwhile) meanwhile();
    // A burst of messages ends a step early, so the time-out is a lower bound on the patience.
    while (auto exited = next(0, nullptr)) throw LaunchError(exited->sentence());
    const auto silent =
        std::find_if(children_.begin(), children_.end(), [](const Child& c) { return !c.ready; });
    if (silent == children_.end()) return;
    if (waited >= timeout_ms)
      throw LaunchError(
          fmt::format("{}: not ready after {:.0f} s", silent->name, timeout_ms / 1000.0));
    if (auto exited = next(step, nullptr)) throw LaunchError(exited->sentence());
  }
}

void Launcher::signal(const std::string& name, int signal_number) {
  for (const Child& child : children_)
    if (child.name == name) ::kill(child.pid, signal_number);
}

void Launcher::restart(const std::string& name) {
  for (Child& child : children_)
    if (child.name == name) child.again = true;
  signal(name, SIGKILL);
}

void Launcher::limit_files(const std::string& name, std::uintmax_t bytes) {
  const rlimit limit{bytes, bytes};
  for (const Child& child : children_)
    if (child.name == name) ::prlimit(child.pid, RLIMIT_FSIZE, &limit, nullptr);
}

bool Launcher::stopped(const Child& child) {
  std::ifstream in(fmt::format("/proc/{}/stat", child.pid));
  std::string stat;
  std::getline(in, stat);
  const std::size_t state = stat.rfind(") ");  // after the name, which may hold anything
  return state != std::string::npos && stat[state + 2] == 'T';
}

bool Launcher::stopped(const std::string& name) const {
  return std::any_of(children_.begin(), children_.end(),
                     [&](const Child& c) { return c.name == name && stopped(c); });
}

void Launcher::kill_stopped(const std::string& but) {
  for (const Child& child : children_)
    if (child.name != but && stopped(child)) ::kill(child.pid, SIGKILL);
}

bool Launcher::running(const std::string& name) const {
  return std::any_of(children_.begin(), children_.end(),
                     [&](const Child& c) { return c.name == name; });
}

std::string Launcher::names() const {
  std::string all;
  for (const Child& child : children_) all += (all.empty() ? "" : ", ") + child.name;
  return all;
}

void Launcher::kill_all() {
  for (Child& child : children_) {
    child.again = false;
    ::kill(child.pid, SIGKILL);
  }
  while (!children_.empty()) reap(0);
}

}  // namespace vcnc
