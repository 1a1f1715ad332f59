// The reference page of all keys, written from the same declarations that the reader uses.
#include <fmt/format.h>

#include "configs/config.hpp"
#include "configs/import_map.hpp"
#include "configs/scenario.hpp"
#include "configs/toml_writer.hpp"

namespace vcnc {

namespace {

class Reference {
 public:
  void operator()(std::string_view key, const double& v, Unit u, Range r, const char* doc) {
    row(key, limits(r), fmt::format("{:.10g}", v / u.to_si), doc);
  }
  void operator()(std::string_view key, const Vec3& v, Unit u, Range r, const char* doc) {
    row(key, "3 x " + limits(r),
        fmt::format("[{}, {}, {}]", toml_number(v.x(), u), toml_number(v.y(), u),
                    toml_number(v.z(), u)),
        doc);
  }
  void operator()(std::string_view key, const std::vector<double>&, Unit, Range r,
                  const char* doc) {
    row(key, "list of " + limits(r), "[]", doc);
  }
  void operator()(std::string_view key, const std::vector<Vec3>&, Unit, Range r, const char* doc) {
    row(key, "list of 3 x " + limits(r), "[]", doc);
  }
  void operator()(std::string_view key, const int& v, Range r, const char* doc) {
    row(key, limits(r), std::to_string(v), doc);
  }
  void operator()(std::string_view key, const bool& v, const char* doc) {
    row(key, "true, false", v ? "true" : "false", doc);
  }
  void operator()(std::string_view key, const std::string& v, const char* doc) {
    row(key, "text", fmt::format("\"{}\"", v), doc);
  }
  void operator()(std::string_view key, const std::vector<std::string>&, const char* doc) {
    row(key, "list of texts", "[]", doc);
  }
  template <class Enum>
  void choice(std::string_view key, const Enum& v,
              std::initializer_list<std::pair<const char*, Enum>> names, const char* doc) {
    std::string all, mine;
    for (const auto& [name, value] : names) {
      all += (all.empty() ? "" : ", ") + std::string(name);
      if (value == v) mine = name;
    }
    row(key, all, mine, doc);
  }
  template <class T, class... Args>
  void group(std::string_view key, const T& v, const char* doc, Args... args) {
    section(key, doc, [&](Reference& r) { T::fields(v, r, args...); });
  }
  /// Effects have pages of their own (docs/effects.md): `vcnc effects` knows their keys.
  template <class T, class... Args>
  void effect(std::string_view, const T&, const char*, Args...) {}
  template <class T>
  void list(std::string_view key, const std::vector<T>&, const char* doc) {
    const T element;
    rows_ += fmt::format("| `[[{}{}]]` | array of tables | [] | {} |\n", path_, key, doc);
    section(key, doc, [&](Reference& r) { T::fields(element, r); });
  }
  template <class F>
  void section(std::string_view key, const char*, F&& f) {
    const std::string outer = path_;
    path_ += std::string(key) + ".";
    f(*this);
    path_ = outer;
  }

  std::string text() const {
    return "| key | allowed | default | meaning |\n|---|---|---|---|\n" + rows_;
  }

 private:
  static std::string limits(Range r) { return fmt::format("{:g} .. {:g}", r.min, r.max); }
  void row(std::string_view key, const std::string& allowed, const std::string& value,
           const char* doc) {
    rows_ += fmt::format("| `{}{}` | {} | {} | {} |\n", path_, key, allowed, value, doc);
  }
  std::string path_, rows_;
};

template <class T>
std::string reference_of() {
  Reference r;
  const T defaults;
  T::fields(defaults, r);
  return r.text();
}

}  // namespace

std::string machine_key_reference() {
  return reference_of<Machine>() +
         "\nEvery effect has keys of its own, `effects.PLACE.NAME.KEY`: "
         "[effects.md](effects.md), `vcnc effects`.\nThe keys of a law end in the units that "
         "belong to what it depends on and where it acts, see there.\n";
}
std::string piece_key_reference() { return reference_of<PieceParams>(); }
std::string import_map_key_reference() { return reference_of<ImportMap>(); }
std::string scenario_key_reference() { return reference_of<Scenario>(); }

}  // namespace vcnc
