// What is being done. On a terminal one line that is written over; elsewhere, so that long work
// does not look like none, a line now and then.
#pragma once

#include <string>

#include "bus/pacer.hpp"

namespace vcnc {

class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  void show(const std::string& text);
  void clear();

 private:
  bool terminal_;
  Pacer clock_;
  double told_s_ = 0;  ///< host time of the last line
  bool shown_ = false;
  std::string text_;
};

}  // namespace vcnc
