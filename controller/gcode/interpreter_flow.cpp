// The part of the interpreter that leaves the order of the lines: O words, macros, jumps, calls.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kDeepestCall = 50;
constexpr std::size_t kMostFiles = 64;
constexpr long kMostRepeats = 1'000'000;
constexpr int kMostArguments = 30;

/// Local variable of an argument letter of G65 (Fanuc, argument specification I).
int local_of(char letter) {
  constexpr std::array<int, 26> locals{1, 2, 3, 7,  8,  9,  0,  11, 4,  5,  6,  0,  13,
                                       0, 0, 0, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26};
  return locals[static_cast<std::size_t>(letter - 'A')];
}

}  // namespace

double ProgramRun::condition(Cursor& at) {
  at.skip_blanks();
  const double x = siemens_dialect_ ? evaluator_.bare(at) : evaluator_.bracketed(at);
  return std::isnan(x) ? 0 : x;
}

void ProgramRun::count_pass() {
  if (++passes_ > GcodeInterpreter::kMostPasses)
    fail(fmt::format("more than {} passes of loops, calls and jumps; does the program end?",
                     GcodeInterpreter::kMostPasses));
}

void ProgramRun::go_to(const ProgramPlace& place) { unit().text.go_to(place); }

/// Acts on a line of the flow index.
void ProgramRun::steer(int i, Cursor at) {
  const FlowIndex& flow = unit().flow;
  const FlowLine& line = flow.line(i);
  skip_number(at);
  if (at.column() > 1 && options_.block_delete &&
      line_.find('/') < static_cast<std::size_t>(at.column()))
    return;
  std::string label = line.label;
  if (siemens_dialect_) {
    at.advance(at.letters().size());
  } else if (line.kind < Flow::program) {
    at.advance();  // O
    at.skip_blanks();
    if (!label.empty()) {
      if (at.peek() == '<')
        take_name(at);
      else
        while (is_digit(at.peek())) at.advance();
    } else {
      const double number = evaluator_.value(at);
      if (whole_number(number) < 0) fail("the label computed is no whole number", 1);
      label = std::to_string(whole_number(number));
    }
    at.skip_blanks();
    at.advance(at.letters().size());
  } else {
    at.advance(at.letters().size());
  }
  const auto after = [&](int index) { go_to(flow.line(index).after); };
  const auto nothing_more = [&] {
    for (at.skip_blanks(); !at.at_end(); at.skip_blanks()) {
      if (at.peek() == ';') return;
      if (at.peek() != '(') fail("only a comment may follow here", at.column());
      at.take_comment();
    }
  };
  switch (line.kind) {
    case Flow::sub:
      after(line.next);
      break;
    case Flow::end_sub:
    case Flow::give_back:
      return_from_sub(at, true);
      break;
    case Flow::call:
      call_sub(label, at);
      break;
    case Flow::when:
      for (int branch = i;;) {
        const bool yes = condition(at) != 0;
        if (siemens_dialect_) nothing_more();
        if (yes) {
          if (branch != i) after(branch);
          nothing_more();
          break;
        }
        branch = flow.line(branch).next;
        const FlowLine& next = flow.line(branch);
        if (next.kind != Flow::else_when) {
          after(branch);
          break;
        }
        // The condition of the elseif stands in its line.
        go_to(next.place);
        unit().text.next(line_);
        at = Cursor(line_);
        while (!at.at_end() && at.peek() != '[') at.advance();
      }
      break;
    case Flow::else_when:
    case Flow::otherwise:
      after(line.end);
      break;
    case Flow::end_when:
    case Flow::loop_do:
    case Flow::macro_do:
    case Flow::loop_until:
    case Flow::loop_ever:
      nothing_more();
      break;
    case Flow::loop_while: {
      const bool yes = condition(at) != 0;
      if (siemens_dialect_) nothing_more();
      if (!yes) after(line.next);
      break;
    }
    case Flow::loop_for: {
      const int variable = siemens_loop_variable(at);
      if (!at.take('=')) fail("FOR R1=.. TO ..", at.column());
      parameters_.write(variable, evaluator_.bare(at));
      const bool yes = siemens_loop_goes_on(at, variable);
      nothing_more();
      if (!yes) after(line.next);
      break;
    }
    case Flow::end_for: {
      nothing_more();
      count_pass();
      // The variable and its last value stand in the line of the FOR.
      go_to(flow.line(line.next).place);
      unit().text.next(line_);
      Cursor begin(line_);
      skip_number(begin);
      begin.advance(begin.letters().size());
      const int variable = siemens_loop_variable(begin);
      begin.take('=');
      evaluator_.bare(begin);
      parameters_.write(variable, parameters_.read(variable) + 1);
      if (!siemens_loop_goes_on(begin, variable)) after(i);
      break;
    }
    case Flow::until: {
      count_pass();
      const bool yes = condition(at) != 0;
      nothing_more();
      if (!yes) after(line.next);
      break;
    }
    case Flow::end_ever:
      nothing_more();
      count_pass();
      after(line.next);
      break;
    case Flow::end_while:
    case Flow::macro_end:
      if (siemens_dialect_) nothing_more();
      count_pass();
      go_to(flow.line(line.next).place);
      break;
    case Flow::while_after:
      count_pass();
      if (condition(at) != 0) after(line.next);
      break;
    case Flow::macro_while:
      if (condition(at) == 0) after(line.next);
      break;
    case Flow::repeat: {
      const double count = condition(at);
      if (!(std::abs(count) <= kMostRepeats))
        fail(fmt::format("repeat [{:g}]: allowed is up to {}", count, kMostRepeats));
      const long whole = std::lround(count);
      if (whole <= 0) {
        after(line.next);
        break;
      }
      counters_.push_back({i, whole});
      break;
    }
    case Flow::end_repeat:
      count_pass();
      if (counters_.empty() || counters_.back().begin != line.next)
        fail("endrepeat without its repeat");
      if (--counters_.back().left > 0)
        after(line.next);
      else
        counters_.pop_back();
      break;
    case Flow::leave:
    case Flow::go_on: {
      count_pass();
      const FlowLine& begin = flow.line(line.next);
      // Loops inside the one that is left are left too.
      while (!counters_.empty() && counters_.back().begin > line.next) counters_.pop_back();
      if (line.kind == Flow::go_on) {
        go_to(flow.line(begin.next).place);
        break;
      }
      if (!counters_.empty() && counters_.back().begin == line.next) counters_.pop_back();
      after(begin.next);
      break;
    }
    case Flow::program:
      break;
  }
}

