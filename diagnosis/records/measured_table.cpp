#include "diagnosis/records/measured_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

#include "analysis/hdf5_columns.hpp"
#include "analysis/recording.hpp"
#include "diagnosis/records/record.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;
using Separator = ImportMap::Separator;

constexpr std::uintmax_t kLargestTable = 4'000'000'000;
constexpr std::size_t kMostColumns = 10'000;

constexpr bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::string shortened(std::string_view text) {
  constexpr std::size_t kMost = 40;
  std::string result;
  for (const char c : text.substr(0, kMost))
    result += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  return text.size() > kMost ? result + "..." : result;
}

std::optional<double> number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.empty() || !(text[0] == '-' || text[0] == '.' || (text[0] >= '0' && text[0] <= '9')))
    return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

/// "1,5" as 1.5; a point, as between thousands, is none of it.
std::optional<double> comma_number(std::string_view text) {
  if (text.find('.') != text.npos) return std::nullopt;
  std::string pointed(text);
  if (const std::size_t comma = pointed.find(','); comma != pointed.npos) pointed[comma] = '.';
  return number(pointed);
}

/// "1,5": a number, if the comma were a point.
bool has_decimal_comma(std::string_view text) {
  return text.find(',') != text.npos && comma_number(text).has_value();
}

class TextTable {
 public:
  TextTable(std::string_view text, const std::string& name, const TextFormat& format)
      : text_(text), name_(name), format_(format), separator_(format.separator) {
    table_.source = name;
  }

  MeasuredTable read() {
    if (decimal_comma() && separator_ == Separator::comma)
      throw MeasurementError(name_ +
                             ": commas cannot both separate values and begin decimals; the map "
                             "says so (separator, decimal)");
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
    if (text_.substr(0, 2) == "\xFF\xFE" || text_.substr(0, 2) == "\xFE\xFF")
      fail(1, "is UTF-16 text; save it as UTF-8 or ASCII");
    while (!text_.empty()) take_line();
    if (table_.rows() == 0) check_decimals();
    if (table_.rows() == 0)
      throw MeasurementError(
          name_ + ": holds no numbers" +
          (fields_.size() == 1 && format_.separator != Separator::any
               ? fmt::format("; its lines are one value each, divided by '{}' as the map says "
                             "(separator)",
                             separator_sign())
               : ""));
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& reason) const {
    throw MeasurementError(fmt::format("{}:{}: {}", name_, line, reason));
  }

  /// Why no line holds numbers, where the map says that commas begin decimals.
  void check_decimals() const {
    if (!decimal_comma() || fields_.empty()) return;
    if (fields_.size() == 1 && fields_[0].find(',') != std::string::npos)
      fail(last_line_,
           fmt::format("\"{}\" is one value where commas begin decimals, as the map says "
                       "(decimal = \"comma\"): values must be separated by semicolons, tabs or "
                       "spaces then",
                       shortened(fields_[0])));
    for (const std::string& f : fields_)
      if (f.find('.') != std::string::npos && number(f))
        fail(last_line_, fmt::format("\"{}\" has a decimal point; the map says decimal = \"comma\"",
                                     shortened(f)));
  }

  void take_line() {
    const std::size_t end = std::min(text_.find('\n'), text_.size());
    const std::string_view line = trimmed_end(text_.substr(0, end));
    text_.remove_prefix(std::min(end + 1, text_.size()));
    ++line_;
    if (line.find('\r') != line.npos)
      fail(line_, "lines end with a carriage return alone; end them with a line feed");
    const std::string_view content = trimmed(line);
    if (content.empty() || (line_ == 1 && tells_separator(content))) return;
    if (content.front() == '#' || content.front() == '%') {
      if (!begun_) remark_ = std::string(trimmed(content.substr(1)));
      return;
    }
    if (separator_ == Separator::any) separator_ = told_separator(line);
    split(line);
    last_line_ = line_;
    if (!begun_)
      begin();
    else if (!heading_rows_over_ && is_units())
      take_units();
    else
      take_row();
  }

