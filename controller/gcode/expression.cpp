#include "controller/gcode/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr int kDeepest = 50;     ///< nested brackets
constexpr double kEqual = 1e-6;  ///< difference that EQ does not see
constexpr double kLargestValue = 1e30;

enum class Op {
  power,
  times,
  divide,
  mod,
  quotient,
  plus,
  minus,
  eq,
  ne,
  gt,
  ge,
  lt,
  le,
  op_and,
  op_or,
  op_xor
};

struct OpWord {
  std::string_view text;
  Op op;
  int rank;
};
constexpr OpWord kOpWords[] = {{"MOD", Op::mod, 5},   {"EQ", Op::eq, 3},      {"NE", Op::ne, 3},
                               {"GT", Op::gt, 3},     {"GE", Op::ge, 3},      {"LT", Op::lt, 3},
                               {"LE", Op::le, 3},     {"AND", Op::op_and, 2}, {"OR", Op::op_or, 2},
                               {"XOR", Op::op_xor, 2}};

/// Of Siemens, where relations bind least. The longer ones first.
constexpr OpWord kSiemensOps[] = {
    {"==", Op::eq, 0},      {"<>", Op::ne, 0},      {">=", Op::ge, 0},   {"<=", Op::le, 0},
    {">", Op::gt, 0},       {"<", Op::lt, 0},       {"MOD", Op::mod, 5}, {"DIV", Op::quotient, 5},
    {"AND", Op::op_and, 3}, {"XOR", Op::op_xor, 2}, {"OR", Op::op_or, 1}};

std::optional<OpWord> take_siemens_operator(Cursor& at, int lowest) {
  for (const OpWord& word : kSiemensOps) {
    bool same = true;
    for (std::size_t i = 0; same && i < word.text.size(); ++i)
      same = upper(at.peek(i)) == word.text[i];
    if (!same || (is_letter(word.text[0]) && is_letter(at.peek(word.text.size())))) continue;
    if (word.rank < lowest) return std::nullopt;
    at.advance(word.text.size());
    return word;
  }
  return std::nullopt;
}

/// The operator that stands here; taken only if its rank is at least `lowest`.
std::optional<OpWord> take_operator(Cursor& at, int lowest, bool siemens) {
  at.skip_blanks();
  const auto symbol = [&](std::size_t length, Op op, int rank) -> std::optional<OpWord> {
    if (rank < lowest) return std::nullopt;
    at.advance(length);
    return OpWord{"", op, rank};
  };
  switch (at.peek()) {
    case '*':
      return at.peek(1) == '*' ? symbol(2, Op::power, 6) : symbol(1, Op::times, 5);
    case '/':
      return symbol(1, Op::divide, 5);
    case '+':
      return symbol(1, Op::plus, 4);
    case '-':
      return symbol(1, Op::minus, 4);
    default:
      break;
  }
  if (siemens) return take_siemens_operator(at, lowest);
  for (const OpWord& word : kOpWords) {
    bool same = true;
    for (std::size_t i = 0; same && i < word.text.size(); ++i)
      same = upper(at.peek(i)) == word.text[i];
    if (!same) continue;
    if (word.rank < lowest) return std::nullopt;
    at.advance(word.text.size());
    return word;
  }
  return std::nullopt;
}

