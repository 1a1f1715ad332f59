#include "configs/config.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "configs/compensation_file.hpp"
#include "configs/import_map.hpp"
#include "configs/scenario.hpp"
#include "configs/spelling.hpp"
#include "model/parameters.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

std::string where(const toml::node& node) {
  const toml::source_region& source = node.source();
  const std::string name = source.path ? *source.path : std::string("?");
  if (name.starts_with("--")) return name;
  return fmt::format("{}:{}", name, source.begin.line);
}

[[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& reason) {
  throw ConfigError(fmt::format("{}: {}: {}", where(node), key, reason));
}

/// Reads a TOML table into a struct by visiting its fields.
class Reader {
 public:
  Reader(const toml::table& table, std::string path) : table_(table), path_(std::move(path)) {}

  void operator()(std::string_view key, double& v, Unit u, Range r, const char*) {
    if (const toml::node* n = find(key)) v = number(*n, full(key), u, r);
  }
  void operator()(std::string_view key, Vec3& v, Unit u, Range r, const char*) {
    if (const toml::node* n = find(key)) v = vec(*n, full(key), u, r);
  }
  void operator()(std::string_view key, std::vector<double>& v, Unit u, Range r, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    v.clear();
    for (const toml::node& element : array(*n, full(key), "an array of numbers"))
      v.push_back(number(element, full(key), u, r));
  }
  void operator()(std::string_view key, std::vector<Vec3>& v, Unit u, Range r, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    v.clear();
    for (const toml::node& element : array(*n, full(key), "an array of [x, y, z]"))
      v.push_back(vec(element, full(key), u, r));
  }
  void operator()(std::string_view key, int& v, Range r, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    const auto value = n->value_exact<std::int64_t>();
    if (!value) fail(*n, full(key), "expected a whole number");
    check_range(*n, full(key), static_cast<double>(*value), unit::none, r);
    v = static_cast<int>(*value);
  }
  void operator()(std::string_view key, bool& v, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    const auto value = n->value_exact<bool>();
    if (!value) fail(*n, full(key), "expected true or false");
    v = *value;
  }
  void operator()(std::string_view key, std::string& v, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    const auto value = n->value_exact<std::string>();
    if (!value) fail(*n, full(key), "expected a text in quotes");
    v = *value;
  }
  void operator()(std::string_view key, std::vector<std::string>& v, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    v.clear();
    for (const toml::node& element : array(*n, full(key), "an array of texts")) {
      const auto value = element.value_exact<std::string>();
      if (!value) fail(element, full(key), "expected a text in quotes");
      v.push_back(*value);
    }
  }
  template <class Enum>
  void choice(std::string_view key, Enum& v,
              std::initializer_list<std::pair<const char*, Enum>> names, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    const auto text = n->value_exact<std::string>();
    std::string allowed;
    for (const auto& [name, value] : names) {
      if (text && *text == name) {
        v = value;
        return;
      }
      allowed += fmt::format("{}\"{}\"", allowed.empty() ? "" : ", ", name);
    }
    fail(*n, full(key), fmt::format("expected one of {}", allowed));
  }
  template <class T, class... Args>
  void group(std::string_view key, T& v, const char* doc, Args... args) {
    section(key, doc, [&](Reader& inner) { T::fields(v, inner, args...); });
  }
  template <class T, class... Args>
  void effect(std::string_view key, T& v, const char* doc, Args... args) {
    group(key, v, doc, args...);
  }
  template <class T>
  void list(std::string_view key, std::vector<T>& v, const char*) {
    const toml::node* n = find(key);
    if (!n) return;
    v.clear();
    for (const toml::node& element : array(*n, full(key), "an array of tables")) {
      if (!element.is_table()) fail(element, full(key), "expected a table");
      Reader inner(*element.as_table(), full(key));
      T::fields(v.emplace_back(), inner);
      inner.refuse_unknown_keys();
    }
  }
  template <class F>
  void section(std::string_view key, const char*, F&& f) {
    static const toml::table kEmpty;
    const toml::node* n = find(key);
    if (n && !n->is_table()) fail(*n, full(key), "expected a table");
    Reader inner(n ? *n->as_table() : kEmpty, full(key));
    f(inner);
    inner.refuse_unknown_keys();
  }

  /// Where the keys of this table stand, for checks that need more than one of them.
  void lines(KeyLines& where) const {
    where[""] = static_cast<int>(table_.source().begin.line);
    for (const auto& [key, node] : table_)
      where[std::string(key.str())] = static_cast<int>(node.source().begin.line);
  }

  void refuse_unknown_keys() const {
    for (const auto& [key, node] : table_) {
      if (known_.contains(std::string(key.str()))) continue;
      fail(node, full(key.str()), "unknown key" + suggestion(key.str()));
    }
  }

 private:
  const toml::node* find(std::string_view key) {
    known_.insert(std::string(key));
    return table_.get(key);
  }
  std::string full(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }

  /// A key with the same stem and another unit, else the nearest spelling, else all keys.
  std::string suggestion(std::string_view wrong) const {
    const auto stem = [](std::string_view k) { return k.substr(0, k.find('_')); };
    const std::string* best = nullptr;
    std::size_t best_cost = ~std::size_t{0};
    for (const std::string& k : known_) {
      const std::size_t edits = edit_distance(wrong, k);
      const bool same_stem = stem(k) == stem(wrong);
      if (!same_stem && edits > wrong.size() / 3) continue;
      const std::size_t cost = 2 * edits + (same_stem ? 0 : 1);
      if (cost < best_cost) best_cost = cost, best = &k;
    }
    if (best) return fmt::format("; did you mean {}?", *best);
    std::string all;
    for (const std::string& k : known_) all += (all.empty() ? "" : ", ") + k;
    return "; allowed here: " + all;
  }

  static void check_range(const toml::node& n, const std::string& key, double v, Unit u, Range r) {
    if (!(v >= r.min && v <= r.max))
      fail(n, key,
           fmt::format("{} is out of range, allowed {} .. {}{}{}", v, r.min, r.max,
                       u.suffix.empty() ? "" : " ", u.suffix));
  }
  static double number(const toml::node& n, const std::string& key, Unit u, Range r) {
    const auto value = n.value<double>();
    if (!value || !n.is_number())
      fail(n, key,
           fmt::format("expected a number{}{}, {} .. {}", u.suffix.empty() ? "" : " in ", u.suffix,
                       r.min, r.max));
    if (!std::isfinite(*value)) fail(n, key, "expected a finite number");
    check_range(n, key, *value, u, r);
    return *value * u.to_si;
  }
  static const toml::array& array(const toml::node& n, const std::string& key, const char* what) {
    if (!n.is_array()) fail(n, key, fmt::format("expected {}", what));
    return *n.as_array();
  }
  static Vec3 vec(const toml::node& n, const std::string& key, Unit u, Range r) {
    const toml::array& a = array(n, key, "an array [x, y, z]");
    if (a.size() != 3) fail(n, key, fmt::format("expected 3 numbers, found {}", a.size()));
    return {number(a[0], key, u, r), number(a[1], key, u, r), number(a[2], key, u, r)};
  }

  const toml::table& table_;
  std::string path_;
  std::set<std::string> known_;
};

constexpr std::uintmax_t kLargestFile = 4'000'000;
constexpr std::ptrdiff_t kDeepest = 64;

/// Points that may separate the parts of a key: all of a line but the decimal points of numbers.
std::ptrdiff_t key_points(std::string_view line) {
  const auto digit = [&](std::size_t i) {
    return i < line.size() && line[i] >= '0' && line[i] <= '9';
  };
  std::ptrdiff_t points = 0;
  bool fraction = false;  // a second point makes a number a key again
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '.') {
      const bool decimal = i > 0 && digit(i - 1) && digit(i + 1) && !fraction;
      points += decimal ? 0 : 1;
      fraction = decimal;
    } else if (!digit(i)) {
      fraction = false;
    }
  }
  return points;
}

