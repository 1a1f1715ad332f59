#include "bus/fault.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "bus/messages.hpp"

namespace vcnc {

namespace {

using Kind = BusFault::Kind;

constexpr std::array<std::string_view, 8> kModules{
    "drive X", "drive Y", "drive Z", "drive A", "drive C", "drive spindle", "probe", "overtravel"};
constexpr std::size_t kAxes = 5, kFirstRotary = 3;

struct KindText {
  Kind kind;
  std::string_view name;
  std::string_view keys;  ///< besides from_s and for_s, separated by blanks
};
constexpr std::array<KindText, 18> kKinds{{
    {Kind::mute, "mute", ""},
    {Kind::silent, "silent", ""},
    {Kind::deaf, "deaf", ""},
    {Kind::drop, "drop", "id"},
    {Kind::corrupt, "corrupt", "id bit"},
    {Kind::delay, "delay", "id cycles"},
    {Kind::duplicate, "duplicate", "id"},
    {Kind::lose_sync, "lose_sync", ""},
    {Kind::babble, "babble", "id frames"},
    {Kind::stuck, "stuck", ""},
    {Kind::encoder_jump, "encoder_jump", "um urad"},
    {Kind::fault, "fault", ""},
    {Kind::wire_break, "wire_break", "channel"},
    {Kind::stuck_adc, "stuck_adc", "channel"},
    {Kind::saturated, "saturated", "channel"},
    {Kind::kill, "kill", "wall_s"},
    {Kind::stop, "stop", "wall_s"},
    {Kind::slow, "slow", "wall_s"},
}};

constexpr std::uint16_t kBabbleId = 0x07f;
constexpr int kBabbleFrames = 20, kMostFrames = 200, kMostDelay = 1000;

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument(why); }

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t from = text.find_first_not_of(" \t");
    if (from == std::string_view::npos) return words;
    text.remove_prefix(from);
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
}

const KindText* kind_named(std::string_view word) {
  const auto found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const KindText& t) { return t.name == word; });
  return found == kKinds.end() ? nullptr : &*found;
}

double number(std::string_view key, std::string_view text, double min, double max) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= min && value <= max))
    refuse(fmt::format("{}={}: expected a number, {:g} .. {:g}", key, text, min, max));
  return value;
}

int whole(std::string_view key, std::string_view text, int min, int max) {
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = hex ? text.substr(2) : text;
  int value = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (error != std::errc() || end != digits.data() + digits.size() || value < min || value > max)
    refuse(fmt::format("{}={}: expected a whole number, {} .. {}", key, text, min, max));
  return value;
}

Tick ticks(double s) { return static_cast<Tick>(std::llround(s / kCycle)); }

bool is_axis(std::string_view node) {
  return std::find(kModules.begin(), kModules.begin() + kAxes, node) != kModules.begin() + kAxes;
}
bool is_rotary_axis(std::string_view node) {
  return std::find(kModules.begin() + kFirstRotary, kModules.begin() + kAxes, node) !=
         kModules.begin() + kAxes;
}

void check_node(const BusFault& f, std::string_view kind) {
  const bool module = std::find(kModules.begin(), kModules.end(), f.node) != kModules.end();
  const bool nc = f.node == kNcUnitName, bus = f.node == kWholeBus;
  const auto needs = [&](bool allowed, const char* which) {
    if (!allowed) refuse(fmt::format("\"{}\": {} is a fault of {}", f.node, kind, which));
  };
  if (!module && !nc && !bus && !(f.of_host() && f.node == "analysis"))
    refuse(fmt::format("\"{}\": no such node; allowed are {}, NC unit, bus", f.node,
                       fmt::join(kModules, ", ")));
  if (f.of_host()) needs(!bus, "a process");
  switch (f.kind) {
    case Kind::stuck:
      return needs(bus, "the bus");
    case Kind::encoder_jump:
    case Kind::fault:
      return needs(is_axis(f.node), "an axis drive");
    case Kind::wire_break:
    case Kind::stuck_adc:
    case Kind::saturated:
      return needs(f.node == "probe", "the probe");
    case Kind::lose_sync:
      return needs(!nc, "modules and of the bus");
    case Kind::babble:
      return needs(!bus, "one node");
    default:
      return;
  }
}

