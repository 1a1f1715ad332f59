#include "controller/gcode/interpreter.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kMostAssignments = 100;  ///< of one line
constexpr double kLargestWord = 1e7;

/// Main programs of Siemens are called .MPF, subprograms .SPF.
bool named_as_siemens(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = upper(c);
  return ending == ".MPF" || ending == ".SPF";
}

}  // namespace

GcodeInterpreter::GcodeInterpreter(const std::string& path, const Machine& machine,
                                   InterpreterOptions options)
    : run_(std::make_unique<ProgramRun>(path, machine, std::move(options))) {}

GcodeInterpreter::~GcodeInterpreter() = default;

Block GcodeInterpreter::next() { return run_->next(); }

BlockStart GcodeInterpreter::run_to(int line) { return run_->run_to(line); }

const ProbeTouch& GcodeInterpreter::probing() const { return run_->probing(); }

void GcodeInterpreter::probed(const ProbeTouch& touch) { run_->probed(touch); }

void GcodeInterpreter::forget_touches() { run_->forget_touches(); }

long GcodeInterpreter::passes_of(int line) { return run_->passes_of(line); }

NcData GcodeInterpreter::data() const { return run_->data(); }

bool GcodeInterpreter::inches() const { return run_->inches(); }

void GcodeInterpreter::block_delete(bool on) { run_->block_delete(on); }

ProgramRun::ProgramRun(const std::string& path, const Machine& machine, InterpreterOptions options)
    : machine_(machine),
      options_(std::move(options)),
      parameters_(*this),
      evaluator_(parameters_, fanuc_, siemens_dialect_),
      tools_(options_.tools  ? std::move(*options_.tools)
             : options_.bare ? ToolTable()
                             : ToolTable(machine)),
      home_(start_coordinates(machine)),
      second_home_(home_),
      map_(machine.kinematics, {}),
      position_(home_) {
  siemens_dialect_ = options_.dialect == Dialect::siemens ||
                     (options_.dialect == Dialect::automatic && named_as_siemens(path));
  units_.push_back(std::make_unique<Unit>(path, siemens_dialect_));
  fanuc_ = options_.dialect == Dialect::fanuc ||
           (options_.dialect == Dialect::automatic && unit().flow.macros());
  if (fanuc_) parameters_.last_local(LocalParameters::kCount);
  modal_.tolerance = machine.nc.blend_tolerance;
  modal_.dynamics = machine.nc.dynamics;
  for (std::size_t i = 0; i < machine.setup.work_offset.size(); ++i)
    work_.systems[i].shift.head<3>() = machine.setup.work_offset[i];
  take_over(options_.data);
  work_.select(0);
}

void ProgramRun::fail(const std::string& reason, int column) const {
  throw LineError(reason, column);
}

Block ProgramRun::next() {
  if (ready_at_ == ready_.size()) {
    ready_.clear();
    ready_at_ = 0;
    while (ready_.empty()) {
      if (ended_) return ProgramEnd{line_number()};
      read_guarded();
    }
  }
  return std::move(ready_[ready_at_++]);
}

void ProgramRun::read_guarded() {
  try {
    read_line();
  } catch (const LineError& error) {
    throw ProgramError(fmt::format("{}:{}:{}: {}", unit().text.path(), line_number(),
                                   error.column > 0 ? error.column : column_of_block(),
                                   error.what()));
  }
}

/// Where a block as a whole is to blame: its motion word, else its first axis word, else where it
/// begins.
int ProgramRun::column_of_block() const {
  if (words_.has(GGroup::motion)) return words_.column(GGroup::motion);
  for (const char letter : kAxisLetters)
    if (words_.has(letter)) return words_.column(letter);
  Cursor at(line_);
  skip_number(at);
  return at.at_end() ? 1 : at.column();
}

void ProgramRun::read_line() {
  words_.clear();
  if (!unit().text.next(line_)) {
    line_ = {};
    end_of_file();
    return;
  }
  Cursor at(line_);
  if (!unit().flow.empty()) {
    const int i = unit().flow.at(unit().text.last());
    if (i >= 0 && unit().flow.line(i).kind != Flow::program) {
      steer(i, at);
      return;
    }
  }
  assignments_.clear();
  vector_given_ = 0;
  siemens_ = 0;
  if (siemens_dialect_) {
    way_.fill(Way::modal);
    via_given_ = 0;
    siemens_frame_ = SiemensFrame::none;
    rpl_.reset();
    measures_ = false;
  }
  if (!read_words(at)) return;
  if (!assignments_.empty()) apply_assignments();
  execute();
}

