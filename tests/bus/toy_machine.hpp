// A small machine for tests of the bus: nodes whose answers depend on everything they have heard,
// so that any frame that is missing, late or out of order changes the trace hash.
#pragma once

#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus/barrier.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"

namespace vcnc::toy {

inline std::uint64_t mix(std::uint64_t state, std::uint64_t value) {
  state ^= value + 0x9e3779b97f4a7c15ULL + (state << 6) + (state >> 2);
  return state * 0xbf58476d1ce4e5b9ULL;
}

inline std::uint64_t mix(std::uint64_t state, const Frame& frame) {
  state = mix(state, frame.id);
  for (const std::uint8_t byte : frame.payload()) state = mix(state, byte);
  return state;
}

inline std::string toy_name(int id) { return std::string("toy ").append(std::to_string(id)); }

/// Answers with a digest of all frames it has accepted so far; now and then with an EMCY as well.
class ToyNode : public Node {
 public:
  explicit ToyNode(int id) : id_(id), name_(toy_name(id)) {}

  int id() const override { return id_; }
  std::string_view name() const override { return name_; }
  bool accepts(std::uint16_t id) const override {
    return id == kCommandId || (id > kStatusBase && id < kStatusBase + 128) ||
           (id > kEmcyBase && id < kEmcyBase + 128);
  }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    if (before_step) before_step(k);
    ticks.push_back(k);
    state_ = mix(state_, static_cast<std::uint64_t>(k));
    for (const Frame& frame : inputs) state_ = mix(state_, frame);
    Frame answer;
    answer.id = static_cast<std::uint16_t>(kStatusBase + id_);
    answer.len = 16;
    answer.fd = true;
    for (std::size_t i = 0; i < 16; ++i)
      answer.data[i] = static_cast<std::uint8_t>(state_ >> (4 * i));
    out.push_back(answer);
    if (state_ % 7 == 0)
      out.push_back(encode(Emergency{.node = id_, .code = static_cast<std::uint16_t>(state_)}));
  }

  std::function<void(Tick)> before_step;
  std::vector<Tick> ticks;

 private:
  int id_;
  std::string name_;
  std::uint64_t state_ = 1;
};

/// Commands with a digest of all answers; ends after `cycles`.
class ToyMaster : public Master {
 public:
  explicit ToyMaster(Tick cycles) : cycles_(cycles) {}
  bool step(Tick k, std::span<const Frame> answers, Frames& out) override {
    for (const Frame& frame : answers) state_ = mix(state_, frame);
    frames += answers.size();
    Frame command;
    command.id = kCommandId;
    command.len = 64;
    command.fd = true;
    for (std::size_t i = 0; i < 64; ++i)
      command.data[i] = static_cast<std::uint8_t>(state_ >> (i % 56));
    out.push_back(command);
    return k + 1 < cycles_;
  }
  void cycle_load(double share) override { last_load = share; }

  double last_load = -1;
  std::size_t frames = 0;

 private:
  Tick cycles_;
  std::uint64_t state_ = 2;
};

inline Roster roster(int nodes) {
  Roster all;
  for (int id = 1; id <= nodes; ++id) all.push_back({id, toy_name(id)});
  return all;
}

inline std::vector<std::unique_ptr<ToyNode>> make_nodes(int count) {
  std::vector<std::unique_ptr<ToyNode>> nodes;
  for (int id = 1; id <= count; ++id) nodes.push_back(std::make_unique<ToyNode>(id));
  return nodes;
}

inline std::vector<Node*> pointers(const std::vector<std::unique_ptr<ToyNode>>& nodes) {
  std::vector<Node*> all;
  for (const auto& node : nodes) all.push_back(node.get());
  return all;
}

/// Numbers that depend on the seed only.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  /// In -1..1.
  double unit() { return static_cast<double>(static_cast<std::int64_t>(next())) * 0x1p-63; }

 private:
  std::uint64_t state_;
};

/// Runs `body` in a child process, which ends with the code that it returns.
class ChildProcess {
 public:
  explicit ChildProcess(const std::function<int()>& body) : pid_(::fork()) {
    if (pid_ == 0) {
      int code = 99;
      try {
        code = body();
      } catch (...) {
      }
      ::_exit(code);
    }
  }
  ~ChildProcess() {
    if (pid_ > 0) {
      kill(SIGKILL);
      wait();
    }
  }
  ChildProcess(ChildProcess&& other) noexcept : pid_(std::exchange(other.pid_, -1)) {}
  void kill(int signal) const { ::kill(pid_, signal); }
  /// Exit code, or 128 + signal.
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  pid_t pid_;
};

}  // namespace vcnc::toy
