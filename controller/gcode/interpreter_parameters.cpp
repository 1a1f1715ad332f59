// The parameters that belong to the control: offsets, positions, modes. Lengths in the parameters
// of offsets and references are in mm, positions in the unit of the program, angles in degrees.
//
//   #5061-5070  probed point, 1 if it was touched       #5161-5169, #5181-5189  G28, G30 position
//   #5210       G92 is active   #5211-5219  its shift    #5220  number of the work offset
//   #5221-5230  G54 (X Y Z A B C U V W, rotation), #5241.. G55, ... #5381-5390 G59.3
//   #5399 M66   #5400 tool   #5401-5409 its offset   #5410 its diameter   #5420-5428 position
// In Fanuc programs axes are counted X Y Z A C:
//   #4001-4022  modal G codes   #4107 D  #4109 F  #4111 H  #4114 N  #4119 S  #4120 T
//   #5001.. #5041.. position in the work offset   #5021.. in the machine   #5061.. skip position
//   #4130 P of G54.1   #7001-7005 offset of G54.1 P1, #7021.. P2, ... #7941.. P48
//   #2001..     tool lengths    #11001.. are not there
// Source: LinuxCNC user manual, "Parameters"; Fanuc series 30i, custom macro, system variables.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr double kMm = 1e-3;

/// Row of the n-th axis of X Y Z A B C U V W, or -1.
Eigen::Index ngc_axis(int n) {
  constexpr std::array<Eigen::Index, 9> rows{0, 1, 2, 3, -1, 4, -1, -1, -1};
  return n >= 0 && n < 9 ? rows[static_cast<std::size_t>(n)] : -1;
}

double unit_of(Eigen::Index row) { return row >= 3 ? kDegree : kMm; }

}  // namespace

/// A number that a program may also write; null: none. `to_si` is the unit of the parameter.
double* ProgramRun::system_value(int number, double& to_si) {
  if (fanuc_ && NcData::is_further_offset(number)) {
    const int n = (number - NcData::kFirstFurther) % NcData::kPerSystem;
    if (n >= static_cast<int>(kAxisCount)) return nullptr;
    to_si = unit_of(n);
    return kept_value(number);
  }
  const auto of = [&](Coordinates& x, int n) -> double* {
    const Eigen::Index row = fanuc_ ? (n < 5 ? n : -1) : ngc_axis(n);
    if (row < 0) return nullptr;
    to_si = unit_of(row);
    return &x[row];
  };
  if (number >= 5161 && number <= 5169) return of(home_, number - 5161);
  if (number >= 5181 && number <= 5189) return of(second_home_, number - 5181);
  if (number >= 5211 && number <= 5219) return of(work_.g92_kept, number - 5211);
  if (number >= 5221 && number <= 5390) {
    WorkOffset& offset = work_.systems[static_cast<std::size_t>((number - 5221) / 20)];
    const int n = (number - 5221) % 20;
    if (n == 9) {
      to_si = kDegree;
      return &offset.rotation;
    }
    return n < 9 ? of(offset.shift, n) : nullptr;
  }
  return nullptr;
}

// ------------------------------------------------------------------------------- what is kept

/// An offset or reference under its number in NcData [m, rad]; null: none.
double* ProgramRun::kept_value(int number) {
  const auto of = [](Coordinates& x, int n) {
    const Eigen::Index row = ngc_axis(n);
    return row < 0 ? nullptr : &x[row];
  };
  if (number >= 5161 && number <= 5169) return of(home_, number - 5161);
  if (number >= 5181 && number <= 5189) return of(second_home_, number - 5181);
  if (number >= 5211 && number <= 5219) return of(work_.g92_kept, number - 5211);
  if (NcData::is_further_offset(number)) {
    const int n = number - NcData::kFirstFurther;
    const auto system =
        WorkCoordinates::kSystems + static_cast<std::size_t>(n / NcData::kPerSystem);
    return n % NcData::kPerSystem < static_cast<int>(kAxisCount)
               ? &work_.systems[system].shift[n % NcData::kPerSystem]
               : nullptr;
  }
  if (number < 5221 || number > 5390) return nullptr;
  WorkOffset& offset = work_.systems[static_cast<std::size_t>((number - 5221) / 20)];
  const int n = (number - 5221) % 20;
  return n == 9 ? &offset.rotation : n < 9 ? of(offset.shift, n) : nullptr;
}

std::map<int, double> ProgramRun::offset_parameters() const {
  std::map<int, double> values;
  for (int number = 5161; number <= 5390; ++number)
    if (const double* value = const_cast<ProgramRun*>(this)->kept_value(number))
      values[number] = *value;
  for (int number = NcData::kFirstFurther; NcData::is_further_offset(number); ++number)
    if (const double* value = const_cast<ProgramRun*>(this)->kept_value(number))
      values[number] = *value;
  values[5210] = ended_ || work_.g92.isZero(0) ? 0 : 1;
  return values;
}

