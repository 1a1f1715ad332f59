#include "controller/gcode/flow_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "controller/gcode/expression.hpp"

namespace vcnc {
namespace {

using LineKind = FlowLine::Kind;

struct KindWord {
  const char* word;
  LineKind kind;
};
constexpr KindWord kWords[] = {{"SUB", LineKind::sub},
                               {"ENDSUB", LineKind::end_sub},
                               {"RETURN", LineKind::give_back},
                               {"CALL", LineKind::call},
                               {"IF", LineKind::when},
                               {"ELSEIF", LineKind::else_when},
                               {"ELSE", LineKind::otherwise},
                               {"ENDIF", LineKind::end_when},
                               {"WHILE", LineKind::loop_while},
                               {"ENDWHILE", LineKind::end_while},
                               {"DO", LineKind::loop_do},
                               {"REPEAT", LineKind::repeat},
                               {"ENDREPEAT", LineKind::end_repeat},
                               {"BREAK", LineKind::leave},
                               {"CONTINUE", LineKind::go_on}};

/// Past the bracket that closes the one here, or to the end.
void skip_bracketed(Cursor& at) {
  int depth = 0;
  for (; !at.at_end(); at.advance()) {
    if (at.peek() == '[') ++depth;
    if (at.peek() == ']' && --depth == 0) {
      at.advance();
      return;
    }
  }
}

/// Label and word of an O line; nothing for one whose label has to be computed and is not a call.
std::optional<FlowLine> o_line(Cursor& at) {
  const int column = at.column();
  at.advance();
  at.skip_blanks();
  std::string label;
  if (at.peek() == '<') {
    label = fmt::format("<{}>", take_name(at));
  } else if (is_digit(at.peek())) {
    while (at.peek() == '0' && is_digit(at.peek(1))) at.advance();
    for (; is_digit(at.peek()); at.advance()) label += at.peek();
  } else if (at.peek() == '[' || at.peek() == '#') {
    while (at.peek() == '#') {
      at.advance();
      at.skip_blanks();
    }
    if (at.peek() == '[')
      skip_bracketed(at);
    else if (at.peek() == '<')
      take_name(at);
    else
      while (is_digit(at.peek())) at.advance();
    at.skip_blanks();
    if (at.letters() != "CALL")
      throw LineError("an O word with a computed label; allowed is that for call only", column);
    return FlowLine{.kind = LineKind::call};
  } else {
    throw LineError("O without its number or <name>", column);
  }
  at.skip_blanks();
  const std::string word = at.letters();
  for (const KindWord& known : kWords)
    if (word == known.word) return FlowLine{.kind = known.kind, .label = label};
  if (label.front() == '<' || word.size() > 1)
    throw LineError(fmt::format("O{} {}: unknown; allowed are sub endsub return call if elseif "
                                "else endif while endwhile do repeat endrepeat break continue",
                                label, word),
                    column);
  return FlowLine{.kind = LineKind::program, .label = label};
}

/// The number behind DO or END, as a label of its own kind.
std::string do_label(Cursor& at) {
  at.skip_blanks();
  std::string label = "DO";
  const int column = at.column();
  for (; is_digit(at.peek()); at.advance()) label += at.peek();
  if (label != "DO1" && label != "DO2" && label != "DO3")
    throw LineError("DO and END take a number from 1 to 3", column);
  return label;
}

std::optional<FlowLine> macro_line(Cursor& at, bool& macros) {
  const std::string word = at.letters();
  if (word == "IF" || word == "GOTO") macros = true;
  if (word == "G" && at.peek(1) == '6' && (at.peek(2) == '5' || at.peek(2) == '6')) macros = true;
  if (word == "WHILE") {
    macros = true;
    at.advance(5);
    at.skip_blanks();
    skip_bracketed(at);
    at.skip_blanks();
    if (!at.take_word("DO")) throw LineError("WHILE [..] is followed by DO n", at.column());
    return FlowLine{.kind = LineKind::macro_while, .label = do_label(at)};
  }
  if (word == "DO" || word == "END") {
    at.advance(word.size());
    return FlowLine{.kind = word == "DO" ? LineKind::macro_do : LineKind::macro_end,
                    .label = do_label(at)};
  }
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& path, const FlowLine& line, const std::string& why) {
  throw ProgramError(fmt::format("{}:{}:{}: {}", path, line.place.line, line.column, why));
}

/// As it is written: "O100 if", "DO1", "WHILE".
std::string name_of(const FlowLine& line) {
  const std::string word = flow_word(line.kind);
  if (line.label.empty()) return word;
  return line.label.starts_with("DO") ? fmt::format("{} {}", word, line.label)
                                      : fmt::format("O{} {}", line.label, word);
}

constexpr KindWord kSiemensWords[] = {{"IF", LineKind::when},
                                      {"ELSE", LineKind::otherwise},
                                      {"ENDIF", LineKind::end_when},
                                      {"WHILE", LineKind::loop_while},
                                      {"ENDWHILE", LineKind::end_while},
                                      {"FOR", LineKind::loop_for},
                                      {"ENDFOR", LineKind::end_for},
                                      {"REPEAT", LineKind::loop_until},
                                      {"UNTIL", LineKind::until},
                                      {"LOOP", LineKind::loop_ever},
                                      {"ENDLOOP", LineKind::end_ever}};

/// IF that only decides about a jump is a block like others.
std::optional<FlowLine> siemens_line(Cursor& at) {
  const std::string word = at.letters();
  for (const KindWord& known : kSiemensWords) {
    if (word != known.word) continue;
    if (known.kind == LineKind::when) {
      std::string rest(at.rest().substr(0, at.rest().find(';')));
      for (char& c : rest) c = upper(c);
      if (rest.find("GOTO") != std::string::npos) return std::nullopt;
    }
    return FlowLine{.kind = known.kind};
  }
  return std::nullopt;
}

bool begins_flow(char c) {
  const char u = upper(c);
  return u == 'O' || u == ':' || u == 'W' || u == 'D' || u == 'E' || u == 'I' || u == 'G';
}

}  // namespace

const char* flow_word(LineKind kind) {
  for (const KindWord& known : kWords)
    if (known.kind == kind) return known.word;
  switch (kind) {
    case LineKind::while_after:
      return "WHILE";
    case LineKind::macro_while:
      return "WHILE";
    case LineKind::macro_do:
      return "DO";
    case LineKind::macro_end:
      return "END";
    case LineKind::loop_for:
      return "FOR";
    case LineKind::end_for:
      return "ENDFOR";
    case LineKind::loop_until:
      return "REPEAT";
    case LineKind::until:
      return "UNTIL";
    case LineKind::loop_ever:
      return "LOOP";
    case LineKind::end_ever:
      return "ENDLOOP";
    default:
      return "";
  }
}

FlowIndex::FlowIndex(ProgramText& text, bool siemens) {
  text.go_to({});
  int percents = 0;
  for (std::string_view line; text.next(line);) {
    Cursor at(line);
    at.skip_blanks();
    if (at.peek() == '%' && ++percents == 2) break;
    if (at.peek() == '/') {
      at.advance();
      at.skip_blanks();
    }
    if (upper(at.peek()) == 'N' && is_digit(at.peek(1))) {
      at.advance();
      while (is_digit(at.peek())) at.advance();
      at.skip_blanks();
    }
    const char first = upper(at.peek());
    if (siemens ? std::string_view("IEWFRUL").find(first) == std::string_view::npos
                : !begins_flow(first))
      continue;
    if (first == 'G' && upper(at.peek(1)) != 'O' && at.peek(1) != '6') continue;
    if (at.letters().starts_with("ORI")) continue;  // of Siemens
    const int column = at.column();
    try {
      const std::optional<FlowLine> found = siemens ? siemens_line(at)
                                            : first == 'O' || first == ':'
                                                ? o_line(at)
                                                : macro_line(at, macros_);
      if (!found) continue;
      FlowLine entry = *found;
      entry.column = column;
      entry.place = text.last();
      entry.after = text.here();
      enter(std::move(entry), text.path());
    } catch (const LineError& error) {
      throw ProgramError(
          fmt::format("{}:{}:{}: {}", text.path(), text.last().line, error.column, error.what()));
    }
  }
  for (const int i : open_) {
    const FlowLine& line = lines_[static_cast<std::size_t>(i)];
    if (line.kind == LineKind::program) continue;
    refuse(text.path(), line, name_of(line) + " without its end");
  }
  open_ = {};
  text.go_to({});
}

/// Takes the innermost open line off, which must have the label and be of one of the kinds.
int FlowIndex::close(const FlowLine& line, const std::string& path,
                     std::initializer_list<LineKind> by) {
  if (open_.empty()) refuse(path, line, name_of(line) + " without its begin");
  const int i = open_.back();
  const FlowLine& begin = lines_[static_cast<std::size_t>(i)];
  if (begin.label != line.label || std::find(by.begin(), by.end(), begin.kind) == by.end())
    refuse(path, line,
           fmt::format("{} while {} of line {} is open", name_of(line), name_of(begin),
                       begin.place.line));
  open_.pop_back();
  return i;
}

void FlowIndex::enter(FlowLine line, const std::string& path) {
  if (lines_.size() >= kMostLines)
    refuse(path, line, fmt::format("more than {} lines with O words or loops", kMostLines));
  const int me = static_cast<int>(lines_.size());
  const auto joined = [&](int begin) {
    line.next = begin;
    lines_[static_cast<std::size_t>(begin)].next = me;
  };
  switch (line.kind) {
    case LineKind::sub:
      if (!open_.empty())
        refuse(path, line,
               fmt::format("O{} sub within line {}; a sub stands for itself", line.label,
                           lines_[static_cast<std::size_t>(open_.back())].place.line));
      if (!subs_.emplace(line.label, me).second)
        refuse(path, line, fmt::format("O{} sub given twice", line.label));
      open(me);
      break;
    case LineKind::when:
    case LineKind::loop_do:
    case LineKind::repeat:
    case LineKind::macro_while:
    case LineKind::macro_do:
    case LineKind::loop_for:
    case LineKind::loop_until:
    case LineKind::loop_ever:
      open(me);
      break;
    case LineKind::loop_while: {
      // It ends a do loop of the same label if that is the innermost open line.
      const FlowLine* begin =
          open_.empty() ? nullptr : &lines_[static_cast<std::size_t>(open_.back())];
      if (begin && begin->kind == LineKind::loop_do && begin->label == line.label) {
        line.kind = LineKind::while_after;
        joined(close(line, path, {LineKind::loop_do}));
      } else {
        open(me);
      }
      break;
    }
    case LineKind::end_sub:
      joined(close(line, path, {LineKind::sub}));
      break;
    case LineKind::end_while:
      joined(close(line, path, {LineKind::loop_while}));
      break;
    case LineKind::end_repeat:
      joined(close(line, path, {LineKind::repeat}));
      break;
    case LineKind::macro_end:
      joined(close(line, path, {LineKind::macro_while, LineKind::macro_do}));
      break;
    case LineKind::end_for:
      joined(close(line, path, {LineKind::loop_for}));
      break;
    case LineKind::until:
      joined(close(line, path, {LineKind::loop_until}));
      break;
    case LineKind::end_ever:
      joined(close(line, path, {LineKind::loop_ever}));
      break;
    case LineKind::else_when:
    case LineKind::otherwise:
    case LineKind::end_when: {
      const int before =
          close(line, path,
                line.kind == LineKind::end_when
                    ? std::initializer_list<LineKind>{LineKind::when, LineKind::else_when,
                                                      LineKind::otherwise}
                    : std::initializer_list<LineKind>{LineKind::when, LineKind::else_when});
      lines_[static_cast<std::size_t>(before)].next = me;
      line.end = before;  // back along the branches, until the endif is known
      if (line.kind != LineKind::end_when) open(me);
      if (line.kind == LineKind::end_when)
        for (int i = before; i >= 0;) {
          FlowLine& branch = lines_[static_cast<std::size_t>(i)];
          i = branch.end;
          branch.end = me;
        }
      break;
    }
    case LineKind::leave:
    case LineKind::go_on:
      for (auto i = open_.rbegin(); i != open_.rend() && line.next < 0; ++i) {
        const FlowLine& begin = lines_[static_cast<std::size_t>(*i)];
        const bool loop = begin.kind == LineKind::loop_while || begin.kind == LineKind::loop_do ||
                          begin.kind == LineKind::repeat;
        if (loop && begin.label == line.label) line.next = *i;
      }
      if (line.next < 0) refuse(path, line, name_of(line) + " outside a loop of that label");
      break;
    case LineKind::program:
      programs_.emplace(line.label, me);
      break;
    default:
      break;
  }
  lines_.push_back(std::move(line));
}

int FlowIndex::at(const ProgramPlace& place) const {
  const auto found = std::lower_bound(
      lines_.begin(), lines_.end(), place.offset,
      [](const FlowLine& line, std::uint64_t offset) { return line.place.offset < offset; });
  return found != lines_.end() && found->place.offset == place.offset
             ? static_cast<int>(found - lines_.begin())
             : -1;
}

int FlowIndex::sub(const std::string& label) const {
  const auto found = subs_.find(label);
  return found == subs_.end() ? -1 : found->second;
}

int FlowIndex::program(const std::string& number) const {
  const auto found = programs_.find(number);
  return found == programs_.end() ? -1 : found->second;
}

}  // namespace vcnc
