// Writes parameter structs as TOML: a visitor for the fields() of model/fields.hpp.
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "model/fields.hpp"

namespace vcnc {

/// Number in the unit of its key, as the shortest decimal that reads back as the same double
/// after conversion to SI.
std::string toml_number(double si, Unit unit);

class TomlWriter {
 public:
  void operator()(std::string_view key, const double& v, Unit u, Range, const char*) {
    line(key, toml_number(v, u));
  }
  void operator()(std::string_view key, const Vec3& v, Unit u, Range, const char*) {
    line(key, vec(v, u));
  }
  void operator()(std::string_view key, const std::vector<double>& v, Unit u, Range, const char*) {
    std::string text;
    for (double x : v) text += (text.empty() ? "" : ", ") + toml_number(x, u);
    line(key, "[" + text + "]");
  }
  void operator()(std::string_view key, const std::vector<Vec3>& v, Unit u, Range, const char*) {
    std::string text;
    for (const Vec3& x : v) text += (text.empty() ? "" : ", ") + vec(x, u);
    line(key, "[" + text + "]");
  }
  void operator()(std::string_view key, const int& v, Range, const char*) {
    line(key, std::to_string(v));
  }
  void operator()(std::string_view key, const bool& v, const char*) {
    line(key, v ? "true" : "false");
  }
  void operator()(std::string_view key, const std::string& v, const char*);
  void operator()(std::string_view key, const std::vector<std::string>& v, const char*);

  template <class Enum>
  void choice(std::string_view key, const Enum& v,
              std::initializer_list<std::pair<const char*, Enum>> names, const char*) {
    for (const auto& [name, value] : names)
      if (value == v) line(key, fmt::format("\"{}\"", name));
  }
  template <class T, class... Args>
  void group(std::string_view key, const T& v, const char* doc, Args... args) {
    section(key, doc, [&](TomlWriter& w) { T::fields(v, w, args...); });
  }
  template <class T, class... Args>
  void effect(std::string_view key, const T& v, const char* doc, Args... args) {
    TomlWriter mine, null;
    T::fields(v, mine, args...);
    const T by_default{};
    T::fields(by_default, null, args...);
    if (mine.lines_ != null.lines_) group(key, v, doc, args...);
  }
  template <class T>
  void list(std::string_view key, const std::vector<T>& v, const char*) {
    for (const T& element : v) {
      TomlWriter inner;
      T::fields(element, inner);
      tables_.push_back(fmt::format("\n[[{}]]\n{}", full(key), inner.lines_));
    }
  }
  template <class F>
  void section(std::string_view key, const char*, F&& f) {
    TomlWriter inner;
    inner.path_ = full(key);
    f(inner);
    if (!inner.lines_.empty())
      tables_.push_back(fmt::format("\n[{}]\n{}", inner.path_, inner.lines_));
    tables_.insert(tables_.end(), inner.tables_.begin(), inner.tables_.end());
  }

  std::string text() const;
  /// Without the tables that `other` has with the same values.
  std::string text_beyond(const TomlWriter& other) const;

 private:
  static std::string quoted(const std::string& v);
  static std::string vec(const Vec3& v, Unit u) {
    return fmt::format("[{}, {}, {}]", toml_number(v.x(), u), toml_number(v.y(), u),
                       toml_number(v.z(), u));
  }
  std::string full(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }
  void line(std::string_view key, const std::string& value) {
    lines_ += fmt::format("{} = {}\n", key, value);
  }

  std::string path_, lines_;
  std::vector<std::string> tables_;  ///< each with its heading
};

}  // namespace vcnc