double apply(Op op, double a, double b, int column) {
  const bool a_vacant = std::isnan(a), b_vacant = std::isnan(b);
  if (a_vacant || b_vacant) {
    // A vacant value differs from 0 only where it is asked for.
    if (op == Op::eq) return a_vacant == b_vacant ? 1 : 0;
    if (op == Op::ne) return a_vacant != b_vacant ? 1 : 0;
    if (a_vacant) a = 0;
    if (b_vacant) b = 0;
  }
  double result = 0;
  switch (op) {
    case Op::power:
      if (a < 0 && b != std::floor(b))
        throw LineError("a negative number to a power that is not whole", column);
      if (a == 0 && b < 0) throw LineError("0 to a negative power", column);
      result = std::pow(a, b);
      break;
    case Op::times:
      result = a * b;
      break;
    case Op::divide:
      if (b == 0) throw LineError("division by 0", column);
      result = a / b;
      break;
    case Op::mod:
      if (b == 0) throw LineError("MOD 0", column);
      result = std::fmod(a, b);
      if (result < 0) result += std::abs(b);
      break;
    case Op::quotient:
      if (b == 0) throw LineError("DIV 0", column);
      result = std::trunc(a / b);
      break;
    case Op::plus:
      result = a + b;
      break;
    case Op::minus:
      result = a - b;
      break;
    case Op::eq:
      return std::abs(a - b) < kEqual;
    case Op::ne:
      return std::abs(a - b) >= kEqual;
    case Op::gt:
      return a > b;
    case Op::ge:
      return a >= b;
    case Op::lt:
      return a < b;
    case Op::le:
      return a <= b;
    case Op::op_and:
      return a != 0 && b != 0;
    case Op::op_or:
      return a != 0 || b != 0;
    case Op::op_xor:
      return (a != 0) != (b != 0);
  }
  if (!(std::abs(result) <= kLargestValue)) throw LineError("a value beyond 1e30", column);
  return result;
}

std::optional<double> call(std::string_view name, double x, int column) {
  const auto need = [&](bool allowed, const char* what) {
    if (!allowed) throw LineError(fmt::format("{} of {:g}; allowed is {}", name, x, what), column);
  };
  if (name == "ABS") return std::abs(x);
  if (name == "ACOS") return need(std::abs(x) <= 1, "-1 to 1"), std::acos(x) / kDegree;
  if (name == "ASIN") return need(std::abs(x) <= 1, "-1 to 1"), std::asin(x) / kDegree;
  if (name == "COS") return std::cos(x * kDegree);
  if (name == "EXP") return need(x < 69, "less than 69"), std::exp(x);
  if (name == "FIX") return std::floor(x);
  if (name == "FUP") return std::ceil(x);
  if (name == "LN") return need(x > 0, "more than 0"), std::log(x);
  if (name == "ROUND") return std::round(x);
  if (name == "SIN") return std::sin(x * kDegree);
  if (name == "SQRT" || name == "SQR") return need(x >= 0, "0 or more"), std::sqrt(x);
  if (name == "TAN") return std::tan(x * kDegree);
  if (name == "SGN") return x > 0 ? 1 : x < 0 ? -1 : 0;
  if (name == "POT") return x * x;
  if (name == "TRUNC") return std::trunc(x);
  return std::nullopt;
}

double set_or_zero(double x) { return std::isnan(x) ? 0 : x; }

}  // namespace

std::string take_name(Cursor& at) {
  const int column = at.column();
  if (!at.take('<')) throw LineError("a name stands between < and >", column);
  std::string name;
  for (; at.peek() != '>'; at.advance()) {
    if (at.at_end() || at.peek() == '#' || at.peek() == '[' || at.peek() == '(')
      throw LineError("name without closing '>'", column);
    const char c = at.peek();
    if (c != ' ' && c != '\t') name += c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  }
  at.advance();
  if (name.empty()) throw LineError("empty name", column);
  return name;
}

