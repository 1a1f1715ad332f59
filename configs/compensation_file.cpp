#include "configs/compensation_file.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "configs/config.hpp"

namespace vcnc {
namespace {

constexpr std::string_view kSeparators = " \t\r,;";
constexpr double kLargest = 1e5;  ///< [mm or deg]

/// The three numbers of a line; false where it holds none.
bool read_line(std::string_view line, const std::string& where, std::array<double, 3>& numbers) {
  line = line.substr(0, line.find('#'));
  std::size_t count = 0;
  for (std::size_t at = line.find_first_not_of(kSeparators); at != line.npos;
       at = line.find_first_not_of(kSeparators, at)) {
    const std::size_t end = std::min(line.find_first_of(kSeparators, at), line.size());
    const std::string_view word = line.substr(at, end - at);
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    double number = 0;
    const auto [stop, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || stop != digits.data() + digits.size() ||
        !(std::abs(number) <= kLargest))
      throw ConfigError(
          fmt::format("{}: {}: expected a number, {:g} .. {:g}", where, word, -kLargest, kLargest));
    if (count == numbers.size())
      throw ConfigError(where + ": more than three numbers: nominal, forward, reverse");
    numbers[count++] = number;
    at = end;
  }
  if (count != 0 && count != numbers.size())
    throw ConfigError(where + ": expected three numbers: nominal, forward, reverse");
  return count != 0;
}

}  // namespace

void parse_compensation_points(std::string_view text, const std::string& name,
                               CompensationTable& table) {
  const Unit position = CompensationTable::rotary(table.over) ? unit::deg : unit::mm;
  const Unit value = CompensationTable::rotary(table.axis) ? unit::deg : unit::mm;
  const bool trim = table.file_type == CompensationTable::FileType::trim;
  table.at.clear();
  table.error.clear();
  table.error_reverse.clear();
  int number = 1;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string where = fmt::format("{}:{}", name, number);
    std::array<double, 3> point{};
    if (read_line(text.substr(begin, end - begin), where, point)) {
      if (!trim && table.axis != table.over)
        throw ConfigError(where +
                          ": positions of another axis than the one that is corrected; "
                          "file_type must be \"trim\"");
      const auto error = [&](double v) { return (trim ? -v : v - point[0]) * value.to_si; };
      table.at.push_back(point[0] * position.to_si);
      table.error.push_back(error(point[1]));
      table.error_reverse.push_back(error(point[2]));
      const std::size_t n = table.at.size();
      if (n > 1 && !(table.at[n - 2] < table.at[n - 1]))
        throw ConfigError(where + ": positions must ascend");
    }
    begin = end + 1;
  }
  if (table.at.size() < 2)
    throw ConfigError(name + ": holds fewer than two points, lines of nominal, forward, reverse");
}

}  // namespace vcnc
