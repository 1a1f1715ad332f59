#include "controller/gcode/modal_codes.hpp"

#include <fmt/format.h>

#include <array>

namespace vcnc {

const char* const kKnownG =
    "G0 G1 G2 G3 G4 G5.1 G8 G9 G10 G15 G16 G17 G18 G19 G20 G21 G28 G28.1 G30 G30.1 G31 G33 G33.1 "
    "G38.2..G38.5 "
    "G40 G41 "
    "G41.1 G42 G42.1 G43 G43.1 G43.2 G43.4 G43.5 G49 G50 G50.1 G51 G51.1 G52 G53 G53.1 G54..G59.3 "
    "G54.1 G61 G61.1 G64 G65 "
    "G66 G67 G68 G68.2 G69 G73 G74 G76 G80..G89 G90 G90.1 G91 G91.1 G92 G92.1 G92.2 G92.3 G93 G94 "
    "G95 G96 G97 G98 G99";
const char* const kKnownM = "M0..M9 M19 M30 M48..M53 M60..M68 M70..M73 M98 M99";

namespace {

constexpr std::array<GGroup, 1000> make_g_groups() {
  std::array<GGroup, 1000> t{};
  const auto set = [&](GGroup group, auto... codes) {
    ((t[static_cast<std::size_t>(codes)] = group), ...);
  };
  set(GGroup::once, 40, 50, 51, 90, 100, 280, 281, 300, 301, 520, 530, 531, 650, 920, 921, 922,
      923);
  set(GGroup::motion, 0, 10, 20, 30, kCircleThroughPoint, kTangentialCircle, 310, 330, 331, 382,
      383, 384, 385, 730, 740, 760, 800, 810, 820, 830, 840, 850, 860, 870, 880, 890);
  set(GGroup::plane, 170, 180, 190);
  set(GGroup::distance, 900, 910);
  set(GGroup::arc_distance, 901, 911);
  set(GGroup::feed, 930, 940, 950);
  set(GGroup::units, 200, 210);
  set(GGroup::cutter, 400, 410, 411, 420, 421);
  set(GGroup::length, 430, 431, 432, 434, 435, 490);
  set(GGroup::retract, 980, 990);
  set(GGroup::offset, 540, 541, 550, 560, 570, 580, 590, 591, 592, 593);
  set(GGroup::path, 610, 611, 640);
  set(GGroup::spindle, 960, 970);
  set(GGroup::rotation, 680, 682, 690);
  set(GGroup::macro, 660, 670);
  set(GGroup::diameter, 80);
  set(GGroup::polar, 150, 160);
  set(GGroup::scaling, 500, 510);
  set(GGroup::mirror, 501, 511);
  return t;
}

constexpr std::array<MGroup, 100> make_m_groups() {
  std::array<MGroup, 100> t{};
  const auto set = [&](MGroup group, auto... codes) {
    ((t[static_cast<std::size_t>(codes)] = group), ...);
  };
  set(MGroup::stop, 0, 1, 2, 30, 60, 98, 99);
  set(MGroup::tool, 6, 61);
  set(MGroup::spindle, 3, 4, 5, 19);
  set(MGroup::mist, 7);
  set(MGroup::flood, 8, 9);
  set(MGroup::override, 48, 49, 50, 51, 52, 53);
  set(MGroup::output, 62, 63, 64, 65, 66, 67, 68);
  set(MGroup::modes, 70, 71, 72, 73);
  return t;
}

constexpr auto kGGroupOf = make_g_groups();
constexpr auto kMGroupOf = make_m_groups();

}  // namespace

GGroup g_group(int tenths) {
  return tenths >= 0 && tenths < 1000 ? kGGroupOf[static_cast<std::size_t>(tenths)]
                                      : GGroup::unknown;
}

MGroup m_group(int number) {
  return number >= 0 && number < 100 ? kMGroupOf[static_cast<std::size_t>(number)]
                                     : MGroup::unknown;
}

std::string code_name(int tenths) {
  if (tenths == kCircleThroughPoint) return "CIP";
  if (tenths == kTangentialCircle) return "CT";
  return tenths % 10 ? fmt::format("G{}.{}", tenths / 10, tenths % 10)
                     : fmt::format("G{}", tenths / 10);
}

}  // namespace vcnc
