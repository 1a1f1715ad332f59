#include "model/parameters.hpp"

#include <cmath>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace vcnc {
namespace {

struct Collected {
  std::vector<Parameter> numbers;
  std::vector<WholeParameter> whole;
};

/// A visitor of fields() that keeps every number.
class Collector {
 public:
  explicit Collector(Collected& all) : all_(all) {}

  void operator()(std::string_view key, double& v, Unit u, Range r, const char*) {
    all_.numbers.push_back({path_ + std::string(key), &v, u, r});
  }
  void operator()(std::string_view key, Vec3& v, Unit u, Range r, const char*) {
    for (Eigen::Index i = 0; i < 3; ++i)
      all_.numbers.push_back({path_ + std::string(key) + "." + "xyz"[i], &v[i], u, r});
  }
  void operator()(std::string_view, std::vector<double>&, Unit, Range, const char*) {}
  void operator()(std::string_view, std::vector<Vec3>&, Unit, Range, const char*) {}
  void operator()(std::string_view key, int& v, Range r, const char*) {
    all_.whole.push_back({path_ + std::string(key), &v, r});
  }
  void operator()(std::string_view, bool&, const char*) {}
  void operator()(std::string_view, std::string&, const char*) {}
  template <class Enum>
  void choice(std::string_view, Enum&, std::initializer_list<std::pair<const char*, Enum>>,
              const char*) {}
  template <class T>
  void list(std::string_view, std::vector<T>&, const char*) {}
  template <class T, class... Args>
  void group(std::string_view key, T& v, const char* doc, Args... args) {
    section(key, doc, [&](Collector& inner) { T::fields(v, inner, args...); });
  }
  template <class T, class... Args>
  void effect(std::string_view key, T& v, const char* doc, Args... args) {
    group(key, v, doc, args...);
  }
  template <class F>
  void section(std::string_view key, const char*, F&& f) {
    const std::string outer = path_;
    path_ += std::string(key) + ".";
    f(*this);
    path_ = outer;
  }

 private:
  Collected& all_;
  std::string path_;
};

/// A visitor of fields() that keeps the number of one key, and looks nowhere else.
class Finder {
 public:
  explicit Finder(std::string_view key) : rest_(key) {}

  std::optional<Parameter> number;
  std::optional<WholeParameter> whole;

  void operator()(std::string_view key, double& v, Unit u, Range r, const char*) {
    if (rest_ == key) number = Parameter{"", &v, u, r};
  }
  void operator()(std::string_view key, Vec3& v, Unit u, Range r, const char*) {
    if (rest_.size() != key.size() + 2 || !rest_.starts_with(key)) return;
    for (Eigen::Index i = 0; i < 3; ++i)
      if (rest_.ends_with(std::string{'.', "xyz"[i]})) number = Parameter{"", &v[i], u, r};
  }
  void operator()(std::string_view, std::vector<double>&, Unit, Range, const char*) {}
  void operator()(std::string_view, std::vector<Vec3>&, Unit, Range, const char*) {}
  void operator()(std::string_view key, int& v, Range r, const char*) {
    if (rest_ == key) whole = WholeParameter{"", &v, r};
  }
  void operator()(std::string_view, bool&, const char*) {}
  void operator()(std::string_view, std::string&, const char*) {}
  template <class Enum>
  void choice(std::string_view, Enum&, std::initializer_list<std::pair<const char*, Enum>>,
              const char*) {}
  template <class T>
  void list(std::string_view, std::vector<T>&, const char*) {}
  template <class T, class... Args>
  void group(std::string_view key, T& v, const char* doc, Args... args) {
    section(key, doc, [&](Finder& inner) { T::fields(v, inner, args...); });
  }
  template <class T, class... Args>
  void effect(std::string_view key, T& v, const char* doc, Args... args) {
    group(key, v, doc, args...);
  }
  template <class F>
  void section(std::string_view key, const char*, F&& f) {
    if (rest_.size() <= key.size() || !rest_.starts_with(key) || rest_[key.size()] != '.') return;
    const std::string_view outer = rest_;
    rest_.remove_prefix(key.size() + 1);
    f(*this);
    rest_ = outer;
  }

 private:
  std::string_view rest_;  ///< of the key, within the section that is looked at
};

Finder found(Machine& machine, std::string_view key) {
  Finder finder(key);
  Machine::fields(machine, finder);
  if (finder.number) finder.number->key = key;
  if (finder.whole) finder.whole->key = key;
  return finder;
}

Collected collected(Machine& machine) {
  Collected all;
  Collector collector(all);
  Machine::fields(machine, collector);
  return all;
}

}  // namespace

std::vector<Parameter> parameters(Machine& machine) { return collected(machine).numbers; }

std::vector<WholeParameter> whole_parameters(Machine& machine) { return collected(machine).whole; }

std::optional<Parameter> find_parameter(Machine& machine, std::string_view key) {
  return found(machine, key).number;
}

std::optional<WholeParameter> find_whole_parameter(Machine& machine, std::string_view key) {
  return found(machine, key).whole;
}

void set_parameter(Machine& machine, const std::string& key, double value) {
  const std::optional<Parameter> p = find_parameter(machine, key);
  if (!p) throw std::invalid_argument(key + ": is not a number of a machine file");
  if (!(std::isfinite(value) && value >= p->range.min && value <= p->range.max)) {
    std::ostringstream text;
    text << key << ": " << value << " is out of range, allowed " << p->range.min << " .. "
         << p->range.max << (p->unit.suffix.empty() ? "" : " ") << p->unit.suffix;
    throw std::invalid_argument(text.str());
  }
  *p->value = value * p->unit.to_si;
}

}  // namespace vcnc
