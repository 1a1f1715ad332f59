#include "controller/gcode/nc_data.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>

#include "controller/state_bytes.hpp"

namespace vcnc {

namespace {

constexpr std::uint64_t kDataVersion = 2;
constexpr int kFirstReference = 5161, kFirstOffset = 5221, kLastOffset = 5390;
constexpr int kPerSystem = NcData::kPerSystem;
constexpr int kG92Active = 5210, kRotation = 9, kLinearAxes = 3;

void write(const NcData& data, StateWriter& out) {
  out.number(data.parameters.size(), 4);
  for (const auto& [number, value] : data.parameters) {
    out.number(static_cast<std::uint64_t>(number), 2);
    out.real(value);
  }
  out.number(data.tools.size(), 4);
  for (const auto& [number, tool] : data.tools) {
    out.number(static_cast<std::uint64_t>(number), 4);
    for (const double x : tool.offset) out.real(x);
    out.real(tool.diameter);
  }
}

NcData read(StateReader& in) {
  NcData data;
  for (std::uint64_t count = in.number(4); count > 0 && !in.bad(); --count) {
    const int number = static_cast<int>(in.number(2));
    in.require(number < 10'000 &&
               number > (data.parameters.empty() ? 0 : data.parameters.rbegin()->first));
    data.parameters[number] = in.real();
  }
  const std::uint64_t tools = in.number(4);
  in.require(tools <= NcData::kMostTools);
  for (std::uint64_t count = tools; count > 0 && !in.bad(); --count) {
    const std::uint64_t number = in.number(4);
    const int last = data.tools.empty() ? 0 : data.tools.rbegin()->first;
    in.require(number > static_cast<std::uint64_t>(last) && number <= ToolTable::kLast);
    ToolEntry& tool = data.tools[static_cast<int>(number)];
    for (double& x : tool.offset) x = in.real();
    tool.diameter = in.real();
  }
  return data;
}

void write(const std::vector<ProbeTouch>& touches, StateWriter& out) {
  out.number(touches.size(), 4);
  for (const ProbeTouch& touch : touches) {
    out.number(static_cast<std::uint64_t>(touch.line), 4);
    out.number(touch.touched, 1);
    out.real(touch.at);
    for (const AxisVector* q : {&touch.target, &touch.found, &touch.rest})
      for (const double x : *q) out.real(x);
  }
}

std::vector<ProbeTouch> read_touches(StateReader& in) {
  std::vector<ProbeTouch> touches;
  for (std::uint64_t count = in.number(4); count > 0 && !in.bad(); --count) {
    ProbeTouch& touch = touches.emplace_back();
    const std::uint64_t line = in.number(4), touched = in.number(1);
    in.require(line <= std::numeric_limits<int>::max() && touched <= 1);
    touch.line = static_cast<int>(line);
    touch.touched = touched == 1;
    touch.at = in.real();
    in.require(touch.at >= 0);
    for (AxisVector* q : {&touch.target, &touch.found, &touch.rest})
      for (double& x : *q) x = in.real();
  }
  return touches;
}

std::string system_name(int system) {
  return system < 6 ? fmt::format("G{}", 54 + system) : fmt::format("G59.{}", system - 5);
}

}  // namespace

double NcData::unit_of(int number) {
  if (is_further_offset(number))
    return (number - kFirstFurther) % kPerSystem < kLinearAxes ? 1e-3 : kDegree;
  if (number < kFirstReference || number > kLastOffset || number == kG92Active) return 1;
  const int n = number >= kFirstOffset ? (number - kFirstOffset) % kPerSystem : (number - 1) % 10;
  return n < kLinearAxes ? 1e-3 : kDegree;
}

std::vector<std::uint8_t> encode_nc_data(const KeptNcData& data) {
  StateWriter out;
  out.number(kDataVersion, 1);
  write(data.begin, out);
  write(data.now, out);
  write(data.touches, out);
  return out.take();
}

std::optional<KeptNcData> decode_nc_data(std::span<const std::uint8_t> bytes) {
  StateReader in(bytes);
  const std::uint64_t version = in.number(1);
  in.require(version == 1 || version == kDataVersion);
  KeptNcData data;
  data.begin = read(in);
  data.now = read(in);
  if (version == kDataVersion) data.touches = read_touches(in);
  if (!in.whole()) return std::nullopt;
  return data;
}

std::string to_text(const NcData& data) {
  constexpr std::array letters{'X', 'Y', 'Z', 'A', 'B', 'C', 'U', 'V', 'W', 'R'};
  std::map<std::string, std::string> places;
  std::size_t plain = 0;
  for (const auto& [number, value] : data.parameters) {
    std::string name;
    int n = (number - 1) % 10;
    if (number >= kFirstOffset && number <= kLastOffset) {
      name = system_name((number - kFirstOffset) / kPerSystem);
      n = (number - kFirstOffset) % kPerSystem;
    } else if (NcData::is_further_offset(number)) {
      constexpr std::string_view kFurtherLetters = "XYZAC";
      n = (number - NcData::kFirstFurther) % kPerSystem;
      if (n >= static_cast<int>(kFurtherLetters.size())) continue;
      places[fmt::format("G54.1 P{}", (number - NcData::kFirstFurther) / kPerSystem + 1)] +=
          fmt::format(" {}{:.4f}", kFurtherLetters[static_cast<std::size_t>(n)],
                      value / NcData::unit_of(number));
      continue;
    } else if (number > kG92Active && number < kFirstOffset) {
      name = "G92";
    } else if (number >= 5181 && number < 5190) {
      name = "G30";
    } else if (number >= kFirstReference && number < 5170) {
      name = "G28";
    } else {
      plain += number != kG92Active;
      continue;
    }
    if (n > kRotation) continue;
    places[name] += fmt::format(" {}{:.4f}", letters[static_cast<std::size_t>(n)],
                                value / NcData::unit_of(number));
  }
  std::string text;
  for (const auto& [name, values] : places)
    text += fmt::format("{:<13}{}\n", name, values.substr(1));
  for (const auto& [number, tool] : data.tools) {
    text += fmt::format("{:<13}", fmt::format("tool {}", number));
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const double x = tool.offset[static_cast<Eigen::Index>(i)];
      if (x != 0 || i == kZ)
        text += fmt::format("{}{:.4f} ", kAxisNames[i], x / (is_rotary(i) ? kDegree : 1e-3));
    }
    text += fmt::format("D{:.4f}\n", tool.diameter * 1e3);
  }
  if (plain > 0) text += fmt::format("parameters   {} set\n", plain);
  return text;
}

std::string to_var_file(const NcData& data) {
  std::string text;
  for (const auto& [number, value] : data.parameters)
    text += fmt::format("{}\t{:.9g}\n", number, value / NcData::unit_of(number));
  return text;
}

}  // namespace vcnc
