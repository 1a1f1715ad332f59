#include "apps/path_writer.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "model/fields.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kChunk = 1 << 16;
constexpr double kStep = 1e-8;  ///< resolution of the numbers
constexpr std::array<std::string_view, 4> kSpindle{"off", "cw", "ccw", "orient"};

std::string escaped(std::string_view s) {
  std::string result;
  for (const char c : s) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') result += '\\';
    if (byte >= 0x20 && byte < 0x7f) {
      result += c;
    } else {
      constexpr std::string_view hex = "0123456789abcdef";
      result += "\\u00";
      result += hex[byte >> 4];
      result += hex[byte & 15];
    }
  }
  return result;
}

}  // namespace

PathWriter::PathWriter(std::FILE* file, std::string_view program, const Machine& machine)
    : file_(file), kinematics_(machine.kinematics), map_(kinematics_, frame_) {
  buffer_.reserve(2 * kChunk);
  text("{\"program\": \"");
  text(escaped(program));
  text("\", \"unit\": \"mm, deg, mm/min, s\", \"segments\": [");
}

void PathWriter::flush() {
  std::fwrite(buffer_.data(), 1, buffer_.size(), file_);
  buffer_.clear();
}

/// Fixed point with 8 decimals, trailing zeros left out.
void PathWriter::number(double value) {
  if (!(std::abs(value) < 1e9)) {
    std::array<char, 32> wide;
    const auto [end, error] = std::to_chars(wide.data(), wide.data() + wide.size(), value);
    text({wide.data(), static_cast<std::size_t>(end - wide.data())});
    return;
  }
  const auto scaled = static_cast<std::int64_t>(std::llround(value / kStep));
  const bool negative = scaled < 0;
  auto rest = static_cast<std::uint64_t>(negative ? -scaled : scaled);
  std::array<char, 24> digits;
  std::size_t at = digits.size();
  int decimals = 8;
  for (; decimals > 0 && rest % 10 == 0; --decimals) rest /= 10;
  for (const bool point = decimals > 0; decimals > 0; --decimals) {
    digits[--at] = static_cast<char>('0' + rest % 10);
    rest /= 10;
    if (decimals == 1 && point) digits[--at] = '.';
  }
  do {
    digits[--at] = static_cast<char>('0' + rest % 10);
    rest /= 10;
  } while (rest > 0);
  if (negative) digits[--at] = '-';
  text({digits.data() + at, digits.size() - at});
}

void PathWriter::point(std::string_view key, const double* values, std::size_t count) {
  constexpr std::array<std::string_view, kAxisCount> names{
      "\"X\": ", ", \"Y\": ", ", \"Z\": ", ", \"A\": ", ", \"C\": "};
  text(key);
  for (std::size_t i = 0; i < count; ++i) {
    text(names[i]);
    number(values[i] / (is_rotary(i) ? kDegree : 1e-3));
  }
  text("}");
}

void PathWriter::begin(std::string_view type, int line) {
  text(first_ ? "\n{\"type\": \"" : ",\n{\"type\": \"");
  first_ = false;
  text(type);
  text("\", \"line\": ");
  std::array<char, 12> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), line);
  text({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

void PathWriter::add(const Move& move) {
  const bool arc = move.kind == Move::Kind::arc;
  begin(move.probe != Move::Probe::none  ? "probe"
        : arc                            ? "arc"
        : move.kind == Move::Kind::rapid ? "rapid"
                                         : "line",
        move.line);
  if (!(move.frame == frame_)) {
    frame_ = move.frame;
    map_ = FrameMap(kinematics_, frame_);
  }
  if (frame_.rtcp) {
    const Coordinates axes = map_.to_axes(move.end);
    point(", \"end\": {", axes.data(), kAxisCount);
    point(", \"tip\": {", move.end.data(), 3);
  } else {
    point(", \"end\": {", move.end.data(), kAxisCount);
  }
  if (arc) {
    Vec3 centre = move.arc.centre;
    const auto n = static_cast<Eigen::Index>(move.arc.normal);
    centre[n] = move.end[n];
    point(", \"centre\": {", centre.data(), 3);
    text(", \"plane\": ");
    number(static_cast<double>(19 - move.arc.normal));
    text(", \"turns\": ");
    number(move.arc.sweep / (2 * kPi));
  }
  if (move.feed_mode != Move::Feed::none) {
    text(", \"feed\": ");
    if (move.feed_mode == Move::Feed::time) {
      number(60 / move.feed);
      text(", \"feed_mode\": \"inverse_time\"");
    } else if (move.feed_per_turn > 0) {
      number(move.feed_per_turn * 1e3);
      text(", \"feed_mode\": \"per_turn\"");
    } else if (move.feed_mode == Move::Feed::rotary) {
      number(move.feed * 60 / kDegree);
      text(", \"feed_mode\": \"rotary_per_minute\"");
    } else {
      number(move.feed * 60e3);
      text(", \"feed_mode\": \"per_minute\"");
    }
  }
  text("}");
}

void PathWriter::add(const Block& block) {
  if (const Move* move = std::get_if<Move>(&block)) {
    add(*move);
  } else if (const Dwell* dwell = std::get_if<Dwell>(&block)) {
    begin("dwell", dwell->line);
    text(", \"seconds\": ");
    number(dwell->seconds);
    text("}");
  } else if (const SpindleWord* spindle = std::get_if<SpindleWord>(&block)) {
    begin("spindle", spindle->line);
    text(", \"mode\": \"");
    text(kSpindle[static_cast<std::size_t>(spindle->mode)]);
    text("\", \"rpm\": ");
    number(spindle->speed / unit::rpm.to_si);
    if (spindle->surface) {
      text(", \"surface_m_min\": ");
      number(spindle->surface->speed * 60);
      text(", \"max_rpm\": ");
      number(spindle->surface->most / unit::rpm.to_si);
    }
    text("}");
  } else if (const ProgramStop* stop = std::get_if<ProgramStop>(&block)) {
    begin("stop", stop->line);
    text(stop->optional ? ", \"optional\": true}" : ", \"optional\": false}");
  }
  if (buffer_.size() > kChunk) flush();
}

void PathWriter::end(std::string_view refused) {
  text("\n], \"refused\": ");
  if (refused.empty()) {
    text("null");
  } else {
    text("\"");
    text(escaped(refused));
    text("\"");
  }
  text("}\n");
  flush();
  std::fflush(file_);
}

}  // namespace vcnc