void read_key(BusFault& f, const KindText& kind, std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos || equals == 0)
    refuse(fmt::format("\"{}\": expected key=value", word));
  const std::string_view key = word.substr(0, equals), value = word.substr(equals + 1);
  constexpr double kLongest = 1e6;
  if (key == "from_s") {
    f.from = ticks(number(key, value, 0, kLongest));
    return;
  }
  if (key == "for_s") {
    f.cycles = std::max<Tick>(1, ticks(number(key, value, kCycle, kLongest)));
    return;
  }
  const std::vector<std::string_view> keys = words_of(kind.keys);
  if (std::find(keys.begin(), keys.end(), key) == keys.end())
    refuse(fmt::format("{}: unknown key; {} knows from_s, for_s{}{}", key, kind.name,
                       keys.empty() ? "" : ", ", fmt::join(keys, ", ")));
  if (key == "id") {
    f.id = whole(key, value, 1, kHeartbeatBase - 1);
    if (f.id == kSyncId) refuse("id=0x080: SYNC is not one frame's fault; use lose_sync");
  } else if (key == "bit") {
    f.bit = whole(key, value, 0, 511);
  } else if (key == "cycles") {
    f.count = whole(key, value, 1, kMostDelay);
  } else if (key == "frames") {
    f.count = whole(key, value, 1, kMostFrames);
  } else if (key == "channel") {
    if (value.size() != 1 || value[0] < 'x' || value[0] > 'z')
      refuse(fmt::format("channel={}: expected x, y or z", value));
    f.channel = value[0] - 'x';
  } else if (key == "wall_s") {
    f.wall_s = number(key, value, 0, kLongest);
  } else {  // um, urad
    const bool rotary = is_rotary_axis(f.node);
    if ((key == "urad") != rotary)
      refuse(fmt::format("{}: {} is counted in {}", key, f.node, rotary ? "urad" : "um"));
    f.value = number(key, value, -1e6, 1e6) * 1e-6;
  }
}

std::uint64_t drawn(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

void flip(Frame& frame, int bit) {
  const auto byte = static_cast<std::size_t>(bit / 8);
  if (byte < frame.len) frame.data[byte] ^= static_cast<std::uint8_t>(1u << (bit % 8));
}

void corrupt(Frame& frame, const BusFault& fault, Tick k) {
  if (fault.bit >= 0) return flip(frame, fault.bit);
  if (frame.len == 0) return;
  std::uint64_t random = drawn(static_cast<std::uint64_t>(k) * 2048 + frame.id);
  const auto bits = static_cast<std::uint64_t>(frame.len) * 8;
  for (std::uint64_t n = 1 + random % 3; n > 0; --n) {
    random = drawn(random);
    flip(frame, static_cast<int>(random % bits));
  }
}

bool acts_at_the_sender(Kind kind) {
  return kind == Kind::drop || kind == Kind::corrupt || kind == Kind::delay ||
         kind == Kind::duplicate;
}

}  // namespace

BusFault parse_fault(std::string_view text) {
  const std::vector<std::string_view> words = words_of(text);
  std::size_t at = 0;
  while (at < words.size() && (at == 0 || !kind_named(words[at]))) ++at;
  if (at >= words.size()) {
    std::string names;
    for (const KindText& t : kKinds) names += (names.empty() ? "" : ", ") + std::string(t.name);
    refuse(fmt::format("expected NODE KIND key=value ...; kinds are {}", names));
  }
  const KindText& kind = *kind_named(words[at]);
  BusFault fault;
  fault.kind = kind.kind;
  fault.text = std::string(text);
  fault.node =
      fmt::format("{}", fmt::join(words.begin(), words.begin() + static_cast<long>(at), " "));
  check_node(fault, kind.name);
  for (std::size_t i = at + 1; i < words.size(); ++i) read_key(fault, kind, words[i]);
  if (kind.kind == Kind::drop && fault.id < 0) refuse("drop: needs id=, which frame is lost");
  if (kind.kind == Kind::delay && fault.count == 0) refuse("delay: needs cycles=, how late");
  if (kind.kind == Kind::encoder_jump && fault.value == 0)
    refuse("encoder_jump: needs um= (linear axis) or urad= (rotary axis)");
  if (kind.kind == Kind::babble) {
    if (fault.count == 0) fault.count = kBabbleFrames;
    if (fault.id < 0) fault.id = kBabbleId;
  }
  return fault;
}

bool concerns(const BusFault& fault, std::string_view node) {
  if (fault.of_host()) return false;
  if (fault.node == node) return true;
  if (fault.node == kWholeBus) return node != kNcUnitName || acts_at_the_sender(fault.kind);
  return fault.node == kNcUnitName && (fault.kind == Kind::mute || fault.kind == Kind::silent);
}

bool concerns(const BusFaults& faults, std::string_view node) {
  return std::any_of(faults.begin(), faults.end(),
                     [&](const BusFault& f) { return concerns(f, node); });
}

