// The lines of a program that steer its flow, with what belongs together.
//
//   NGC      Olabel sub .. endsub, return, call; if .. elseif .. else .. endif;
//            while .. endwhile; do .. while; repeat .. endrepeat; break, continue.
//            label: 100 or <name>
//   Fanuc    WHILE [..] DO m .. END m, DO m .. END m
//   Siemens  IF .. ELSE .. ENDIF, WHILE .. ENDWHILE, FOR .. ENDFOR, REPEAT .. UNTIL,
//            LOOP .. ENDLOOP; no others then
//   both     Onumber alone or :number: the head of a program that M98 and G65 can call
//
// Made in one pass before the program runs; holds these lines only, so that a program without them
// takes no memory however long it is. What has no partner is refused then.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "controller/gcode/program_text.hpp"

namespace vcnc {

struct FlowLine {
  enum class Kind {
    sub,
    end_sub,
    give_back,
    call,
    when,
    else_when,
    otherwise,
    end_when,
    loop_while,
    end_while,
    loop_do,
    while_after,
    repeat,
    end_repeat,
    leave,
    go_on,
    program,
    macro_while,
    macro_do,
    macro_end,
    loop_for,
    end_for,
    loop_until,
    until,
    loop_ever,
    end_ever
  };
  Kind kind = Kind::program;
  ProgramPlace place{}, after{};  ///< of the line, of the one behind it
  int column = 1;                 ///< of its word
  std::string label{};            ///< empty where it has to be computed (call) and for Siemens
  int next = -1;  ///< if: the next branch; begin and end of a loop or sub: each other; break,
                  ///< continue: the begin of their loop
  int end = -1;   ///< if and its branches: the endif
};

class FlowIndex {
 public:
  static constexpr std::size_t kMostLines = 1'000'000;

  /// Reads the whole text and goes back to its begin. Throws ProgramError.
  explicit FlowIndex(ProgramText& text, bool siemens = false);

  bool empty() const { return lines_.empty(); }
  bool macros() const { return macros_; }  ///< IF, WHILE or GOTO of Fanuc were seen
  const FlowLine& line(int i) const { return lines_[static_cast<std::size_t>(i)]; }
  int at(const ProgramPlace& place) const;       ///< the one at this place, or -1
  int sub(const std::string& label) const;       ///< or -1
  int program(const std::string& number) const;  ///< or -1

 private:
  void enter(FlowLine line, const std::string& path);
  void open(int i) { open_.push_back(i); }
  int close(const FlowLine& line, const std::string& path,
            std::initializer_list<FlowLine::Kind> by);

  std::vector<FlowLine> lines_;
  std::map<std::string, int> subs_, programs_;
  std::vector<int> open_;  ///< while reading
  bool macros_ = false;
};

/// Name of a kind as it is written.
const char* flow_word(FlowLine::Kind kind);

}  // namespace vcnc
