#include "apps/fault_draw.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bus/messages.hpp"
#include "model/probe/noise.hpp"

namespace vcnc {

namespace {

using Kind = BusFault::Kind;

constexpr std::uint64_t kStream = 0x6661756c7473;

class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t number) : seed_(seed), counter_(number << 8) {}
  double unit() { return uniform_noise(seed_, kStream, counter_++); }
  bool chance(double p) { return unit() < p; }
  int whole(int least, int most) {
    return std::min(most, least + static_cast<int>(unit() * (most - least + 1)));
  }
  double log_between(double a, double b) { return a * std::pow(b / a, unit()); }

 private:
  std::uint64_t seed_, counter_;
};

/// A frame that the node sends or hears.
int frame_of(std::string_view node, Draw& draw) {
  constexpr int kProbeFrame = kStatusBase + kProbeNode,
                kOvertravelFrame = kStatusBase + kOvertravelNode;
  if (node == "probe") return kProbeFrame;
  if (node == "overtravel") return draw.chance(0.5) ? kProbeFrame : kOvertravelFrame;
  if (node == kNcUnitName || node == kWholeBus) {
    constexpr std::array kAll{int{kCommandId}, kProbeFrame, kOvertravelFrame, kStatusBase + 1,
                              kStatusBase + kSpindleNode};
    return kAll[static_cast<std::size_t>(draw.whole(0, kAll.size() - 1))];
  }
  return draw.chance(0.5) ? int{kCommandId} : kOvertravelFrame;
}

BusFault filled(std::string_view node, Kind kind, Tick first, Tick last, Draw& draw) {
  BusFault fault{.node = std::string(node), .kind = kind};
  fault.from = first + static_cast<Tick>(draw.unit() * static_cast<double>(last - first + 1));
  if (draw.chance(0.5)) fault.cycles = static_cast<Tick>(std::lround(draw.log_between(1, 50)));
  switch (kind) {
    case Kind::drop:
      fault.id = frame_of(node, draw);
      break;
    case Kind::corrupt:
    case Kind::delay:
    case Kind::duplicate:
      if (draw.chance(0.5)) fault.id = frame_of(node, draw);
      if (kind == Kind::delay) fault.count = draw.whole(1, 8);
      if (kind == Kind::corrupt && draw.chance(0.5)) fault.bit = draw.whole(0, 159);
      break;
    case Kind::babble:
      fault.id = 0x07f;
      fault.count = draw.whole(1, 40);
      break;
    case Kind::encoder_jump: {
      const bool rotary = node == "drive A" || node == "drive C";
      const double size = std::round(draw.log_between(20, rotary ? 2000 : 5000));
      fault.value = (draw.chance(0.5) ? size : -size) * 1e-6;
      break;
    }
    case Kind::slip:
      fault.count = static_cast<int>(std::lround(draw.log_between(1, 100)));
      if (draw.chance(0.5)) fault.count = -fault.count;
      fault.channel = draw.whole(0, 2);
      break;
    case Kind::wire_break:
    case Kind::stuck_adc:
    case Kind::saturated:
      fault.channel = draw.whole(0, 2);
      break;
    default:
      break;
  }
  fault.text = text_of(fault);
  return fault;
}

}  // namespace

const std::vector<std::pair<std::string_view, Kind>>& FaultDraw::pairs() {
  static const auto all = [] {
    std::vector<std::pair<std::string_view, Kind>> found;
    for (const FaultKind& kind : fault_kinds()) {
      if (BusFault{.node = "", .kind = kind.kind}.of_host()) continue;
      for (const std::string_view node : nodes_of(kind)) found.emplace_back(node, kind.kind);
    }
    return found;
  }();
  return all;
}

BusFault FaultDraw::in_turn(std::uint64_t number, Tick first, Tick last) const {
  const auto& [node, kind] = pairs()[number % pairs().size()];
  Draw draw(seed_, number);
  return filled(node, kind, first, last, draw);
}

BusFault FaultDraw::any(std::uint64_t number, Tick first, Tick last) const {
  Draw draw(seed_ ^ kStream, number);
  const auto& [node, kind] =
      pairs()[static_cast<std::size_t>(draw.whole(0, static_cast<int>(pairs().size()) - 1))];
  return filled(node, kind, first, last, draw);
}

}  // namespace vcnc