// --------------------------------------------------------------------------------------- calls

/// The folder of the program, then those of the path.
std::vector<std::string> ProgramRun::program_folders() const {
  std::vector<std::string> folders{
      std::filesystem::path(units_.front()->text.path()).parent_path().string()};
  const std::string& path = machine_.nc.program_path;
  for (std::size_t from = 0; from < path.size();) {
    const std::size_t end = std::min(path.find(':', from), path.size());
    if (end > from) folders.push_back(path.substr(from, end - from));
    from = end + 1;
  }
  return folders;
}

/// The first of the files that can be read, beside the program and along the path, opened once.
std::size_t ProgramRun::find_unit(const std::vector<std::string>& names) {
  namespace fs = std::filesystem;
  for (const std::string& folder : program_folders())
    for (const std::string& name : names) {
      const fs::path path = fs::path(folder) / name;
      for (std::size_t i = 0; i < units_.size(); ++i)
        if (units_[i]->text.path() == path.string()) return i;
      std::error_code error;
      if (!fs::is_regular_file(path, error)) continue;
      if (units_.size() >= kMostFiles)
        fail(fmt::format("the program calls more than {} files", kMostFiles));
      units_.push_back(std::make_unique<Unit>(path.string(), siemens_dialect_));
      return units_.size() - 1;
    }
  return units_.size();
}