void ProgramRun::end_of_file() {
  if (!calls_.empty() && calls_.back().macro) fail("the program called does not end with M99");
  if (!calls_.empty()) fail("the file of the subroutine ends before its endsub");
  if (line_number() == 0) throw ProgramError(unit().text.path() + ": the program is empty");
  fail("the program does not end with M2 or M30");
}

void ProgramRun::finish() {
  compensation_.flush(ready_);
  ready_.emplace_back(ProgramEnd{line_number()});
  ended_ = true;
}

// --------------------------------------------------------------------------------------- words

/// False: nothing (more) is to be done for this line.
bool ProgramRun::read_words(Cursor& at) {
  at.skip_blanks();
  if (at.peek() == '%') {
    if (unit().opened && calls_.empty()) finish();
    unit().opened = true;
    return false;
  }
  if (at.peek() == '/') {
    if (options_.block_delete) return false;
    at.advance();
    if (is_digit(at.peek())) at.advance();
  }
  for (at.skip_blanks(); !at.at_end(); at.skip_blanks()) {
    if (siemens_dialect_ && words_.empty() && !take_siemens_label(at).empty()) continue;
    const char c = at.peek();
    if (is_letter(c)) {
      if (is_letter(at.peek(1)) && read_keyword(at)) {
        if (at.at_end()) break;
        continue;
      }
      if (is_letter(at.peek(1))) refuse_word(at);
      read_letter(at);
    } else if (c == '(') {
      at.take_comment();
    } else if (c == ';') {
      break;
    } else if (c == '#') {
      read_assignment(at);
    } else if (c == ':') {  // the head of a program
      at.advance();
      at.number();
    } else {
      const auto byte = static_cast<unsigned char>(c);
      fail(fmt::format("unexpected {}; a word is a letter followed by a number",
                       byte >= 0x20 && byte < 0x7f ? fmt::format("'{}'", c)
                                                   : fmt::format("byte {:#04x}", byte)),
           at.column());
    }
  }
  return true;
}

/// Several letters that are neither a word nor a letter and a function behind it.
void ProgramRun::refuse_word(Cursor& at) const {
  const std::string word = at.letters();
  if (!Evaluator::is_function(std::string_view(word).substr(1)))
    fail(fmt::format("unknown word {}", word), at.column());
}

void ProgramRun::read_letter(Cursor& at) {
  const int column = at.column();
  const char letter = upper(at.peek());
  at.advance();
  at.skip_blanks();
  const char c = at.peek();
  double value = 0;
  if (siemens_dialect_ && (is_digit(c) || letter == 'R') &&
      read_siemens_address(letter, at, column)) {
    return;
  } else if (c == '=') {  // Siemens: X=10
    at.advance();
    value = siemens_dialect_ ? siemens_value(letter, at) : evaluator_.bare(at);
  } else if (is_digit(c) && at.peek(1) == '=') {  // Siemens: A3=0.5
    if (c != '3' || (letter != 'A' && letter != 'B' && letter != 'C'))
      fail(fmt::format("unknown {}{}=; allowed are A3= B3= C3=", letter, c), column);
    at.advance(2);
    const auto i = static_cast<std::size_t>(letter - 'A');
    vector_[i] = evaluator_.bare(at);
    vector_given_ |= 1u << i;
    return;
  } else {
    try {
      value = evaluator_.value(at);
    } catch (const LineError& error) {
      throw LineError(fmt::format("{}: {}", letter, error.what()), error.column);
    }
    if (std::isnan(value)) return;  // a word with a vacant parameter is as not written
  }
  if (!(std::abs(value) <= kLargestWord))
    fail(fmt::format("number too large: {}{:g}; allowed is up to {:.0f}", letter, value,
                     kLargestWord),
         column);
  if (letter == 'N') {
    if (!words_.empty()) fail("N stands at the begin of a block", column);
    if (value < 0) fail(fmt::format("N{:g}: allowed is a number from 0", value), column);
    number_ = static_cast<int>(value);
    return;
  }
  if (letter == 'O') {
    if (!words_.empty()) fail("O stands at the begin of a line", column);
    return;
  }
  if (letter == 'G' && siemens_dialect_ && !siemens_code(value)) return;
  words_.enter(letter, value, column);
}

