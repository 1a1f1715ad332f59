#include "diagnosis/report/shown_law.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"

namespace vcnc {

Shown shown_covariate(Covariate of, bool rotary) {
  const std::string length = rotary ? "deg" : "mm";
  const double factor = rotary ? 1 / kDegree : 1e3;
  switch (of) {
    case Covariate::time:
      return {"time", "s", 1};
    case Covariate::position:
      return {"position", length, factor};
    case Covariate::velocity:
      return {"speed", length + "/s", factor};
    case Covariate::acceleration:
      return {"acceleration", length + "/s^2", factor};
    case Covariate::sign:
    case Covariate::forwards:
    case Covariate::backwards:
      break;
  }
  return {"direction", "1", 1};
}

Shown shown_value(const Law& law) {
  const bool rotary = is_rotary(law.axis_index());
  Shown y;
  switch (law.point) {
    case Law::Point::motor_force:
    case Law::Point::table_force:
      y = {"force", rotary ? "N m" : "N", 1};
      break;
    case Law::Point::command_time:
      y = {"time", "us", 1e6};
      break;
    case Law::Point::reading:
      y = {"reading", "um", 1e6};
      break;
    case Law::Point::command:
    case Law::Point::displacement:
      y = {"displacement", rotary ? "arcsec" : "um", rotary ? 3600 / kDegree : 1e6};
  }
  if (!law.grows()) return y;
  const Shown per = shown_covariate(law.times, is_rotary(static_cast<std::size_t>(law.times_axis)));
  return {y.name, y.unit + " per " + per.unit, y.factor / per.factor};
}

std::string law_words(const std::vector<LearnedLaw>& laws) {
  std::string words;
  for (const LearnedLaw& law : laws)
    words += words.empty() ? "behaves like " + law.words : " and like " + law.words;
  return words;
}

std::string law_numbers(const LearnedLaw& learned) {
  const Law& law = learned.law;
  if (law.value.empty()) return "";
  const Shown x = shown_covariate(law.over, is_rotary(static_cast<std::size_t>(law.over_axis))),
              y = shown_value(law);
  if (law.jumps()) {
    const auto half_width = [&](std::size_t i) { return (learned.high[i] - learned.low[i]) / 2; };
    const double by = law.value[1] - law.value[0],
                 within = std::hypot(half_width(0), half_width(1));
    return fmt::format("by {:.3g} [{:.3g} .. {:.3g}] {}", by * y.factor, (by - within) * y.factor,
                       (by + within) * y.factor, y.unit);
  }
  const auto [least, most] = std::minmax_element(law.value.begin(), law.value.end());
  const auto one = [&](std::vector<double>::const_iterator at) {
    const auto i = static_cast<std::size_t>(at - law.value.begin());
    return fmt::format("{:.3g} [{:.3g} .. {:.3g}] {} at {:.4g} {}", *at * y.factor,
                       learned.low[i] * y.factor, learned.high[i] * y.factor, y.unit,
                       law.at[i] * x.factor, x.unit);
  };
  return fmt::format("f is least {}, most {}", one(least), one(most));
}

}  // namespace vcnc
