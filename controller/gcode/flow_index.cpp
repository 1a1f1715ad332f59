#include "controller/gcode/flow_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "controller/gcode/expression.hpp"

namespace vcnc {
namespace {

using Kind = FlowLine::Kind;

struct KindWord {
  const char* word;
  Kind kind;
};
constexpr KindWord kWords[] = {{"SUB", Kind::sub},
                               {"ENDSUB", Kind::end_sub},
                               {"RETURN", Kind::give_back},
                               {"CALL", Kind::call},
                               {"IF", Kind::when},
                               {"ELSEIF", Kind::else_when},
                               {"ELSE", Kind::otherwise},
                               {"ENDIF", Kind::end_when},
                               {"WHILE", Kind::loop_while},
                               {"ENDWHILE", Kind::end_while},
                               {"DO", Kind::loop_do},
                               {"REPEAT", Kind::repeat},
                               {"ENDREPEAT", Kind::end_repeat},
                               {"BREAK", Kind::leave},
                               {"CONTINUE", Kind::go_on}};

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
    return FlowLine{Kind::call, {}, {}, "", -1, -1};
  } else {
    throw LineError("O without its number or <name>", column);
  }
  at.skip_blanks();
  const std::string word = at.letters();
  for (const KindWord& known : kWords)
    if (word == known.word) return FlowLine{known.kind, {}, {}, label, -1, -1};
  if (label.front() == '<' || word.size() > 1)
    throw LineError(fmt::format("O{} {}: unknown; allowed are sub endsub return call if elseif "
                                "else endif while endwhile do repeat endrepeat break continue",
                                label, word),
                    column);
  return FlowLine{Kind::program, {}, {}, label, -1, -1};
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
    return FlowLine{Kind::macro_while, {}, {}, do_label(at), -1, -1};
  }
  if (word == "DO" || word == "END") {
    at.advance(word.size());
    return FlowLine{word == "DO" ? Kind::macro_do : Kind::macro_end, {}, {}, do_label(at), -1, -1};
  }
  return std::nullopt;
}

bool begins_flow(char c) {
  const char u = upper(c);
  return u == 'O' || u == ':' || u == 'W' || u == 'D' || u == 'E' || u == 'I' || u == 'G';
}

}  // namespace

const char* flow_word(Kind kind) {
  for (const KindWord& known : kWords)
    if (known.kind == kind) return known.word;
  switch (kind) {
    case Kind::while_after:
      return "WHILE";
    case Kind::macro_while:
      return "WHILE";
    case Kind::macro_do:
      return "DO";
    case Kind::macro_end:
      return "END";
    default:
      return "";
  }
}

FlowIndex::FlowIndex(ProgramText& text) {
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
    if (!begins_flow(first)) continue;
    if (first == 'G' && upper(at.peek(1)) != 'O' && at.peek(1) != '6') continue;
    if (at.letters().starts_with("ORI")) continue;  // of Siemens
    try {
      const std::optional<FlowLine> found =
          first == 'O' || first == ':' ? o_line(at) : macro_line(at, macros_);
      if (!found) continue;
      FlowLine entry = *found;
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
    if (line.kind == Kind::program) continue;
    throw ProgramError(
        fmt::format("{}:{}: {} {} without its end", text.path(), line.place.line,
                    line.label.starts_with("DO") ? line.label : fmt::format("O{}", line.label),
                    flow_word(line.kind)));
  }
  open_ = {};
  text.go_to({});
}