/// The parser recurses with the depth of dotted keys and brackets; no file of ours is that deep.
void refuse_deep_lines(std::string_view text, const std::string& name) {
  int line = 1;
  for (std::size_t at = 0; at < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view one = text.substr(at, end - at);
    const std::size_t first = one.find_first_not_of(" \t");
    const bool comment = first != one.npos && one[first] == '#';
    if (!comment && key_points(one) > kDeepest)
      throw ConfigError(fmt::format("{}:{}: a key of more than {} parts", name, line, kDeepest));
    at = end + 1;
  }
}

toml::table parse(std::string_view text, const std::string& name) {
  refuse_deep_lines(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& e) {
    throw ConfigError(fmt::format("{}:{}: {}", name, e.source().begin.line, e.description()));
  }
}

std::string read_file(const std::string& path, const char* kind = "TOML file") {
  std::error_code error;
  if (fs::is_directory(path, error))
    throw ConfigError(fmt::format("{}: is a directory, expected a {}", path, kind));
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    throw ConfigError(fmt::format("{}: is not a regular file, expected a {}", path, kind));
  if (fs::exists(path, error) && fs::file_size(path, error) > kLargestFile)
    throw ConfigError(
        fmt::format("{}: is larger than 4 MB, too large for a {} of ours", path, kind));
  std::ifstream in(path, std::ios::binary);
  if (!in) throw ConfigError(path + ": cannot be opened");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

template <class T>
T read(const toml::table& table) {
  T result;
  Reader reader(table, "");
  T::fields(result, reader);
  reader.refuse_unknown_keys();
  return result;
}

/// Moves `from` into `into` (a copy would forget where a value came from); later values win.
void merge(toml::table& into, toml::table&& from) {
  for (auto&& [key, node] : from) {
    toml::table* both = into[key].as_table();
    if (both && node.is_table())
      merge(*both, std::move(*node.as_table()));
    else
      into.insert_or_assign(key, std::move(node));
  }
}

/// KEY=VALUE of an option as a table; a value that is no TOML is a text. `name` is the option as it
/// was given.
toml::table parse_option(const std::string& key, const std::string& value,
                         const std::string& name) {
  refuse_deep_lines(key, name);
  refuse_deep_lines(value, name);
  try {
    return toml::parse(key + "=" + value, name);
  } catch (const toml::parse_error&) {
  }
  try {
    return toml::parse(fmt::format("{} = '''{}'''", key, value), name);
  } catch (const toml::parse_error&) {
    throw ConfigError(fmt::format(
        "{}: expected key=value with a key of words and points, and a number, true, false, a text "
        "or a list as value",
        name));
  }
}

toml::table parse_assignment(const std::string& assignment) {
  const std::string name = "--set " + assignment;
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    throw ConfigError(name + ": expected key=value, for example axes.Y.kv_per_s=38");
  return parse_option(assignment.substr(0, equals), assignment.substr(equals + 1), name);
}

/// What single ranges cannot say, of the machine as it is written.
void check_written(const Machine& m, const std::string& name) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisLimits& l = m.axes[i].limits;
    if (!(l.min < l.max))
      throw ConfigError(fmt::format(
          "{}: axes.{}: the lower travel limit must be below the upper one", name, kAxisNames[i]));
    if (l.start < l.min || l.start > l.max)
      throw ConfigError(fmt::format("{}: axes.{}: the start position is outside the travel limits",
                                    name, kAxisNames[i]));
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisEffects& e = m.effects.axis[i];
    const MechanicsParams& mass = m.axes[i].mechanics;
    if (!(e.get<Backlash>().null() && e.get<Windup>().null()) &&
        mass.reflected_inertia() <= 1e-3 * mass.load)
      throw ConfigError(
          fmt::format("{}: axes.{}.motor_inertia_kgm2: with backlash or windup the motor, seen "
                      "from the load, needs at "
                      "least a thousandth of the load's inertia",
                      name, kAxisNames[i]));
  }
  if (m.probe.adc_bits != 12 && m.probe.adc_bits != 16)
    throw ConfigError(fmt::format("{}: probe.adc_bits: {} is not possible, allowed 12 or 16", name,
                                  m.probe.adc_bits));
  if (const std::string objection = m.nc.compensation.objection(m.axes); !objection.empty())
    throw ConfigError(fmt::format("{}: nc.compensation.{}", name, objection));
  if (m.setup.predeflection >= m.probe.range)
    throw ConfigError(
        fmt::format("{}: setup.predeflection_mm: {:g} must be below probe.range_mm, {:g}", name,
                    m.setup.predeflection / unit::mm.to_si, m.probe.range / unit::mm.to_si));
}

