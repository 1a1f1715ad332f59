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

/// A visitor of fields() that keeps every number, or that of one key and looks nowhere else.
class Collector {
 public:
  explicit Collector(Collected& all) : all_(all) {}
  Collector(Collected& all, std::string_view key) : all_(all), rest_(key) {}

  void operator()(std::string_view key, double& v, Unit u, Range r, const char*) {
    if (is_wanted(key)) all_.numbers.push_back({path_ + std::string(key), &v, u, r});
  }
  void operator()(std::string_view key, Vec3& v, Unit u, Range r, const char*) {
    if (rest_ && !rest_->starts_with(key)) return;
    for (Eigen::Index i = 0; i < 3; ++i)
      if (const std::string component = std::string(key) + "." + "xyz"[i]; is_wanted(component))
        all_.numbers.push_back({path_ + component, &v[i], u, r});
  }
  void operator()(std::string_view, std::vector<double>&, Unit, Range, const char*) {}
  void operator()(std::string_view, std::vector<Vec3>&, Unit, Range, const char*) {}
  void operator()(std::string_view key, int& v, Range r, const char*) {
    if (is_wanted(key)) all_.whole.push_back({path_ + std::string(key), &v, r});
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
    const std::optional<std::string_view> outer_rest = rest_;
    if (rest_) {
      if (rest_->size() <= key.size() || !rest_->starts_with(key) || (*rest_)[key.size()] != '.')
        return;
      rest_->remove_prefix(key.size() + 1);
    }
    const std::string outer = path_;
    path_ += std::string(key) + ".";
    f(*this);
    path_ = outer;
    rest_ = outer_rest;
  }

 private:
  bool is_wanted(std::string_view key) const { return !rest_ || *rest_ == key; }

  Collected& all_;
  std::string path_;
  std::optional<std::string_view> rest_;  ///< of the one key, within the section; empty: all are
};

Collected collected(Machine& machine) {
  Collected all;
  Collector collector(all);
  Machine::fields(machine, collector);
  return all;
}

/// Of one key.
Collected collected(Machine& machine, std::string_view key) {
  Collected all;
  Collector collector(all, key);
  Machine::fields(machine, collector);
  return all;
}

template <class T>
std::optional<T> only(std::vector<T> found) {
  if (found.empty()) return std::nullopt;
  return std::move(found.front());
}

}  // namespace

std::vector<Parameter> parameters(Machine& machine) { return collected(machine).numbers; }

std::vector<WholeParameter> whole_parameters(Machine& machine) { return collected(machine).whole; }

std::optional<Parameter> find_parameter(Machine& machine, std::string_view key) {
  return only(collected(machine, key).numbers);
}

std::optional<WholeParameter> find_whole_parameter(Machine& machine, std::string_view key) {
  return only(collected(machine, key).whole);
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