/// Takes the innermost open line off, which must have the label and be of one of the kinds.
int FlowIndex::close(const FlowLine& line, const std::string& path,
                     std::initializer_list<Kind> by) {
  const auto name = [](const FlowLine& l) {
    return l.label.starts_with("DO") ? fmt::format("{} {}", flow_word(l.kind), l.label)
                                     : fmt::format("O{} {}", l.label, flow_word(l.kind));
  };
  if (open_.empty())
    throw ProgramError(
        fmt::format("{}:{}: {} without its begin", path, line.place.line, name(line)));
  const int i = open_.back();
  const FlowLine& begin = lines_[static_cast<std::size_t>(i)];
  if (begin.label != line.label || std::find(by.begin(), by.end(), begin.kind) == by.end())
    throw ProgramError(fmt::format("{}:{}: {} while {} of line {} is open", path, line.place.line,
                                   name(line), name(begin), begin.place.line));
  open_.pop_back();
  return i;
}

void FlowIndex::enter(FlowLine line, const std::string& path) {
  if (lines_.size() >= kMostLines)
    throw ProgramError(fmt::format("{}:{}: more than {} lines with O words or loops", path,
                                   line.place.line, kMostLines));
  const int me = static_cast<int>(lines_.size());
  const auto joined = [&](int begin) {
    line.next = begin;
    lines_[static_cast<std::size_t>(begin)].next = me;
  };
  switch (line.kind) {
    case Kind::sub:
      if (!open_.empty())
        throw ProgramError(fmt::format("{}:{}: O{} sub within line {}; a sub stands for itself",
                                       path, line.place.line, line.label,
                                       lines_[static_cast<std::size_t>(open_.back())].place.line));
      if (!subs_.emplace(line.label, me).second)
        throw ProgramError(
            fmt::format("{}:{}: O{} sub given twice", path, line.place.line, line.label));
      open(me);
      break;
    case Kind::when:
    case Kind::loop_do:
    case Kind::repeat:
    case Kind::macro_while:
    case Kind::macro_do:
      open(me);
      break;
    case Kind::loop_while: {
      // It ends a do loop of the same label if that is the innermost open line.
      const FlowLine* begin =
          open_.empty() ? nullptr : &lines_[static_cast<std::size_t>(open_.back())];
      if (begin && begin->kind == Kind::loop_do && begin->label == line.label) {
        line.kind = Kind::while_after;
        joined(close(line, path, {Kind::loop_do}));
      } else {
        open(me);
      }
      break;
    }
    case Kind::end_sub:
      joined(close(line, path, {Kind::sub}));
      break;
    case Kind::end_while:
      joined(close(line, path, {Kind::loop_while}));
      break;
    case Kind::end_repeat:
      joined(close(line, path, {Kind::repeat}));
      break;
    case Kind::macro_end:
      joined(close(line, path, {Kind::macro_while, Kind::macro_do}));
      break;
    case Kind::else_when:
    case Kind::otherwise:
    case Kind::end_when: {
      const int before =
          close(line, path,
                line.kind == Kind::end_when
                    ? std::initializer_list<Kind>{Kind::when, Kind::else_when, Kind::otherwise}
                    : std::initializer_list<Kind>{Kind::when, Kind::else_when});
      lines_[static_cast<std::size_t>(before)].next = me;
      line.end = before;  // back along the branches, until the endif is known
      if (line.kind != Kind::end_when) open(me);
      if (line.kind == Kind::end_when)
        for (int i = before; i >= 0;) {
          FlowLine& branch = lines_[static_cast<std::size_t>(i)];
          i = branch.end;
          branch.end = me;
        }
      break;
    }
    case Kind::leave:
    case Kind::go_on:
      for (auto i = open_.rbegin(); i != open_.rend() && line.next < 0; ++i) {
        const FlowLine& begin = lines_[static_cast<std::size_t>(*i)];
        const bool loop = begin.kind == Kind::loop_while || begin.kind == Kind::loop_do ||
                          begin.kind == Kind::repeat;
        if (loop && begin.label == line.label) line.next = *i;
      }
      if (line.next < 0)
        throw ProgramError(fmt::format("{}:{}: O{} {} outside a loop of that label", path,
                                       line.place.line, line.label, flow_word(line.kind)));
      break;
    case Kind::program:
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