void ProgramRun::read_assignment(Cursor& at) {
  const int column = at.column();
  at.advance();
  at.skip_blanks();
  Assignment assignment{-1, {}, 0, column};
  if (at.peek() == '<')
    assignment.name = take_name(at);
  else
    assignment.number = evaluator_.parameter_number(at);
  if (!at.take('=')) fail("a parameter at the begin of a word is set: #1=..", column);
  assignment.value = evaluator_.bare(at);
  if (assignment.number == 0) fail("#0 is always vacant and cannot be set", column);
  if (assignment.number == 3000) {  // Fanuc: alarm with a message
    at.skip_blanks();
    fail(fmt::format("the program raises alarm {:g} {}", assignment.value, at.rest()), column);
  }
  if (assignments_.size() >= kMostAssignments)
    fail(fmt::format("more than {} parameters set in one line", kMostAssignments), column);
  assignments_.push_back(std::move(assignment));
}

void ProgramRun::apply_assignments() {
  for (const Assignment& a : assignments_) {
    try {
      if (a.number >= 0)
        parameters_.write(a.number, a.value);
      else
        parameters_.write(a.name, std::isnan(a.value) ? 0 : a.value);
    } catch (const ProgramError& error) {
      fail(a.number >= 0 ? error.what() : fmt::format("#<{}>: {}", a.name, error.what()), a.column);
    }
  }
}

// --------------------------------------------------------------------------------------- block

/// In the order of RS274/NGC: feed, spindle, tool, dwell, modes, offsets, motion, stop.
void ProgramRun::execute() {
  const int once = words_.code(GGroup::once);
  if (siemens_frame_ != SiemensFrame::none) set_siemens_frame();
  if (once == 650 || modal_macro_ || words_.has(GGroup::macro) || words_.code(MGroup::stop) >= 98) {
    execute_macro_words();
    if (once == 650 || words_.code(MGroup::stop) >= 98) return;
  }
  if (once == 50) set_high_speed();
  if (words_.has(GGroup::diameter)) words_.use(fanuc_ ? "P" : "");
  const bool takes_axes = once == 100 || (once >= 280 && once <= 301) || once == 520 || once == 920;
  if (takes_axes && words_.has(GGroup::motion) && words_.code(GGroup::motion) != 800)
    fail(fmt::format("{} together with a motion word in one block; write them in two blocks",
                     code_name(once)),
         words_.column(GGroup::once));
  set_modes();
  set_feed();
  set_spindle();
  set_tool();
  set_outputs();
  if (once == 40) emit_dwell();
  set_cutter();
  set_tool_length();
  set_offsets();
  set_path_mode();
  set_rotation();
  set_tilt();
  if (words_.has(GGroup::polar)) set_polar();
  if (words_.has(GGroup::scaling) || words_.has(GGroup::mirror)) set_scaling();
  switch (once) {
    case 51:
      set_dynamics();
      break;
    case 100:
      set_by_g10();
      break;
    case 280:
    case 281:
    case 300:
    case 301:
      emit_reference_return(once);
      break;
    case 520:
    case 920:
      set_g92();
      break;
    case 921:
    case 922:
    case 923:
      set_g92();
      emit_motion();
      break;
    case 531:
      emit_tool_align();
      break;
    default:
      emit_motion();
  }
  if (!words_.all_used()) {
    for (char letter = 'A'; letter <= 'Z'; ++letter)
      if (words_.has(letter) && !words_.used(letter)) {
        if (std::string_view("BUVWE").find(letter) != std::string_view::npos)
          fail(fmt::format("unknown word {}{:g}; the axes are X Y Z A C", letter,
                           words_.value(letter)),
               words_.column(letter));
        fail(fmt::format("{}{:g} belongs to no word of this block", letter, words_.value(letter)),
             words_.column(letter));
      }
  }
  if (modal_macro_ && once < 0 && words_.any_axis()) call_modal_macro();
  switch (words_.code(MGroup::stop)) {
    case 0:
    case 60:
      emit(ProgramStop{false, line_number()});
      break;
    case 1:
      emit(ProgramStop{true, line_number()});
      break;
    case 2:
    case 30:
      finish();
      break;
    default:
      break;
  }
}

void ProgramRun::emit(Block block) {
  if (compensation_.active())
    compensation_.add(std::move(block), ready_);
  else
    ready_.push_back(std::move(block));
}

}  // namespace vcnc
