// The lines of text a process sends to the one that launched it: "ready", then "progress ...",
// for people and to be kept "note ...", and "struck ..." for a fault that has had an effect.
#pragma once

#include <string>
#include <string_view>

namespace vcnc {

class ControlPipe {
 public:
  /// `fd` is inherited from the launcher; -1: nobody listens.
  explicit ControlPipe(int fd) : fd_(fd) {}

  void ready() const { line("ready"); }
  void progress(std::string_view text) const { line(std::string("progress ") + std::string(text)); }
  void struck(std::string_view fault) const { line(std::string("struck ") + std::string(fault)); }
  void note(std::string_view text) const { line(std::string("note ") + std::string(text)); }

 private:
  void line(std::string text) const;
  int fd_;
};

}  // namespace vcnc
