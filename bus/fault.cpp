#include "bus/fault.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "bus/frame_time.hpp"
#include "bus/messages.hpp"

namespace vcnc {

namespace {

using Kind = BusFault::Kind;

constexpr std::array<std::string_view, 8> kModules{
    "drive X", "drive Y", "drive Z", "drive A", "drive C", "drive spindle", "probe", "overtravel"};
constexpr std::size_t kAxes = 5, kFirstRotary = 3;

using Place = FaultPlace;
constexpr std::array<FaultKind, 23> kKinds{{
    {Kind::mute, "mute", "", Place::node, "sends nothing and hears nothing: unplugged, bus off",
     "3202 names it; the others stop"},
    {Kind::silent, "silent", "", Place::node, "sends nothing", "3202 names it"},
    {Kind::deaf, "deaf", "", Place::node, "hears nothing",
     "a drive stops by itself (2103, 2104), the overtravel module trips; a deaf probe goes on, it "
     "needs to hear nothing"},
    {Kind::drop, "drop", "id", Place::node,
     "the frame `id` is lost: sent by the node, or heard by it",
     "as silent or deaf; a frame nobody needs: nothing"},
    {Kind::corrupt, "corrupt", "id bit", Place::node,
     "bits of a payload flip unnoticed by the CRC: `bit`, else 1 to 3 drawn from cycle and "
     "identifier; `id`: sent or heard, else all that it sends",
     "stale ticks, numbers that are none, speeds and jumps that cannot be are taken for lost or "
     "faulty; smaller errors pass"},
    {Kind::delay, "delay", "id cycles", Place::node, "comes `cycles` later; `id` as of corrupt",
     "up to 2 cycles are borne, then 3202, 2103"},
    {Kind::duplicate, "duplicate", "id", Place::node, "comes twice; `id` as of corrupt",
     "3101 tells; the machine goes on"},
    {Kind::lose_sync, "lose_sync", "", Place::module_or_bus,
     "no SYNC: nothing latched, no cyclic frame; the motion goes on; emergencies are sent. On its "
     "return the missed SYNCs are told (EMCY 8100h)",
     "3202 names it"},
    {Kind::babble, "babble", "id frames", Place::one_node,
     "`frames` (20) more frames in each cycle, of `id` (0x07F)",
     "3101; 3103 when more than fits into a cycle"},
    {Kind::stuck, "stuck", "", Place::bus, "stuck dominant: no module is heard and none hears",
     "3202, \"the bus itself has failed\"; every drive stops by itself"},
    {Kind::power_loss, "power_loss", "", Place::supply,
     "the mains are away: the machine lives on its uninterruptible supply",
     "4001: held, retracted, saved; 4003 when the supply is exhausted"},
    {Kind::bus_off, "bus_off", "", Place::module,
     "each frame it sends is destroyed (a broken transceiver): error frames and retransmission "
     "until its error counter puts it off the bus (bus/error_counters.hpp, at 1 Mbit/s); then it "
     "neither sends nor hears. When the fault is over it comes back after 128 x 11 recessive bits, "
     "2 cycles, with EMCY 8140h; 8120h if it was only error passive",
     "3202 names it"},
    {Kind::encoder_jump, "encoder_jump", "um urad", Place::axis,
     "`um` or `urad` is added to what the measuring system counts",
     "2101 beyond the following window, 1001 when the probe shows it; a smaller one passes"},
    {Kind::fault, "fault", "", Place::axis, "the drive raises EMCY 2310h and stops by itself",
     "2105 names it"},
    {Kind::wire_break, "wire_break", "channel", Place::probe,
     "both signals of `channel` (x) at mid voltage",
     "amplitude check of the probe module: 1001, signal faulty"},
    {Kind::stuck_adc, "stuck_adc", "channel", Place::probe,
     "both converters of `channel` repeat their last codes",
     "test conversion of the probe module: 1001, signal faulty"},
    {Kind::saturated, "saturated", "channel", Place::probe,
     "both converters of `channel` at their end", "end codes: 1001, signal faulty"},
    {Kind::slip, "slip", "channel periods", Place::probe,
     "the reading of `channel` is off by `periods` (1) signal periods",
     "1001, slip, when it jumps further than can be counted in a cycle (5 periods); less passes "
     "and is less than 5 % of the range"},
    {Kind::kill, "kill", "wall_s", Place::process, "SIGKILL",
     "3201 names it; without the NC unit every drive stops by itself"},
    {Kind::stop, "stop", "wall_s", Place::process,
     "SIGSTOP, and SIGCONT after for_s; of the analysis: a reader that stalls",
     "3201 after the answer time-out; a paced machine never waits for the analysis, what it missed "
     "is counted"},
    {Kind::slow, "slow", "wall_s", Place::process, "stopped half of the time",
     "nothing changes but the host time"},
    {Kind::restart, "restart", "wall_s", Place::process,
     "SIGKILL, and the program is started again",
     "3201 names it; the new one waits in pre-operational and takes no part; of the analysis: the "
     "run is stopped"},
    {Kind::disk_full, "disk_full", "wall_s", Place::analysis,
     "no file of the analysis can grow any more",
     "the run is stopped and says so; the recording up to there opens"},
}};

constexpr double kCyclesPerSecond = 1000;  ///< 1 / kCycle, exactly
// At 1 Mbit/s.
constexpr std::int64_t kCycleNs = 1'000'000;
constexpr std::int64_t kErrorFrameNs = 23'000;  ///< flags 12, delimiter 8, space 3 bits
constexpr std::int64_t kSuspendNs = 8'000;      ///< an error passive node waits after its own frame
constexpr int kRecessiveSequences = 1000 / 11;  ///< in a cycle of a quiet bus

constexpr std::uint16_t kBabbleId = 0x07f;
constexpr int kBabbleFrames = 20, kMostFrames = 200, kMostDelay = 1000, kMostPeriods = 10000;

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

const FaultKind* kind_named(std::string_view word) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(),
                                  [&](const FaultKind& t) { return t.name == word; });
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

bool is_rotary_axis(std::string_view node) {
  return std::find(kModules.begin() + kFirstRotary, kModules.begin() + kAxes, node) !=
         kModules.begin() + kAxes;
}

constexpr std::string_view kAnalysisName = "analysis";

const char* of(Place place) {
  switch (place) {
    case Place::module_or_bus:
      return "modules and of the bus";
    case Place::one_node:
      return "one node";
    case Place::module:
      return "one module";
    case Place::supply:
      return "the supply";
    case Place::bus:
      return "the bus";
    case Place::axis:
      return "an axis drive";
    case Place::probe:
      return "the probe";
    case Place::process:
      return "a process";
    case Place::analysis:
      return "the analysis";
    case Place::node:
      break;
  }
  return "any node";
}

void check_node(const BusFault& f, const FaultKind& kind) {
  const bool module = std::find(kModules.begin(), kModules.end(), f.node) != kModules.end();
  if (!module && f.node != kNcUnitName && f.node != kWholeBus && f.node != kSupplyName &&
      !(f.of_host() && f.node == kAnalysisName))
    refuse(fmt::format("\"{}\": no such node; allowed are {}, NC unit, bus, supply", f.node,
                       fmt::join(kModules, ", ")));
  if (f.node == kSupplyName && kind.place != Place::supply)
    refuse(fmt::format("\"{}\": the supply knows power_loss", f.node));
  const std::vector<std::string_view> allowed = nodes_of(kind);
  if (std::find(allowed.begin(), allowed.end(), f.node) == allowed.end())
    refuse(fmt::format("\"{}\": {} is a fault of {}", f.node, kind.name, of(kind.place)));
}

void read_key(BusFault& f, const FaultKind& kind, std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos || equals == 0)
    refuse(fmt::format("\"{}\": expected key=value", word));
  const std::string_view key = word.substr(0, equals), value = word.substr(equals + 1);
  constexpr double kLongest = 1e6;
  if (key == "from_s") {
    f.from = ticks(number(key, value, -kLongest, kLongest));
    return;
  }
  if (key == "at") {
    if (value != "contact") refuse(fmt::format("at={}: expected contact", value));
    if (f.of_host()) refuse("at=contact: a fault of the host has no moment of the simulation");
    f.at_contact = true;
    return;
  }
  if (key == "for_s") {
    f.cycles = std::max<Tick>(1, ticks(number(key, value, kCycle, kLongest)));
    return;
  }
  const std::vector<std::string_view> keys = words_of(kind.keys);
  if (std::find(keys.begin(), keys.end(), key) == keys.end())
    refuse(fmt::format("{}: unknown key; {} knows from_s, for_s, at{}{}", key, kind.name,
                       keys.empty() ? "" : ", ", fmt::join(keys, ", ")));
  if (key == "id") {
    f.id = whole(key, value, 1, kTokenBase - 1);
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
  } else if (key == "periods") {
    f.count = whole(key, value, -kMostPeriods, kMostPeriods);
    if (f.count == 0) refuse("periods=0: expected a whole number other than 0");
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

std::span<const FaultKind> fault_kinds() { return kKinds; }

std::vector<std::string_view> nodes_of(const FaultKind& kind) {
  const auto axes = kModules.begin() + kAxes;
  switch (kind.place) {
    case Place::bus:
      return {kWholeBus};
    case Place::axis:
      return {kModules.begin(), axes};
    case Place::probe:
      return {"probe"};
    case Place::analysis:
      return {kAnalysisName};
    case Place::supply:
      return {kSupplyName};
    case Place::module:
      return {kModules.begin(), kModules.end()};
    default:
      break;
  }
  std::vector<std::string_view> nodes(kModules.begin(), kModules.end());
  if (kind.place != Place::module_or_bus) nodes.push_back(kNcUnitName);
  if (kind.place == Place::process) nodes.push_back(kAnalysisName);
  if (kind.place == Place::node || kind.place == Place::module_or_bus) nodes.push_back(kWholeBus);
  return nodes;
}

BusFault parse_fault(std::string_view text) {
  const std::vector<std::string_view> words = words_of(text);
  std::size_t at = 0;
  while (at < words.size() && (at == 0 || !kind_named(words[at]))) ++at;
  if (at >= words.size()) {
    std::string names;
    for (const FaultKind& t : kKinds) names += (names.empty() ? "" : ", ") + std::string(t.name);
    refuse(fmt::format("expected NODE KIND key=value ...; kinds are {}", names));
  }
  const FaultKind& kind = *kind_named(words[at]);
  BusFault fault;
  fault.kind = kind.kind;
  fault.text = std::string(text);
  fault.node =
      fmt::format("{}", fmt::join(words.begin(), words.begin() + static_cast<long>(at), " "));
  check_node(fault, kind);
  for (std::size_t i = at + 1; i < words.size(); ++i) read_key(fault, kind, words[i]);
  if (fault.from < 0 && !fault.at_contact)
    refuse("from_s: expected 0 or more; only at=contact counts backwards too");
  if (kind.kind == Kind::slip && fault.count == 0) fault.count = 1;
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

std::string text_of(const BusFault& f) {
  const FaultKind& kind = *std::find_if(kKinds.begin(), kKinds.end(),
                                        [&](const FaultKind& t) { return t.kind == f.kind; });
  std::string text = fmt::format("{} {}", f.node, kind.name);
  const auto add = [&](std::string_view key, const auto& value) {
    text += fmt::format(" {}={}", key, value);
  };
  if (f.at_contact) text += " at=contact";
  if (f.wall_s >= 0)
    add("wall_s", f.wall_s);
  else
    add("from_s", static_cast<double>(f.from) / kCyclesPerSecond);
  if (f.cycles > 0) add("for_s", static_cast<double>(f.cycles) / kCyclesPerSecond);
  for (const std::string_view key : words_of(kind.keys)) {
    if (key == "id" && f.id >= 0) add(key, fmt::format("0x{:03X}", f.id));
    if (key == "bit" && f.bit >= 0) add(key, f.bit);
    if (key == "cycles" || key == "frames" || key == "periods") add(key, f.count);
    if (key == "channel") add(key, static_cast<char>('x' + f.channel));
    if ((key == "urad") == is_rotary_axis(f.node) && (key == "um" || key == "urad"))
      add(key, f.value * 1e6);
  }
  return text;
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
  struck_.assign(faults_.size(), 0);
}

std::vector<std::string> FaultFilter::struck() const {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < faults_.size(); ++i)
    if (struck_[i]) texts.push_back(faults_[i].text);
  return texts;
}

/// Those that act on a node as a whole strike by being active.
void FaultFilter::strike_whole(Tick k) {
  for (std::size_t i = 0; i < faults_.size(); ++i)
    if (!acts_at_the_sender(faults_[i].kind) && faults_[i].active(k)) struck_[i] = 1;
}

bool FaultFilter::is(Tick k, Kind kind) const {
  return std::any_of(faults_.begin(), faults_.end(),
                     [&](const BusFault& f) { return f.kind == kind && f.active(k); });
}

bool FaultFilter::synced(Tick k) const {
  return !is(k, Kind::lose_sync) && !is(k, Kind::mute) && !off();
}

bool FaultFilter::speechless(Tick k) const {
  return is(k, Kind::mute) || is(k, Kind::silent) || is(k, Kind::bus_off) || off();
}

std::optional<std::uint16_t> FaultFilter::take_return(Tick k) {
  return off() || is(k, Kind::bus_off) ? std::nullopt : std::exchange(return_, std::nullopt);
}

/// The controller sends the first frame again and again; what it could not send in a cycle is
/// replaced by what is new in the next.
bool FaultFilter::transmit(Tick k, std::span<const Frame> said) {
  wasted_ns_ = 0;
  if (!is(k, Kind::bus_off)) {
    if (off()) {
      counters_.recessive(kRecessiveSequences);
      return false;
    }
    for (std::size_t i = 0; i < said.size(); ++i) counters_.sent();
    return true;
  }
  if (said.empty()) return false;
  const Frame& first = *std::min_element(
      said.begin(), said.end(), [](const Frame& a, const Frame& b) { return a.id < b.id; });
  const std::int64_t attempt_ns = exact_duration_ns(first, {}) + kErrorFrameNs;
  while (!off() && wasted_ns_ + attempt_ns <= kCycleNs) {
    wasted_ns_ += attempt_ns;
    if (counters_.state() == ErrorCounters::State::error_passive) wasted_ns_ += kSuspendNs;
    counters_.send_error();
  }
  if (off())
    return_ = kBusOffRecovered;
  else if (counters_.state() == ErrorCounters::State::error_passive)
    return_ = kErrorPassive;
  return false;
}

void FaultFilter::pass(Tick k, Way way, Frame frame, Frames& to) {
  int copies = 1;
  Tick due = k;
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const BusFault& f = faults_[i];
    if (!acts_at_the_sender(f.kind) || !f.active(k)) continue;
    const bool whole_node = f.id < 0 || f.node == kWholeBus;
    if (whole_node && way == Way::heard) continue;
    if (f.id >= 0 && f.id != frame.id) continue;
    struck_[i] = 1;
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
  strike_whole(k);
  release(k, Way::heard, heard);
  for (const Frame& frame : inputs) pass(k, Way::heard, frame, heard);
  if (!synced(k) || is(k, Kind::deaf)) heard.clear();
  sort_by_id(heard);
}

void FaultFilter::say(Tick k, std::span<const Frame> said, Frames& out) {
  const std::size_t first = out.size();
  const bool through = transmit(k, said);
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
  if (speechless(k) || !through) out.resize(first);
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
    inner_.note(emergency);
    missed_syncs_ = 0;
  }
  if (const auto code = filter_.take_return(k)) {
    const Emergency emergency{.node = id(), .code = *code, .error_register = 0x11};
    said_.push_back(encode(emergency));
    inner_.note(emergency);
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