/// The number whose key is spelled most like one that there is not: one that begins so, else the
/// nearest.
const Parameter& nearest_number(const std::vector<Parameter>& known, const std::string& key) {
  const auto off = [&](const Parameter& p) {
    return p.key.starts_with(key) ? 0 : edit_distance(key, p.key);
  };
  return *std::min_element(known.begin(), known.end(),
                           [&](const auto& a, const auto& b) { return off(a) < off(b); });
}

/// "file:line: key" of the i-th of an array of tables; of what was injected, "file: key".
std::string place_in(const toml::table& table, const std::string& key, std::size_t i,
                     const std::string& name) {
  const toml::node& node = *table.at_path(key).as_array()->get(i);
  return (node.source().path ? where(node) : name) + ": " + key;
}

/// Bounds that hold what is declared, of numbers that there are.
void check_uncertainties(const Machine& m, const toml::table& table, const std::string& name) {
  Machine copy = m;
  std::set<std::string> known;
  for (std::size_t i = 0; i < m.uncertainties.size(); ++i) {
    const Uncertainty& u = m.uncertainties[i];
    const std::string where = place_in(table, "uncertainty", i, name);
    if (u.key.empty()) throw ConfigError(where + ": key is missing");
    const std::optional<Parameter> number = find_parameter(copy, u.key);
    if (!number) {
      throw ConfigError(fmt::format("{}: {} is not a number of a machine file; did you mean {}?",
                                    where, u.key, nearest_number(parameters(copy), u.key).key));
    }
    if (!known.insert(u.key).second)
      throw ConfigError(fmt::format("{}: {} is given twice", where, u.key));
    if (u.between.empty()) continue;
    const double value = number->in_unit();
    if (u.between.size() != 2 || !(u.between[0] < u.between[1]))
      throw ConfigError(fmt::format("{}: {}: between: expected [least, most]", where, u.key));
    if (u.between[0] < number->range.min || u.between[1] > number->range.max)
      throw ConfigError(fmt::format("{}: {}: between: allowed {} .. {} {}", where, u.key,
                                    number->range.min, number->range.max, number->unit.suffix));
    if (value < u.between[0] || value > u.between[1])
      throw ConfigError(fmt::format("{}: {}: {:g} is declared, which is not between {:g} and {:g}",
                                    where, u.key, value, u.between[0], u.between[1]));
  }
}