  /// "sep=;" in front of all, from a spreadsheet.
  bool tells_separator(std::string_view line) {
    if (line.size() != 5 || !(line.starts_with("sep=") || line.starts_with("SEP="))) return false;
    if (separator_ == Separator::any && line[4] == ',') separator_ = Separator::comma;
    if (separator_ == Separator::any && line[4] == ';') separator_ = Separator::semicolon;
    return true;
  }

  static std::string_view trimmed_end(std::string_view line) {
    while (!line.empty() && (line.back() == '\r' || line.back() == '\0')) line.remove_suffix(1);
    return line;
  }

  Separator told_separator(std::string_view line) const {
    std::array<std::size_t, 3> count{};
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (quoted) continue;
      count[0] += c == ';';
      count[1] += c == '\t';
      count[2] += c == ',';
    }
    // A decimal comma stands beside semicolons or tabs, never the other way round.
    if (count[0] > 0) return Separator::semicolon;
    if (count[1] > 0) return Separator::tab;
    if (count[2] > 0 && !decimal_comma()) return Separator::comma;
    return Separator::space;
  }

  bool decimal_comma() const { return format_.decimal == ImportMap::Decimal::comma; }
  std::optional<double> number_of(std::string_view text) const {
    return decimal_comma() ? comma_number(text) : number(text);
  }

  char separator_sign() const {
    switch (separator_) {
      case Separator::semicolon:
        return ';';
      case Separator::tab:
        return '\t';
      case Separator::space:
        return ' ';
      case Separator::comma:
      case Separator::any:
        break;
    }
    return ',';
  }

  void split(std::string_view line) {
    fields_.clear();
    const char sign = separator_sign();
    std::size_t i = 0;
    const auto between = [&](char c) { return sign == ' ' ? c == ' ' || c == '\t' : c == sign; };
    const auto blank = [&](char c) { return is_space(c) && c != sign; };
    while (true) {
      while (i < line.size() && (sign == ' ' ? is_space(line[i]) : blank(line[i]))) ++i;
      if (sign == ' ' && i >= line.size()) break;
      std::string field;
      if (i < line.size() && line[i] == '"') {
        ++i;
        for (;; ++i) {
          if (i >= line.size()) fail(line_, "a quote is not closed");
          if (line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"')
            field += line[i++];
          else if (line[i] == '"')
            break;
          else
            field += line[i];
        }
        ++i;
        while (i < line.size() && blank(line[i])) ++i;
        if (i < line.size() && !between(line[i]))
          fail(line_, "text behind a closing quote; expected a separator");
      } else {
        const std::size_t from = i;
        while (i < line.size() && !between(line[i])) ++i;
        field = trimmed(line.substr(from, i - from));
      }
      fields_.push_back(std::move(field));
      if (fields_.size() > kMostColumns)
        fail(line_, fmt::format("more than {} values in one line", kMostColumns));
      if (i >= line.size()) break;
      ++i;
    }
  }

  bool missing(std::string_view text) const {
    if (text.empty()) return true;
    for (const std::string& own : format_.missing)
      if (text == own) return true;
    for (const std::string_view known : {"nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL"})
      if (text == known) return true;
    return false;
  }

  bool is_heading() const {
    bool text = false;
    for (const std::string& f : fields_) {
      if (number_of(f)) return false;
      text = text || (!missing(f) && !has_decimal_comma(f));
    }
    return text;
  }

  /// The unit of a number that has none is 1.
  bool is_units() const {
    const auto is_text = [&](const std::string& f) {
      return !missing(f) && !number_of(f) && !has_decimal_comma(f);
    };
    const auto may_be = [&](const std::string& f) { return f == "1" || !number_of(f); };
    return std::any_of(fields_.begin(), fields_.end(), is_text) &&
           std::all_of(fields_.begin(), fields_.end(), may_be);
  }

  void take_units() {
    for (std::size_t i = 0; i < std::min(fields_.size(), table_.columns.size()); ++i)
      table_.columns[i].unit = fields_[i];
  }

  /// Whether the remark above the first row may name columns; then these are its fields.
  bool remark_splits() {
    try {
      split(remark_);
    } catch (const MeasurementError&) {  // quotes of its own
      return false;
    }
    return !remark_.empty();
  }

  void begin() {
    begun_ = true;
    const bool heading = is_heading();
    std::vector<std::string> names = fields_;
    if (!heading) {
      const std::size_t columns = fields_.size();
      const std::vector<std::string> values = std::move(fields_);
      if (!remark_splits() || fields_.size() != columns || !is_heading()) {
        fields_.clear();
        for (std::size_t i = 0; i < columns; ++i) fields_.push_back(std::to_string(i + 1));
      }
      names = fields_;
      fields_ = values;
    }
    for (std::string& n : names) table_.columns.emplace_back().name = std::move(n);
    if (heading && table_.columns.size() > 1 && table_.columns.back().name.empty())
      table_.columns.pop_back();  // a separator at the end of every line
    if (!heading) take_row();
  }

  void take_row() {
    heading_rows_over_ = true;
    const std::size_t expected = table_.columns.size();
    if (fields_.size() == expected + 1 && fields_.back().empty()) fields_.pop_back();
    if (fields_.size() != expected) {
      const bool commas = separator_ == Separator::comma && fields_.size() > expected;
      fail(line_,
           fmt::format("{} values, expected {}{}", fields_.size(), expected,
                       commas ? "; if the numbers have decimal commas, another sign must separate "
                                "them: export the table with semicolons or points"
                       : table_.rows() == 0 ? "; remarks above the line of names need a # in front"
                                            : ""));
    }
    for (std::size_t i = 0; i < expected; ++i) {
      MeasuredColumn& column = table_.columns[i];
      const std::string& text = fields_[i];
      const auto value = missing(text) ? std::optional(kMissing) : number_of(text);
      if (!value && has_decimal_comma(text))
        fail(line_,
             fmt::format("\"{}\" in column \"{}\" has a decimal comma; if all numbers have, say so "
                         "in the map: decimal = \"comma\"",
                         shortened(text), shortened(column.name)));
      if (!value && column.bad_line == 0) {
        column.bad_line = line_;
        column.bad_text = shortened(text);
      }
      column.value.push_back(value.value_or(kMissing));
    }
    table_.line.push_back(line_);
  }

  std::string_view text_;
  const std::string& name_;
  const TextFormat& format_;
  Separator separator_;
  MeasuredTable table_;
  std::vector<std::string> fields_;
  std::string remark_;
  std::size_t line_ = 0, last_line_ = 0;
  bool begun_ = false, heading_rows_over_ = false;
};