/// For messages: "beside it", and along which path.
std::string ProgramRun::where_sought() const {
  const std::string& path = machine_.nc.program_path;
  return path.empty() ? "beside it" : "beside it or in " + path;
}

void ProgramRun::enter_call(Call call, std::size_t unit_index, const ProgramPlace& place) {
  if (calls_.size() >= kDeepestCall) fail(fmt::format("calls nested deeper than {}", kDeepestCall));
  count_pass();
  call.unit = unit_;
  call.back = unit().text.here();
  call.begin = place;
  call.counters = std::move(counters_);
  counters_.clear();
  calls_.push_back(std::move(call));
  unit_ = unit_index;
  labels_.clear();
  go_to(place);
}

void ProgramRun::leave_call() {
  Call& call = calls_.back();
  if (call.modal) {
    const GcodeModal now = modal_;
    modal_ = *call.modal;
    modal_.motion = now.motion;
    modal_.length = now.length;
    modal_.tool_length = now.tool_length;
  }
  if (call.own_locals) parameters_.locals() = std::move(call.locals);
  counters_ = std::move(call.counters);
  const ProgramPlace back = call.back;
  unit_ = call.unit;
  calls_.pop_back();
  labels_.clear();
  go_to(back);
}

void ProgramRun::call_sub(const std::string& label, Cursor& at) {
  std::vector<double> arguments;
  for (at.skip_blanks(); at.peek() == '['; at.skip_blanks()) {
    if (arguments.size() >= kMostArguments)
      fail(fmt::format("more than {} arguments", kMostArguments), at.column());
    arguments.push_back(evaluator_.bracketed(at));
  }
  if (!at.at_end() && at.peek() != '(' && at.peek() != ';')
    fail("arguments stand in brackets: call [1] [2]", at.column());
  std::size_t where = unit_;
  int sub = unit().flow.sub(label);
  if (sub < 0 && unit_ != 0 && (sub = units_.front()->flow.sub(label)) >= 0) where = 0;
  if (sub < 0) {
    const std::string bare = label.front() == '<' ? label.substr(1, label.size() - 2) : label;
    if (bare.find('/') != std::string::npos)
      fail(fmt::format("O{} call: a name, not a path", label));
    where = find_unit({bare + ".ngc", bare + ".nc"});
    if (where < units_.size()) sub = units_[where]->flow.sub(label);
    if (sub < 0)
      fail(fmt::format("O{} call: there is no O{} sub in the program and no file {}.ngc with it {}",
                       label, label, bare, where_sought()));
  }
  Call call;
  call.own_locals = true;
  call.locals = std::move(parameters_.locals());
  parameters_.locals() = LocalParameters();
  for (std::size_t i = 0; i < arguments.size(); ++i)
    parameters_.locals().numbered[i + 1] = arguments[i];
  enter_call(std::move(call), where, units_[where]->flow.line(sub).after);
}

void ProgramRun::return_from_sub(Cursor& at, bool with_value) {
  if (calls_.empty() || calls_.back().macro) fail("return outside a subroutine");
  at.skip_blanks();
  std::optional<double> value;
  if (with_value && at.peek() == '[') value = evaluator_.bracketed(at);
  returned_ = value;
  leave_call();
}

/// M98, G65, G66: the program Onumber in this file or in one beside it.
void ProgramRun::call_program(int number, long repeats, bool macro_locals) {
  const std::string label = std::to_string(number);
  std::size_t where = unit_;
  int head = unit().flow.program(label);
  if (head < 0 && (head = units_.front()->flow.program(label)) >= 0) where = 0;
  ProgramPlace place;
  if (head < 0 && unit().flow.sub(label) >= 0) {  // a sub of NGC: its end returns as well
    head = unit().flow.sub(label);
  }
  if (head < 0) {
    where = find_unit({label + ".nc", label + ".ngc", "O" + label, "O" + label + ".nc",
                       fmt::format("O{:04}", number), fmt::format("O{:04}.nc", number),
                       fmt::format("{:04}.nc", number), label});
    if (where == units_.size())
      fail(fmt::format("there is no O{} in the program and no file {}.nc or O{} {}", number, number,
                       label, where_sought()));
    units_[where]->opened = false;
  } else {
    place = units_[where]->flow.line(head).after;
  }
  Call call;
  call.macro = true;
  call.repeats = repeats - 1;
  if (macro_locals) {
    call.own_locals = true;
    LocalParameters locals;
    load_arguments(locals);
    call.locals = std::move(parameters_.locals());
    parameters_.locals() = std::move(locals);
  }
  enter_call(std::move(call), where, place);
}