/// The same of the machine as it is, and of what makes it so.
void check_whole(const Machine& m, const toml::table& table, const std::string& name) {
  check_written(m, name);
  check_uncertainties(m, table, name);
  for (std::size_t i = 0; i < m.effects.laws.size(); ++i)
    if (const std::string objection = m.effects.laws[i].objection(); !objection.empty())
      throw ConfigError(
          fmt::format("{} {}: {}", place_in(table, "effects.law", i, name), i + 1, objection));
  std::set<std::string> deviating;
  for (std::size_t i = 0; i < m.effects.deviations.size(); ++i) {
    const Deviation& deviation = m.effects.deviations[i];
    const std::string where = place_in(table, "effects.deviation", i, name);
    if (deviation.key.empty()) throw ConfigError(where + ": key is missing");
    if (std::isnan(deviation.value))
      throw ConfigError(fmt::format("{}: {}: value is missing", where, deviation.key));
    if (!deviating.insert(deviation.key).second)
      throw ConfigError(fmt::format("{}: {} is given twice", where, deviation.key));
  }
  if (m.effects.deviations.empty()) return;
  Machine is;
  try {
    is = actual(m);
  } catch (const std::invalid_argument& e) {
    throw ConfigError(fmt::format("{}: effects.deviation: {}", name, e.what()));
  }
  check_written(is, name + ": effects.deviation");
}

}  // namespace

