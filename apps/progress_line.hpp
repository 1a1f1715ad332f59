// One line on the terminal that is written over; nothing where stderr is not a terminal.
#pragma once

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
  bool shown_ = false;
  std::string text_;
};

}  // namespace vcnc