// ------------------------------------------------------------------------------ filter

FaultFilter::FaultFilter(const BusFaults& faults, std::string_view node) : node_(node) {
  for (BusFault fault : faults) {
    if (!concerns(fault, node)) continue;
    if (fault.node == kNcUnitName && node != kNcUnitName) fault.kind = Kind::lose_sync;
    if (fault.kind == Kind::stuck) fault.kind = Kind::mute;
    faults_.push_back(fault);
  }
}

bool FaultFilter::is(Tick k, Kind kind) const {
  return std::any_of(faults_.begin(), faults_.end(),
                     [&](const BusFault& f) { return f.kind == kind && f.active(k); });
}

bool FaultFilter::synced(Tick k) const { return !is(k, Kind::lose_sync) && !is(k, Kind::mute); }

bool FaultFilter::speechless(Tick k) const { return is(k, Kind::mute) || is(k, Kind::silent); }

void FaultFilter::pass(Tick k, Way way, Frame frame, Frames& to) {
  int copies = 1;
  Tick due = k;
  for (const BusFault& f : faults_) {
    if (!acts_at_the_sender(f.kind) || !f.active(k)) continue;
    const bool whole_node = f.id < 0 || f.node == kWholeBus;
    if (whole_node && way == Way::heard) continue;
    if (f.id >= 0 && f.id != frame.id) continue;
    switch (f.kind) {
      case Kind::drop:
        return;
      case Kind::corrupt:
        corrupt(frame, f, k);
        break;
      case Kind::delay:
        due += f.count;
        break;
      default:
        ++copies;
        break;
    }
  }
  for (; copies > 0; --copies) {
    if (due > k)
      held_.push_back({due, way, frame});
    else
      to.push_back(frame);
  }
}

void FaultFilter::release(Tick k, Way way, Frames& to) {
  std::erase_if(held_, [&](const Held& held) {
    if (held.way != way || held.due > k) return false;
    to.push_back(held.frame);
    return true;
  });
}

void FaultFilter::hear(Tick k, std::span<const Frame> inputs, Frames& heard) {
  release(k, Way::heard, heard);
  for (const Frame& frame : inputs) pass(k, Way::heard, frame, heard);
  if (!synced(k) || is(k, Kind::deaf)) heard.clear();
  sort_by_id(heard);
}

void FaultFilter::say(Tick k, std::span<const Frame> said, Frames& out) {
  const std::size_t first = out.size();
  release(k, Way::said, out);
  for (const Frame& frame : said) pass(k, Way::said, frame, out);
  for (const BusFault& f : faults_) {
    if (f.kind != Kind::babble || !f.active(k)) continue;
    for (int i = 0; i < f.count; ++i) {
      Frame& noise = out.emplace_back();
      noise.id = static_cast<std::uint16_t>(f.id);
      noise.len = 8;
      noise.data.fill(0);
      noise.data[0] = static_cast<std::uint8_t>(i);
    }
  }
  if (speechless(k)) out.resize(first);
}

// ------------------------------------------------------------------------------ decorators

FaultedNode::FaultedNode(Node& inner, const BusFaults& faults)
    : inner_(inner), filter_(faults, inner.name()) {}

void FaultedNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  for (const BusFault& fault : filter_.faults())
    if (fault.of_module() && fault.active(k)) inner_.suffer(fault);
  heard_.clear();
  said_.clear();
  filter_.hear(k, inputs, heard_);
  inner_.step(k, heard_, said_);
  if (!filter_.synced(k)) {
    ++missed_syncs_;
    std::erase_if(said_, [&](const Frame& f) { return f.id == kStatusBase + id(); });
  } else if (missed_syncs_ > 0) {
    Emergency emergency{.node = id(), .code = 0x8100, .error_register = 0x11, .detail = {1}};
    for (std::size_t byte = 0; byte < 4; ++byte)
      emergency.detail[byte + 1] = static_cast<std::uint8_t>(missed_syncs_ >> (8 * byte));
    said_.push_back(encode(emergency));
    missed_syncs_ = 0;
  }
  speechless_ = filter_.speechless(k);
  filter_.say(k, said_, out);
}

FaultedMaster::FaultedMaster(Master& inner, const BusFaults& faults)
    : inner_(inner), filter_(faults, kNcUnitName) {}

bool FaultedMaster::step(Tick k, std::span<const Frame> answers, Frames& out) {
  heard_.clear();
  said_.clear();
  filter_.hear(k, answers, heard_);
  const bool more = inner_.step(k, heard_, said_);
  filter_.say(k, said_, out);
  return more;
}

}  // namespace vcnc