void ProgramRun::load_arguments(LocalParameters& locals) {
  for (char letter = 'A'; letter <= 'Z'; ++letter)
    if (const int local = local_of(letter); local > 0 && words_.has(letter))
      locals.numbered[static_cast<std::size_t>(local)] = words_.value(letter);
}

/// G66: after every block with axis words; not within the macro itself.
void ProgramRun::call_modal_macro() {
  if (!calls_.empty()) return;
  const int number = modal_macro_;
  words_.clear();
  call_program(number, 1, true);
  parameters_.locals() = modal_macro_locals_;
}

/// M99: again if the call repeats, otherwise back, to the block P if it is given.
void ProgramRun::return_from_program() {
  words_.use("P");
  const int column = words_.column(MGroup::stop);
  if (calls_.empty()) {
    if (words_.has('P')) {
      jump_to_label(words_.value('P'), words_.column('P'));
      return;
    }
    fail("M99 in the main program would repeat it without end; allowed are M2 and M30", column);
  }
  Call& call = calls_.back();
  if (!call.macro) {
    returned_.reset();
    leave_call();
    return;
  }
  if (call.repeats > 0) {
    --call.repeats;
    count_pass();
    counters_.clear();
    go_to(call.begin);
    return;
  }
  const std::optional<double> label =
      words_.has('P') ? std::optional<double>(words_.value('P')) : std::nullopt;
  leave_call();
  if (label) jump_to_label(*label, 0);
}

// -------------------------------------------------------------------------------------- macros

void ProgramRun::jump_to_label(double number, int column) {
  const int wanted = whole_number(number);
  if (wanted < 0) fail(fmt::format("GOTO {:g}: allowed is a block number", number), column);
  if (!jump(fmt::format("N{}", wanted), Search::around))
    fail(fmt::format("there is no block N{}", wanted), column);
}

/// What a jump to this line would name: "N10", and for Siemens the label before its colon.
bool ProgramRun::is_named(std::string_view line, const std::string& name) const {
  Cursor at(line);
  at.skip_blanks();
  if (upper(at.peek()) == 'N' && is_digit(at.peek(1))) {
    at.advance();
    if (name == fmt::format("N{}", std::lround(at.number()))) return true;
  }
  return siemens_dialect_ && take_siemens_label(at) == name;
}

/// Looks for a label behind this line, then from the begin of the program, or only one of both.
/// False: there is none.
bool ProgramRun::jump(const std::string& name, Search search) {
  count_pass();
  if (const auto known = labels_.find(name); known != labels_.end() && search == Search::around) {
    go_to(known->second);
    return true;
  }
  const ProgramPlace here = unit().text.here(), me = unit().text.last();
  const auto found = [&](const ProgramPlace& from, std::uint64_t to) {
    go_to(from);
    for (std::string_view line; unit().text.here().offset < to && unit().text.next(line);) {
      if (!is_named(line, name)) continue;
      if (search == Search::around) labels_[name] = unit().text.last();
      go_to(unit().text.last());
      return true;
    }
    return false;
  };
  constexpr std::uint64_t kEnd = std::numeric_limits<std::uint64_t>::max();
  if (search != Search::backwards && found(here, kEnd)) return true;
  if (search == Search::around && found({}, kEnd)) return true;
  if (search == Search::backwards && found({}, here.offset)) return true;
  go_to(me);
  unit().text.next(line_);
  return false;
}