namespace {

/// Keys that are neither an effect nor a number of the machine, as far as they are recognised.
void refuse_wrong_place(const std::string& key, const std::vector<Parameter>& known,
                        const std::string& name) {
  const std::string first = key.substr(0, key.find('.'));
  for (const char* table : {"axes", "kinematics", "spindle", "bus"}) {
    if (first != table) continue;
    std::vector<Parameter> declared = known;
    std::erase_if(declared, [](const Parameter& p) { return p.key.starts_with("effects."); });
    throw ConfigError(fmt::format("{}: {} is not a number of a machine file; did you mean {}?",
                                  name, key, nearest_number(declared, key).key));
  }
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (first != Effect::text.name) return;
    const std::string_view place =
        of_axis(Effect::place) ? (fits(Effect::place, false) ? "X" : "C") : key_of(Effect::place);
    throw ConfigError(
        fmt::format("{}: {} needs its place before it: {}.{}", name, first, place, key));
  });
}

/// Appends a number that is in truth another one.
void add_deviation(toml::table& table, const Parameter& number, double value,
                   const std::string& name) {
  if (!(value >= number.range.min && value <= number.range.max))
    throw ConfigError(fmt::format("{}: expected a number, {} .. {}{}{}", name, number.range.min,
                                  number.range.max, number.unit.suffix.empty() ? "" : " ",
                                  number.unit.suffix));
  toml::table deviation;
  deviation.insert("key", number.key);
  deviation.insert("value", value);
  toml::table* effects = table.emplace<toml::table>("effects").first->second.as_table();
  toml::array* all =
      effects ? effects->emplace<toml::array>("deviation").first->second.as_array() : nullptr;
  if (!all) throw ConfigError(name + ": effects.deviation is not an array of tables in the file");
  all->push_back(std::move(deviation));
}

/// As a key below [effects].
std::string below_effects(const std::string& key) {
  return key.starts_with("effects.") ? key : "effects." + key;
}

/// The numbers that a value gives; NaN for what is no number.
std::vector<double> numbers_of(const std::string& text, const std::string& name) {
  const auto number = [](const toml::node& node) {
    return node.is_number() ? *node.value<double>() : std::numeric_limits<double>::quiet_NaN();
  };
  const toml::table table = parse_option("value", text, name);
  const toml::node& value = *table.get("value");
  if (!value.is_array()) return {number(value)};
  std::vector<double> result;
  for (const toml::node& element : *value.as_array()) result.push_back(number(element));
  return result;
}

/// `--inject KEY=VALUE` as what it means: a key below [effects], or a deviation of a declared
/// number or vector.
void inject(toml::table& table, const std::string& injection) {
  const std::string name = "--inject " + injection;
  const std::size_t equals = injection.find('=');
  if (equals == std::string::npos || equals == 0)
    throw ConfigError(name + ": expected key=value, for example Y.backlash.gap_um=12");
  const std::string key = injection.substr(0, equals), text = injection.substr(equals + 1);
  refuse_deep_lines(injection, name);
  Machine plain;
  const std::vector<Parameter> known = parameters(plain);
  const auto find = [&](const std::string& wanted) {
    return std::find_if(known.begin(), known.end(),
                        [&](const Parameter& p) { return p.key == wanted; });
  };
  const auto number = find(key), vector = find(key + ".x");
  const bool effect = key.starts_with("effects.");
  if (!effect && number != known.end()) {
    const std::vector<double> values = numbers_of(text, name);
    add_deviation(table, *number,
                  values.size() == 1 ? values[0] : std::numeric_limits<double>::quiet_NaN(), name);
  } else if (!effect && vector != known.end()) {
    const std::vector<double> values = numbers_of(text, name);
    if (values.size() != 3)
      throw ConfigError(fmt::format(
          "{}: expected [x, y, z]{}{}, or one component: {}.x, {}.y, {}.z", name,
          vector->unit.suffix.empty() ? "" : " in ", vector->unit.suffix, key, key, key));
    for (std::size_t i = 0; i < 3; ++i)
      add_deviation(table, *find(key + "." + "xyz"[i]), values[i], name);
  } else {
    refuse_wrong_place(key, known, name);
    merge(table, parse_option(below_effects(key), text, name));
  }
}

/// An effect that is both set and injected, or injected twice, has no one value.
void refuse_doubles(const std::vector<std::string>& assignments,
                    const std::vector<std::string>& injections) {
  const auto key_of = [](const std::string& text) { return text.substr(0, text.find('=')); };
  std::set<std::string> set, injected;
  for (const std::string& assignment : assignments) set.insert(key_of(assignment));
  for (const std::string& injection : injections) {
    const std::string key = below_effects(key_of(injection));
    if (!injected.insert(key).second)
      throw ConfigError("--inject " + injection + ": the key is given twice");
    if (set.contains(key))
      throw ConfigError(
          fmt::format("--inject {}: the same is given by --set {}; one of them is too "
                      "many",
                      injection, key));
  }
}

