// What is being done. On a terminal one line that is written over; elsewhere, so that long work
// does not look like none, a line now and then.
#pragma once

#include <chrono>
#include <string>

namespace vcnc {

class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  void show(const std::string& text);
  void clear();

 private:
  bool terminal_;
  std::chrono::steady_clock::time_point begun_, told_;
  bool shown_ = false;
  std::string text_;
};

}  // namespace vcnc