std::string read_text(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error))
    throw MeasurementError(path + ": is a folder, expected a table (CSV or HDF5)");
  if (!fs::exists(path, error)) throw MeasurementError(path + ": no such file");
  if (!fs::is_regular_file(path, error))
    throw MeasurementError(path + ": is not a regular file, expected a table (CSV or HDF5)");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) throw MeasurementError(path + ": cannot be read: " + error.message());
  if (size > kLargestTable)
    throw MeasurementError(path + ": is larger than 4 GB, too large for a text table; use HDF5");
  std::ifstream in(path, std::ios::binary);
  std::string text(size, '\0');
  if (!in || !in.read(text.data(), static_cast<std::streamsize>(size)))
    throw MeasurementError(path + ": cannot be read");
  return text;
}

}  // namespace

std::string MeasuredTable::place(std::size_t row) const {
  return row < line.size() ? fmt::format("{}:{}", source, line[row])
                           : fmt::format("{}: row {}", source, row + 1);
}

MeasuredTable parse_text_table(std::string_view text, const std::string& name,
                               const TextFormat& format) {
  return TextTable(text, name, format).read();
}

MeasuredTable read_measured_table(const std::string& path, const TextFormat& format) {
  if (!looks_like_hdf5(path)) return parse_text_table(read_text(path), path, format);
  MeasuredTable table;
  table.source = path;
  try {
    for (Hdf5Column& column : read_hdf5_columns(path))
      table.columns.push_back({.name = std::move(column.name), .value = std::move(column.value)});
  } catch (const RecordingError& e) {
    throw MeasurementError(e.what());
  }
  for (MeasuredColumn& c : table.columns)
    for (double& v : c.value)
      if (!std::isfinite(v)) v = kMissing;
  if (table.columns.empty()) throw MeasurementError(path + ": holds no columns of numbers");
  return table;
}

}  // namespace vcnc