double Evaluator::value(Cursor& at, int depth) const {
  at.skip_blanks();
  const char c = at.peek();
  if (is_digit(c) || c == '.') return at.number();
  const int column = at.column();
  if (depth > kDeepest) throw LineError("expression nested deeper than 50", column);
  if (opens(c)) return bracketed(at, depth + 1);
  if (c == '+' || c == '-') {
    std::size_t ahead = 1;
    while (at.peek(ahead) == ' ' || at.peek(ahead) == '\t') ++ahead;
    const char next = at.peek(ahead);
    if (next == '+' || next == '-') return at.number();
    if (is_digit(next) || next == '.') {
      if (ahead == 1) return at.number();
      at.advance(ahead);
      const double x = at.number();
      return c == '-' ? -x : x;
    }
    at.advance();
    const double x = value(at, depth + 1);
    return c == '-' ? -set_or_zero(x) : x;
  }
  if (c == '#') {
    at.advance();
    at.skip_blanks();
    if (at.peek() == '<') {
      const std::string name = take_name(at);
      const std::optional<double> x = parameters_.read(name);
      if (!x) throw LineError(fmt::format("#<{}> was never set", name), column);
      return *x;
    }
    const double x = parameters_.read(parameter_number(at, depth + 1));
    return std::isnan(x) && !vacant_ ? 0 : x;
  }
  if (is_letter(c)) return function(at, depth + 1);
  if (siemens_ && c == '$') return system_variable(at);
  throw LineError(at.at_end() ? std::string("a number is missing")
                              : fmt::format("a number was expected, not '{}'", c),
                  column);
}

int Evaluator::parameter_number(Cursor& at, int depth) const {
  at.skip_blanks();
  const int column = at.column();
  const double x = set_or_zero(value(at, depth));
  const int number = whole_number(x);
  if (number < 0 || number > Parameters::kLast)
    throw LineError(
        fmt::format("#{:g}: a parameter has a whole number from 0 to {}", x, Parameters::kLast),
        column);
  return number;
}

double Evaluator::bracketed(Cursor& at, int depth) const {
  const int column = at.column();
  at.skip_blanks();
  const char opened = at.peek();
  if (!opens(opened)) throw LineError("'[' is missing", column);
  at.advance();
  const double x = expression(at, 0, depth);
  if (at.take(opened == '[' ? ']' : ')')) return x;
  if (opened == '(') throw LineError("'(' without its ')'", column);
  at.skip_blanks();
  const char c = at.peek();
  if (!at.at_end() && !is_letter(c) && !is_digit(c) && c > ' ' && c < 0x7f && c != ';' && c != '(')
    throw LineError(fmt::format("'{}' is no operator; allowed are ** * / + - MOD EQ NE GT GE LT LE "
                                "AND OR XOR, or ']'",
                                c),
                    at.column());
  throw LineError("'[' without its ']'", column);
}

double Evaluator::expression(Cursor& at, int lowest_rank, int depth) const {
  double left = value(at, depth);
  while (true) {
    at.skip_blanks();
    const int column = at.column();
    const std::optional<OpWord> next = take_operator(at, lowest_rank, siemens_);
    if (!next) return left;
    left = apply(next->op, left, expression(at, next->rank + 1, depth), column);
  }
}

/// #1000 .. #1999.
int Evaluator::r_parameter(Cursor& at, int depth) const {
  constexpr int kFirst = 1000, kCount = 1000;
  at.skip_blanks();
  const int column = at.column();
  const double x = at.peek() == '[' ? bracketed(at, depth) : at.number();
  const int number = whole_number(set_or_zero(x));
  if (number < 0 || number >= kCount)
    throw LineError(
        fmt::format("R{:g}: an R parameter has a whole number from 0 to {}", x, kCount - 1),
        column);
  return kFirst + number;
}