void ProgramRun::take_over(const NcData& data) {
  begin_offsets_ = offset_parameters();
  begin_tools_ = tools_.all();
  const KeptParameters own = kept_parameters(fanuc_);
  for (const auto& [number, value] : data.parameters) {
    if (double* offset = kept_value(number))
      *offset = value;
    else if (number >= own.first && number <= own.last)
      parameters_.write(number, value);
  }
  const auto active = data.parameters.find(5210);
  if (active != data.parameters.end() && active->second != 0) work_.g92 = work_.g92_kept;
  for (const auto& [number, tool] : data.tools) tools_.entry(number) = tool;
}

NcData ProgramRun::data() const {
  NcData data = options_.data;
  for (const auto& [number, value] : offset_parameters())
    if (data.parameters.contains(number) || begin_offsets_.at(number) != value)
      data.parameters[number] = value;
  const KeptParameters own = kept_parameters(fanuc_);
  for (int number = own.first; number <= own.last; ++number) {
    const double value = parameters_.read(number);
    if (!std::isfinite(value))
      data.parameters.erase(number);
    else
      data.parameters[number] = value;
  }
  for (const auto& [number, tool] : tools_.all()) {
    const auto begin = begin_tools_.find(number);
    const bool changed = begin == begin_tools_.end() || !(begin->second == tool);
    if (number > 0 && (changed || data.tools.contains(number)) &&
        (data.tools.size() < NcData::kMostTools || data.tools.contains(number)))
      data.tools[number] = tool;
  }
  return data;
}

std::optional<double> ProgramRun::read(int number) const {
  if (number < 2000) return std::nullopt;
  double to_si = 1;
  if (const double* value = const_cast<ProgramRun*>(this)->system_value(number, to_si))
    return *value / to_si;
  const auto in_words = [&](const Coordinates& x, Eigen::Index row) {
    return x[row] / (row >= 3 ? kDegree : modal_.length_unit);
  };
  const auto axis = [&](int n) { return fanuc_ ? (n < 5 ? n : -1) : ngc_axis(n); };
  const auto position = [&](int n) -> std::optional<double> {
    const Eigen::Index row = axis(n);
    return row < 0 ? 0 : in_words(work_.to_words(position_), row);
  };
  if (number >= 5061 && number <= 5069) {
    const Eigen::Index row = axis(number - 5061);
    return row < 0 ? 0 : in_words(probed_, row);
  }
  switch (number) {
    case 5070:
      return probe_success_;
    case 5210:
      return work_.g92.isZero(0) ? 0 : 1;
    case 4130:
      if (fanuc_ && work_.active >= WorkCoordinates::kSystems)
        return static_cast<double>(work_.active - WorkCoordinates::kSystems + 1);
      return fanuc_ ? std::optional<double>(0) : std::nullopt;
    case 5220:
      return static_cast<double>(work_.active + 1);
    case 5399:
      return input_;
    case 5400:
      return tool_in_spindle_;
    case 5410: {
      const ToolEntry* tool = tools_.find(tool_in_spindle_);
      return tool ? tool->diameter / modal_.length_unit : 0;
    }
    default:
      break;
  }
  if (number >= 5401 && number <= 5409) {
    const Eigen::Index row = ngc_axis(number - 5401);
    return row < 0 ? 0 : in_words(work_.tool, row);
  }
  if (number >= 5420 && number <= 5428) return position(number - 5420);
  if (!fanuc_) return std::nullopt;

  if (number >= 5001 && number <= 5005) return position(number - 5001);
  if (number >= 5041 && number <= 5045) return position(number - 5041);
  if (number >= 5021 && number <= 5025) return in_words(map_.to_axes(position_), number - 5021);
  if (number > 2000 && number <= 2200) {
    const ToolEntry* tool = tools_.find(number - 2000);
    return tool ? tool->offset[kZ] / modal_.length_unit : 0;
  }
  const auto tenths = [](int code) { return code / 10.0; };
  switch (number) {
    case 4001:
      return tenths(modal_.motion);
    case 4002:
      return static_cast<double>(19 - static_cast<int>(modal_.normal));
    case 4003:
      return modal_.absolute ? 90 : 91;
    case 4005:
      return tenths(modal_.feed);
    case 4006:
      return modal_.length_unit == kMm ? 21 : 20;
    case 4007:
      return compensation_.active() ? 41 : 40;
    case 4008:
      return modal_.length == GcodeModal::Length::none ? 49 : 43;
    case 4009:
      return modal_.motion >= 730 ? tenths(modal_.motion) : 80;
    case 4010:
      return modal_.to_initial ? 98 : 99;
    case 4012:
    case 4014:
      return work_.active < WorkCoordinates::kSystems ? static_cast<double>(54 + work_.active)
                                                      : 54.1;
    case 4107:
      return d_;
    case 4109:
      return modal_.linear_feed * 60 / modal_.length_unit;
    case 4111:
      return h_;
    case 4114:
      return number_;
    case 4119:
      return spindle_speed_at(position_[kX]) / unit::rpm.to_si;
    case 4120:
      return selected_tool_;
    default:
      return std::nullopt;
  }
}

