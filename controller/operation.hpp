// What the operator does at the panel of the control while a program runs, as data.
//
// Text form, for command lines and files:  at WHEN WHAT
//   at 3.2 s feed 50 %      WHEN: seconds since the machine was switched on, or
//   at line 12 hold               line N: when this line of the program is commanded first
// WHAT is one of the table kOperations in controller/operation.cpp (docs/operating.md):
//   feed P %, rapid P %, hold, start, single on|off, optional-stop on|off, block-delete on|off
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bus/tick.hpp"

namespace vcnc {

struct Operation {
  enum class Kind { feed, rapid, hold, start, single_block, optional_stop, block_delete };
  Kind kind = Kind::feed;
  double value = 1;  ///< override, 1 is 100 %; of a switch 1 (on) or 0
  Tick at = 0;       ///< cycle
  int line = 0;      ///< instead: the line of the program; 0: none
  std::string text{};

  bool timed() const { return line == 0; }
};

inline constexpr double kLargestFeedOverride = 1.5, kLargestRapidOverride = 1;

/// Throws std::invalid_argument: one sentence with the word that is wrong and what is allowed.
Operation parse_operation(std::string_view text);

/// The switches as they stand.
struct PanelSwitches {
  double feed = 1, rapid = 1;  ///< overrides
  bool single_block = false, optional_stop = false, block_delete = false;
};

/// Does at every cycle what is due.
class OperatorPanel {
 public:
  explicit OperatorPanel(std::vector<Operation> operations);

  /// The operations due in cycle k, `line` being commanded, in the order in which they were given.
  const std::vector<Operation>& due(Tick k, int line);
  const PanelSwitches& switches() const { return switches_; }  ///< after those

  bool empty() const { return waiting_.empty() && due_.empty(); }
  bool start_to_come() const;              ///< cycle start will be pressed
  bool timed_to_come() const;              ///< something will be done whatever the axes do
  std::vector<std::string> never() const;  ///< what was not done yet, as it was written

 private:
  std::vector<Operation> waiting_, due_;
  PanelSwitches switches_;
};

}  // namespace vcnc