bool Evaluator::is_function(std::string_view name) {
  constexpr std::array kNames{"ABS", "ACOS", "ASIN", "ATAN", "COS",   "EXISTS", "EXP", "FIX",
                              "FUP", "LN",   "MAX",  "MIN",  "POW",   "ROUND",  "SGN", "SIN",
                              "SQR", "SQRT", "TAN",  "POT",  "TRUNC", "ATAN2"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

double Evaluator::exists(Cursor& at, int depth) const {
  const int column = at.column();
  if (!at.take('[') || !at.take('#'))
    throw LineError("EXISTS is followed by [#<name>] or [#number]", column);
  at.skip_blanks();
  const bool known = at.peek() == '<' ? parameters_.read(take_name(at)).has_value()
                                      : !std::isnan(parameters_.read(parameter_number(at, depth)));
  if (!at.take(']')) throw LineError("'[' without its ']'", column);
  return known;
}

double Evaluator::arc_tangent(Cursor& at, int depth) const {
  const double y = set_or_zero(bracketed(at, depth));
  const int column = at.column();
  if (!at.take('/')) throw LineError("ATAN[y] is followed by /[x]", column);
  const double x = set_or_zero(bracketed(at, depth));
  return std::atan2(y, x) / kDegree;
}

/// ATAN2(y,x) of Siemens.
double Evaluator::arc_tangent_of_two(Cursor& at, int depth) const {
  const int column = at.column();
  at.advance();
  if (!at.take('(')) throw LineError("ATAN2 takes two values: (y,x)", column);
  const double y = expression(at, 0, depth);
  if (!at.take(',')) throw LineError("ATAN2 takes two values: (y,x)", column);
  const double x = expression(at, 0, depth);
  if (!at.take(')')) throw LineError("'(' without its ')'", column);
  return std::atan2(y, x) / kDegree;
}

/// $NAME or $NAME[index], kept by the control under its name in lower case with _ before it.
double Evaluator::system_variable(Cursor& at) const {
  const int column = at.column();
  std::string name = "_$";
  at.advance();
  for (; is_letter(at.peek()) || is_digit(at.peek()) || at.peek() == '_'; at.advance())
    name += lower(at.peek());
  if (at.peek() == '[') {
    for (; !at.at_end() && at.peek() != ']'; at.advance())
      if (at.peek() != ' ') name += lower(at.peek());
    if (!at.take(']')) throw LineError("'[' without its ']'", column);
    name += ']';
  }
  if (const std::optional<double> x = parameters_.read(name)) return *x;
  throw LineError(fmt::format("unknown {}; allowed are $AA_IW[axis] $AA_IM[axis] $AA_MW[axis] "
                              "$AA_MM[axis] $AC_MEA[1]",
                              at.since(column)),
                  column);
}

double Evaluator::function(Cursor& at, int depth) const {
  const int column = at.column();
  const std::string name = at.letters();
  at.advance(name.size());
  if (siemens_ && name == "R" && (is_digit(at.peek()) || at.peek() == '[')) {
    const double x = parameters_.read(r_parameter(at, depth));
    return set_or_zero(x);
  }
  if (siemens_ && name == "NOT") return set_or_zero(value(at, depth)) == 0;
  if (siemens_ && name == "TRUE") return 1;
  if (siemens_ && name == "FALSE") return 0;
  at.skip_blanks();
  if (siemens_ && name == "ATAN" && at.peek() == '2') return arc_tangent_of_two(at, depth);
  if (name == "EXISTS") return exists(at, depth);
  if (name == "ATAN") return arc_tangent(at, depth);
  if (opens(at.peek())) {
    if (name == "POW" || name == "MAX" || name == "MIN") {
      at.advance();
      const double x = set_or_zero(expression(at, 0, depth));
      if (!at.take(',')) throw LineError(name + " takes two values: [x,y]", column);
      const double y = set_or_zero(expression(at, 0, depth));
      if (!at.take(']')) throw LineError("'[' without its ']'", column);
      if (name == "POW") return apply(Op::power, x, y, column);
      return name == "MAX" ? std::max(x, y) : std::min(x, y);
    }
    if (const std::optional<double> y = call(name, set_or_zero(bracketed(at, depth)), column))
      return *y;
  }
  throw LineError(fmt::format("a number was expected, not {}; functions are ABS ACOS ASIN ATAN COS "
                              "EXISTS EXP FIX FUP LN MAX MIN POW ROUND SGN SIN SQRT TAN, each "
                              "followed by '['",
                              name),
                  column);
}

}  // namespace vcnc