bool ProgramRun::write(int number, double value) {
  if (number < 2000) return false;
  if (std::isnan(value)) value = 0;
  double to_si = 1;
  if (double* slot = system_value(number, to_si)) {
    *slot = value * to_si;
    // A macro's offset acts at once, one of NGC when its system is selected again.
    if (fanuc_ && number >= 5221 && !frame_.rtcp) work_.select(work_.active);
    return true;
  }
  if (fanuc_ && number > 2000 && number <= 2200) {
    tools_.entry(number - 2000).offset[kZ] = value * modal_.length_unit;
    return true;
  }
  const bool read_only =
      (number >= 5061 && number <= 5070) || (number >= 5400 && number <= 5428) || number == 5220;
  if (read_only) fail(fmt::format("#{} belongs to the control and cannot be set", number));
  return false;
}

/// Of Siemens: positions in the work offset (W) and in the machine (M), where the axes are (I) and
/// what was measured (M).
std::optional<double> ProgramRun::siemens_variable(std::string_view name) const {
  if (name == "ac_mea[1]") return probe_success_;
  if (name.size() != 8 || !name.starts_with("aa_") || name[5] != '[') return std::nullopt;
  const std::size_t axis = kAxisLetters.find(upper(name[6]));
  const std::string_view which = name.substr(3, 2);
  if (axis == std::string_view::npos || name[7] != ']') return std::nullopt;
  const Coordinates x = which == "iw"   ? work_.to_words(position_)
                        : which == "im" ? map_.to_axes(position_)
                        : which == "mw"
                            ? probed_
                            : Coordinates(Eigen::Map<const Coordinates>(probing_.found.data()));
  if (which != "iw" && which != "im" && which != "mw" && which != "mm") return std::nullopt;
  return x[static_cast<Eigen::Index>(axis)] / (is_rotary(axis) ? kDegree : modal_.length_unit);
}

std::optional<double> ProgramRun::read(std::string_view name) const {
  const auto is = [&](std::string_view other) { return name == other; };
  const Coordinates words = work_.to_words(position_);
  if (is("_x")) return words[0] / modal_.length_unit;
  if (is("_y")) return words[1] / modal_.length_unit;
  if (is("_z")) return words[2] / modal_.length_unit;
  if (is("_a")) return words[3] / kDegree;
  if (is("_c")) return words[4] / kDegree;
  if (is("_value")) return returned_.value_or(0);
  if (is("_value_returned")) return returned_ ? 1 : 0;
  if (is("_feed")) {
    if (modal_.feed == 930) return modal_.linear_feed * 60;
    return modal_.linear_feed / modal_.length_unit * (modal_.feed == 950 ? 1 : 60);
  }
  if (is("_rpm")) return spindle_speed_at(position_[kX]) / unit::rpm.to_si;
  if (is("_metric")) return modal_.length_unit == kMm;
  if (is("_imperial")) return modal_.length_unit != kMm;
  if (is("_absolute")) return modal_.absolute;
  if (is("_incremental")) return !modal_.absolute;
  if (is("_inverse_time")) return modal_.feed == 930;
  if (is("_units_per_minute")) return modal_.feed == 940;
  if (is("_units_per_rev")) return modal_.feed == 950;
  if (is("_coord_system")) {
    const int n = static_cast<int>(work_.active);
    return n < 6 ? 540 + 10 * n : 590 + (n - 5);
  }
  if (is("_motion_mode")) return modal_.motion;
  if (is("_plane")) return 190 - 10 * static_cast<int>(modal_.normal);
  if (is("_selected_tool")) return selected_tool_;
  if (is("_current_tool")) return tool_in_spindle_;
  if (is("_current_pocket") || is("_selected_pocket")) return selected_tool_;
  if (is("_tool_offset")) return modal_.length != GcodeModal::Length::none;
  if (is("_ccomp")) return compensation_.active() ? 1 : 400;
  if (is("_retract_old_z")) return modal_.to_initial;
  if (is("_retract_r_plane")) return !modal_.to_initial;
  if (is("_spindle_on")) return modal_.spindle == 3 || modal_.spindle == 4;
  if (is("_spindle_cw")) return modal_.spindle == 3;
  if (is("_mist") || is("_flood") || is("_task") || is("_line")) return 0;
  if (name.starts_with("_$")) return siemens_variable(name.substr(2));
  if (is("_call_level")) return static_cast<double>(calls_.size());
  if (is("_vmajor")) return 2;
  if (is("_vminor")) return 9;
  return std::nullopt;
}

}  // namespace vcnc