/// IF, GOTO, THEN and the words of Siemens. False: no such word stands here.
bool ProgramRun::read_keyword(Cursor& at) {
  const int column = at.column();
  if (siemens_dialect_ && read_siemens_jump(at)) return true;
  if (!siemens_dialect_ && at.take_word("IF")) {
    const double yes = condition(at);
    at.skip_blanks();
    const bool jump = upper(at.peek()) == 'G' && at.letters() == "GOTO";
    if (!jump && !at.take_word("THEN")) fail("IF [..] is followed by GOTO n or THEN", at.column());
    if (yes == 0) at.to_end();
    return true;
  }
  if (!siemens_dialect_ && at.letters() == "GOTO") {
    at.advance(4);
    if (upper(at.peek()) == 'N') at.advance();
    const double number = evaluator_.value(at);
    jump_to_label(number, column);
    at.to_end();
    return true;
  }
  if (at.letters().starts_with("TRAORI")) {
    at.advance(6);
    if (at.peek() == '(') at.take_comment();
    siemens_ = 1;
    return true;
  }
  if (at.take_word("TRAFOOF")) {
    siemens_ = 2;
    return true;
  }
  if (take_dynamics(at)) return true;
  if (siemens_dialect_ && read_siemens_word(at)) return true;
  if (at.letters() == "CR" && at.peek(2) == '=') {
    at.advance(3);
    words_.enter('R', evaluator_.bare(at), column);
    return true;
  }
  return false;
}

/// Siemens' technology groups of the dynamics.
bool ProgramRun::take_dynamics(Cursor& at) {
  using Dynamics = NcParams::Dynamics;
  if (!at.letters().starts_with("DYN")) return false;
  const std::array<std::pair<const char*, Dynamics>, 5> words{{{"DYNNORM", machine_.nc.dynamics},
                                                               {"DYNPOS", Dynamics::fast},
                                                               {"DYNROUGH", Dynamics::fast},
                                                               {"DYNSEMIFIN", Dynamics::smooth},
                                                               {"DYNFINISH", Dynamics::smooth}}};
  for (const auto& [word, dynamics] : words) {
    if (!at.take_word(word)) continue;
    modal_.dynamics = dynamics;
    return true;
  }
  return false;
}

/// G65, G66, G67, M98, M99.
void ProgramRun::execute_macro_words() {
  const int stop = words_.code(MGroup::stop), macro = words_.code(GGroup::macro);
  const auto program = [&](const char* word, int column) {
    if (!words_.has('P')) fail(fmt::format("{} without P (the program)", word), column);
    const int p = whole_number(words_.value('P'));
    if (p < 1)
      fail(fmt::format("P{:g}: allowed is a program number", words_.value('P')),
           words_.column('P'));
    return p;
  };
  const auto repeats = [&] {
    const int l = words_.has('L') ? whole_number(words_.value('L')) : 1;
    if (l < 0 || l > kMostRepeats)
      fail(fmt::format("L{:g}: allowed are 0 to {}", words_.value('L'), kMostRepeats),
           words_.column('L'));
    return static_cast<long>(l);
  };
  if (stop == 98) {
    int p = program("M98", words_.column(MGroup::stop));
    long l = repeats();
    if (fanuc_ && p > 9999 && !words_.has('L') && unit().flow.program(std::to_string(p)) < 0) {
      l = p / 10000;  // M98 P00051000: five times O1000
      p %= 10000;
    }
    if (l > 0) call_program(p, l, false);
    return;
  }
  if (stop == 99) {
    return_from_program();
    return;
  }
  if (words_.code(GGroup::once) == 650) {
    const int p = program("G65", words_.column(GGroup::once));
    if (const long l = repeats(); l > 0) call_program(p, l, true);
    return;
  }
  if (macro == 660) {
    modal_macro_ = program("G66", words_.column(GGroup::macro));
    modal_macro_locals_ = LocalParameters();
    load_arguments(modal_macro_locals_);
    words_.clear();
    return;
  }
  if (macro == 670) {
    modal_macro_ = 0;
    return;
  }
}

}  // namespace vcnc
