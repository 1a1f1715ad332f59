// Parameters declared once: key, unit, allowed range and meaning stand beside the member.
//
// A parameter struct has one static template `fields(self, visit)` that shows every member to a
// visitor. From that one list come the keys of a machine file, `--set`, range checks, unit
// conversion, the resolved file saved with each run and the generated reference page.
//
//   struct Backlash {
//     double gap_m = 0;
//     template <class Self, class Visit>
//     static void fields(Self& p, Visit& visit) {
//       visit("gap_um", p.gap_m, unit::um, {0, 1000}, "lost motion between motor and table");
//     }
//   };
//
// A visitor offers these overloads (Self may be const for writers):
//   visit(key, double&, Unit, Range, doc)        number; the file holds it in the key's unit
//   visit(key, Vec3&, Unit, Range, doc)          array of three numbers
//   visit(key, std::vector<double>&, Unit, Range, doc)
//   visit(key, std::vector<Vec3>&, Unit, Range, doc)   array of [x, y, z]
//   visit(key, int&, Range, doc)                 whole number
//   visit(key, bool&, doc)
//   visit(key, std::string&, doc)
//   visit.choice(key, Enum&, {{"name", Enum::value}, ...}, doc)
//   visit.group(key, T&, doc, args...)           nested struct: T::fields(t, visit, args...)
//   visit.section(key, doc, f)                   nested table: f(visitor)
//   visit.effect(key, E&, doc, args...)          as group; written only where not as by default
//   visit.list(key, std::vector<T>&, doc)        array of tables: T::fields(t, visit) each
#pragma once

#include <limits>
#include <string_view>

#include "model/math.hpp"

namespace vcnc {

/// A unit as it is written at the end of a key, and its factor to SI.
struct Unit {
  std::string_view suffix;
  double to_si;
};

/// Allowed values, in the key's own unit, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

namespace unit {
inline constexpr Unit none{"", 1};
inline constexpr Unit m{"m", 1}, mm{"mm", 1e-3}, um{"um", 1e-6}, nm{"nm", 1e-9};
inline constexpr Unit rad{"rad", 1}, deg{"deg", kDegree}, arcsec{"arcsec", kDegree / 3600};
inline constexpr Unit mm_s{"mm_s", 1e-3}, mm_s2{"mm_s2", 1e-3}, mm_s3{"mm_s3", 1e-3};
inline constexpr Unit deg_s{"deg_s", kDegree}, deg_s2{"deg_s2", kDegree}, deg_s3{"deg_s3", kDegree};
inline constexpr Unit mm_min{"mm_min", 1e-3 / 60};
inline constexpr Unit s{"s", 1}, ms{"ms", 1e-3}, us{"us", 1e-6}, ns{"ns", 1e-9};
inline constexpr Unit per_s{"per_s", 1}, hz{"Hz", 1}, khz{"kHz", 1e3};
inline constexpr Unit kg{"kg", 1}, g{"g", 1e-3}, kgm2{"kgm2", 1};
inline constexpr Unit newton{"N", 1}, newton_m{"Nm", 1}, volt{"V", 1}, mv{"mV", 1e-3};
inline constexpr Unit n_per_um{"N_per_um", 1e6}, n_per_mm{"N_per_mm", 1e3};
inline constexpr Unit n_s_per_m{"Ns_per_m", 1}, nm_per_rad{"Nm_per_rad", 1};
inline constexpr Unit nm_s_per_rad{"Nms_per_rad", 1};
inline constexpr Unit rpm{"rpm", 2 * kPi / 60}, mbit_s{"Mbit_s", 1e6};
inline constexpr Unit joule{"J", 1}, watt{"W", 1};
}  // namespace unit

}  // namespace vcnc
