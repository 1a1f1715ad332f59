#include "controller/operation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <stdexcept>

namespace vcnc {

namespace {

using OperationKind = Operation::Kind;

constexpr double kLongest = 1e6;  ///< [s]
constexpr double kLastLine = 1e9;

enum class Argument { none, percent, on_off };

struct OperationWord {
  OperationKind kind;
  std::string_view name;
  Argument argument;
  double largest = 0;  ///< override
};

constexpr std::array<OperationWord, 7> kOperations{{
    {OperationKind::feed, "feed", Argument::percent, kLargestFeedOverride},
    {OperationKind::rapid, "rapid", Argument::percent, kLargestRapidOverride},
    {OperationKind::hold, "hold", Argument::none},
    {OperationKind::start, "start", Argument::none},
    {OperationKind::single_block, "single", Argument::on_off},
    {OperationKind::optional_stop, "optional-stop", Argument::on_off},
    {OperationKind::block_delete, "block-delete", Argument::on_off},
}};

constexpr const char* kForm =
    "expected at SECONDS s WHAT or at line N WHAT; WHAT is feed P %, rapid P %, hold, start, "
    "single on|off, optional-stop on|off, block-delete on|off";

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument(why); }

/// Takes words and numbers off a text; "50%" is a number and a word.
class WordReader {
 public:
  explicit WordReader(std::string_view text) : rest_(text) {}

  std::string_view word() {
    skip();
    const std::size_t end = std::min(rest_.find_first_of(" \t\r"), rest_.size());
    return take(end);
  }
  double number(std::string_view what, double min, double max) {
    skip();
    double value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc() || !(value >= min && value <= max)) {
      const std::string_view found = rest_.substr(0, rest_.find_first_of(" \t\r"));
      refuse(fmt::format("{} {}: expected a number, {:g} .. {:g}", what, found, min, max));
    }
    take(static_cast<std::size_t>(end - rest_.data()));
    return value;
  }
  void expect(std::string_view word) {
    skip();
    if (!rest_.starts_with(word))
      refuse(fmt::format("\"{}\": expected {}; {}", rest_.substr(0, 20), word, kForm));
    take(word.size());
  }
  bool at_end() {
    skip();
    return rest_.empty();
  }
  std::string_view rest() const { return rest_; }

 private:
  void skip() {
    const std::size_t from = std::min(rest_.find_first_not_of(" \t\r"), rest_.size());
    rest_.remove_prefix(from);
  }
  std::string_view take(std::size_t count) {
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

  std::string_view rest_;
};

}  // namespace

Operation parse_operation(std::string_view text) {
  WordReader in(text);
  Operation operation;
  operation.text = std::string(text);
  if (in.word() != "at") refuse(kForm);
  WordReader place = in;
  if (place.word() == "line") {
    in = place;
    const double line = in.number("line", 1, kLastLine);
    if (line != std::floor(line)) refuse(fmt::format("line {}: expected a whole number", line));
    operation.line = static_cast<int>(line);
  } else {
    operation.at = static_cast<Tick>(std::llround(in.number("at", 0, kLongest) / kCycle));
    in.expect("s");
  }
  const std::string_view name = in.word();
  const auto found = std::find_if(kOperations.begin(), kOperations.end(),
                                  [&](const OperationWord& w) { return w.name == name; });
  if (found == kOperations.end()) refuse(fmt::format("\"{}\": {}", name, kForm));
  operation.kind = found->kind;
  if (found->argument == Argument::percent) {
    operation.value = in.number(name, 0, 100 * found->largest) / 100;
    in.expect("%");
  } else if (found->argument == Argument::on_off) {
    const std::string_view state = in.word();
    if (state != "on" && state != "off")
      refuse(fmt::format("{} {}: expected on or off", name, state));
    operation.value = state == "on";
  }
  if (!in.at_end()) refuse(fmt::format("\"{}\" after {} is too much", in.rest(), name));
  return operation;
}

OperatorPanel::OperatorPanel(std::vector<Operation> operations) : waiting_(std::move(operations)) {
  due_.reserve(waiting_.size());
}

const std::vector<Operation>& OperatorPanel::due(Tick k, int line) {
  due_.clear();
  if (waiting_.empty()) return due_;
  const auto is_due = [&](const Operation& o) { return o.timed() ? k >= o.at : line == o.line; };
  std::copy_if(waiting_.begin(), waiting_.end(), std::back_inserter(due_), is_due);
  std::erase_if(waiting_, is_due);
  for (const Operation& o : due_) switch (o.kind) {
      case OperationKind::feed:
        switches_.feed = o.value;
        break;
      case OperationKind::rapid:
        switches_.rapid = o.value;
        break;
      case OperationKind::single_block:
        switches_.single_block = o.value != 0;
        break;
      case OperationKind::optional_stop:
        switches_.optional_stop = o.value != 0;
        break;
      case OperationKind::block_delete:
        switches_.block_delete = o.value != 0;
        break;
      case OperationKind::hold:
      case OperationKind::start:
        break;
    }
  return due_;
}

bool OperatorPanel::start_to_come() const {
  return std::any_of(waiting_.begin(), waiting_.end(), [](const Operation& o) {
    return o.kind == OperationKind::start && o.timed();
  });
}

bool OperatorPanel::timed_to_come() const {
  return std::any_of(waiting_.begin(), waiting_.end(),
                     [](const Operation& o) { return o.timed(); });
}

std::vector<std::string> OperatorPanel::never() const {
  std::vector<std::string> texts;
  for (const Operation& o : waiting_) texts.push_back(o.text);
  return texts;
}

}  // namespace vcnc
