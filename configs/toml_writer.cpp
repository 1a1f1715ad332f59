#include "configs/toml_writer.hpp"

#include <algorithm>
#include <cmath>

#include "configs/config.hpp"

namespace vcnc {

namespace {

/// Decimal text of a finite double that TOML reads as a float.
std::string decimal(double v) {
  std::string text = fmt::format("{}", v);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

}  // namespace

std::string toml_number(double si, Unit unit) {
  if (unit.to_si == 1 || si == 0) return decimal(si);
  // The quotient may be one unit in the last place off; a neighbour then reads back exactly.
  const double value = si / unit.to_si;
  for (double candidate : {std::round(value * 1e9) / 1e9, value, std::nextafter(value, -HUGE_VAL),
                           std::nextafter(value, HUGE_VAL)})
    if (candidate * unit.to_si == si) return decimal(candidate);
  return decimal(value);
}

std::string TomlWriter::quoted(const std::string& v) {
  std::string escaped;
  for (char c : v) {
    if (c == '"' || c == '\\') escaped += '\\';
    if (static_cast<unsigned char>(c) < 0x20)
      escaped += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    else
      escaped += c;
  }
  return "\"" + escaped + "\"";
}

void TomlWriter::operator()(std::string_view key, const std::string& v, const char*) {
  line(key, quoted(v));
}

void TomlWriter::operator()(std::string_view key, const std::vector<std::string>& v, const char*) {
  std::string text;
  for (const std::string& x : v) text += (text.empty() ? "" : ", ") + quoted(x);
  line(key, "[" + text + "]");
}

std::string TomlWriter::text() const { return text_beyond({}); }

std::string TomlWriter::text_beyond(const TomlWriter& other) const {
  std::string text = lines_;
  for (const std::string& table : tables_)
    if (std::find(other.tables_.begin(), other.tables_.end(), table) == other.tables_.end())
      text += table;
  return text;
}

std::string to_toml(const Machine& machine) {
  TomlWriter w;
  Machine::fields(machine, w);
  return w.text();
}

std::string brief_toml(const Machine& machine) {
  TomlWriter w, by_default;
  Machine::fields(machine, w);
  const Machine nothing_declared;
  Machine::fields(nothing_declared, by_default);
  return w.text_beyond(by_default);
}

std::string to_toml(const PieceParams& piece) {
  TomlWriter w;
  PieceParams::fields(piece, w);
  return w.text();
}

}  // namespace vcnc