/// Folders separated by ':', each as an absolute path.
std::string absolute_folders(const std::string& folders, const fs::path& base) {
  std::string absolute;
  for (std::size_t from = 0; from < folders.size();) {
    const std::size_t end = std::min(folders.find(':', from), folders.size());
    if (end > from) {
      const fs::path folder = (base / folders.substr(from, end - from)).lexically_normal();
      if (!absolute.empty()) absolute += ':';
      absolute += folder.string();
    }
    from = end + 1;
  }
  return absolute;
}

}  // namespace

namespace {

/// Tables that stand in a file of their own, relative to the machine file.
void load_tables(Machine& machine, const std::string& path) {
  for (CompensationTable& table : machine.nc.compensation.tables) {
    if (table.file.empty() || !table.at.empty()) continue;
    const std::string file = (fs::path(path).parent_path() / table.file).string();
    parse_compensation_points(read_file(file, "file of compensation points"), file, table);
    table.file.clear();
  }
}

}  // namespace

Machine load_machine(const std::string& path, const std::vector<std::string>& assignments,
                     const std::vector<std::string>& injections) {
  toml::table table = parse(read_file(path), path);
  if (table.empty())
    throw ConfigError(path + ": says nothing; a machine file has at least a name or an axis");
  const toml::node* file_piece = table["setup"]["piece"].node();
  fs::path base = file_piece ? fs::absolute(path).parent_path() : fs::current_path();
  fs::path program_base = fs::absolute(path).parent_path();
  for (const std::string& assignment : assignments) {
    toml::table one = parse_assignment(assignment);
    if (one["setup"]["piece"].node()) base = fs::current_path();
    if (one["nc"]["program_path"].node()) program_base = fs::current_path();
    merge(table, std::move(one));
  }
  refuse_doubles(assignments, injections);
  for (const std::string& injection : injections) inject(table, injection);
  Machine machine = read<Machine>(table);
  load_tables(machine, path);
  check_whole(machine, table, path);
  if (!machine.setup.piece.empty()) {
    std::error_code error;
    const fs::path piece = fs::weakly_canonical(base / machine.setup.piece, error);
    if (error)
      throw ConfigError(
          fmt::format("{}: setup.piece: {}: {}", path, machine.setup.piece, error.message()));
    machine.setup.piece = piece.string();
  }
  machine.nc.program_path = absolute_folders(machine.nc.program_path, program_base);
  return machine;
}

Machine parse_machine(std::string_view toml, const std::string& name) {
  const toml::table table = parse(toml, name);
  Machine machine = read<Machine>(table);
  check_whole(machine, table, name);
  return machine;
}

PieceParams load_piece(const std::string& path) { return parse_piece(read_file(path), path); }

PieceParams parse_piece(std::string_view toml, const std::string& name) {
  return read<PieceParams>(parse(toml, name));
}

ImportMap parse_import_map(std::string_view toml, const std::string& name) {
  const ImportMap map = read<ImportMap>(parse(toml, name));
  check_import_map(map, name);
  return map;
}

ImportMap load_import_map(const std::string& path) {
  ImportMap map = parse_import_map(read_file(path), path);
  if (!map.machine.empty())
    map.machine = fs::weakly_canonical(fs::absolute(path).parent_path() / map.machine).string();
  return map;
}

Scenario parse_scenario(std::string_view toml, const std::string& name) {
  const Scenario scenario = read<Scenario>(parse(toml, name));
  check_scenario(scenario, name);
  return scenario;
}

Scenario load_scenario(const std::string& path) {
  Scenario scenario = parse_scenario(read_file(path), path);
  const fs::path base = fs::absolute(path).parent_path();
  for (std::string* file : {&scenario.machine, &scenario.program})
    if (!file->empty()) *file = fs::weakly_canonical(base / *file).string();
  return scenario;
}

}  // namespace vcnc
