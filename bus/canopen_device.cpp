#include "bus/canopen_device.hpp"

#include <algorithm>

#include "bus/wire_docs.hpp"

namespace vcnc {

namespace {

constexpr std::uint8_t kGeneric = 0x01, kCommunication = 0x10;
constexpr std::uint16_t kReceived = 0x2800, kSent = 0x2a00;  ///< what PDOs carry
constexpr std::int64_t kNoRemoteRequest = 0x40000000;        ///< in the COB-ID of a TPDO
constexpr std::int64_t kEverySync = 1, kUnchanged = 1;

using Access = ObjectAccess;
using Type = ObjectType;

std::function<std::int64_t()> always(std::int64_t value) {
  return [value] { return value; };
}

std::int64_t field_of(const Frame& frame, const WireField& field) {
  std::uint64_t bits = 0;
  for (int i = 0; i < field.bytes; ++i)
    bits |= std::uint64_t{frame.data[static_cast<std::size_t>(field.offset + i)]} << (8 * i);
  return static_cast<std::int64_t>(bits);
}

bool is_pdo(const WireMessage& m) { return m.base >= kStatusBase && m.base < kSdoAnswerBase; }

}  // namespace

CanopenDevice::CanopenDevice(Node& module)
    : module_(module),
      server_(module.id(), objects_),
      period_(module.profile().heartbeat),
      nc_unit_(kHeartbeatPatience * module.profile().heartbeat) {
  declare_protocol();
  declare_pdos();
  module_.declare(objects_);
  constexpr std::size_t kExpectedFrames = 32;
  inputs_.reserve(kExpectedFrames);
  said_.reserve(kExpectedFrames);
}

bool CanopenDevice::accepts(std::uint16_t cob_id) const {
  return cob_id == kSdoRequestBase + id() || module_.accepts(cob_id);
}

std::uint8_t CanopenDevice::error_register() const {
  const bool communication =
      disturbed_ || nc_unit_.lost() ||
      std::any_of(received_.begin(), received_.end(), [](const Pdo& p) { return p.wrong_length; });
  return own_register_ |
         (communication ? static_cast<std::uint8_t>(kGeneric | kCommunication) : std::uint8_t{0});
}

SdoAbort CanopenDevice::set_consumer(std::int64_t value) {
  const auto node = value >> 16 & 0xff;
  const Tick time = value & 0xffff;
  if (value >> 24 != 0 || (time != 0 && node != kNcNode)) return SdoAbort::value;
  nc_unit_.set_time(time);
  return SdoAbort::none;
}

// clang-format off
void CanopenDevice::declare_protocol() {
  const DeviceProfile profile = module_.profile();
  const auto text = [this](std::uint16_t index, const char* name, std::string value) {
    objects_.add({.index = index, .name = name, .type = Type::text, .access = Access::constant,
                  .unit = "", .get_text = [value] { return value; }});
  };
  const auto constant = [this](std::uint16_t index, std::uint8_t sub, const char* name, Type type,
                               std::int64_t value, const char* unit = "") {
    objects_.add({index, sub, name, type, Access::constant, unit, always(value)});
  };
  constant(0x1000, 0, "Device type", Type::u32, profile.device_type);
  objects_.add({0x1001, 0, "Error register", Type::u8, Access::read_only, "",
                [this] { return error_register(); }});
  objects_.record(0x1003, "Pre-defined error field", ObjectHead::Code::array,
                  {0x1003, 0, "Number of errors", Type::u8, Access::read_write, "",
                   [this] { return static_cast<std::int64_t>(errors_.count()); },
                   [this](std::int64_t) { errors_.clear(); return SdoAbort::none; }, 0, 0});
  for (std::size_t i = 0; i < ErrorLog::kEntries; ++i)
    objects_.add({0x1003, static_cast<std::uint8_t>(i + 1), "Standard error field", Type::u32,
                  Access::read_only, "", [this, i] { return errors_.entry(i); }});
  constant(0x1005, 0, "COB-ID SYNC message", Type::u32, kSyncId);
  constant(0x1006, 0, "Communication cycle period", Type::u32, 1000, "us");
  text(0x1008, "Manufacturer device name", "vcnc " + std::string(module_.name()));
  text(0x1009, "Manufacturer hardware version", "virtual");
  text(0x100a, "Manufacturer software version", VCNC_VERSION);
  constant(0x1014, 0, "COB-ID EMCY", Type::u32, kEmcyBase + id());
  objects_.array(0x1016, "Consumer heartbeat time");
  objects_.add({0x1016, 1, "Consumer heartbeat time of the NC unit", Type::u32, Access::read_write,
                "node * 65536 + ms",
                [this] { return std::int64_t{kNcNode} << 16 | nc_unit_.time(); },
                [this](std::int64_t value) { return set_consumer(value); }});
  objects_.add({0x1017, 0, "Producer heartbeat time", Type::u16, Access::read_write, "ms",
                [this] { return period_; },
                [this](std::int64_t value) { period_ = value; return SdoAbort::none; }});
  objects_.record(0x1018, "Identity object");
  constant(0x1018, 1, "Vendor-ID", Type::u32, kVendorId);
  constant(0x1018, 2, "Product code", Type::u32, profile.product_code);
  constant(0x1018, 3, "Revision number", Type::u32, 0x00010000);
  constant(0x1018, 4, "Serial number", Type::u32, id());
  constant(0x1019, 0, "Synchronous counter overflow value", Type::u8, 240);
  objects_.array(0x1029, "Error behaviour");
  constant(0x1029, 1, "Communication error", Type::u8, kUnchanged);
  objects_.record(0x1200, "SDO server parameter");
  constant(0x1200, 1, "COB-ID client to server", Type::u32, kSdoRequestBase + id());
  constant(0x1200, 2, "COB-ID server to client", Type::u32, kSdoAnswerBase + id());
  objects_.add({.index = 0x2000, .name = "Label of the owner", .type = Type::text,
                .access = Access::read_write, .unit = "", .get_text = [this] { return label_; },
                .set_text = [this](const std::string& label) { label_ = label; return SdoAbort::none; }});
  objects_.add({0x2001, 0, "Cycles since the start", Type::u64, Access::read_only, "ms",
                [this] { return tick_ + 1; }});
}
// clang-format on

void CanopenDevice::declare_image(std::uint16_t index, const std::string& name,
                                  const WireMessage& message, const Pdo& pdo) {
  objects_.record(index, name);
  std::uint8_t sub = 0;
  for (const WireField& f : message.fields) {
    objects_.add({index, ++sub, std::string(f.name), integer_type(f.bytes, f.is_signed),
                  Access::read_only, unit_of_count(1 / f.per_unit, f.unit),
                  [f, &pdo] { return field_of(pdo.last, f); }});
  }
}

void CanopenDevice::declare_pdos() {
  struct Found {
    WireMessage message;
    int node;
  };
  std::vector<Found> heard;
  WireMessage spoken;
  for (const WireMessage& m : wire_messages()) {
    if (!is_pdo(m)) continue;
    for (int node = m.first_node; node <= m.last_node; ++node) {
      const auto cob_id = static_cast<std::uint16_t>(m.base + node);
      const Pdo pdo{.id = cob_id, .length = static_cast<std::uint8_t>(m.length)};
      if (cob_id == kStatusBase + id()) {
        spoken = m;
        sent_ = pdo;
      } else if (module_.accepts(cob_id)) {
        heard.push_back({m, node});
        received_.push_back(pdo);
      }
    }
  }
  const auto parameters = [this](std::uint16_t index, std::uint16_t mapping, const char* kind,
                                 const Pdo& pdo, const WireMessage& m, std::uint16_t image) {
    const bool sends = &pdo == &sent_;
    objects_.record(index, std::string(kind) + " communication parameter");
    objects_.add({index, 1, "COB-ID", Type::u32, Access::constant, "",
                  always(pdo.id | (sends ? kNoRemoteRequest : 0))});
    objects_.add(
        {index, 2, "Transmission type", Type::u8, Access::constant, "", always(kEverySync)});
    objects_.record(mapping, std::string(kind) + " mapping parameter");
    std::uint8_t sub = 0;
    for (const WireField& f : m.fields) {
      ++sub;
      objects_.add({mapping, sub, "Mapped " + std::string(f.name), Type::u32, Access::constant, "",
                    always(std::int64_t{image} << 16 | sub << 8 | 8 * f.bytes)});
    }
    declare_image(image, std::string(kind) + ": " + std::string(m.name), m, pdo);
  };
  for (std::size_t n = 0; n < received_.size(); ++n) {
    const auto number = static_cast<std::uint16_t>(n);
    parameters(0x1400 + number, 0x1600 + number, "RPDO", received_[n], heard[n].message,
               kReceived + number);
  }
  if (sent_.length > 0) parameters(0x1800, 0x1a00, "TPDO", sent_, spoken, kSent);
}

void CanopenDevice::raise(std::uint16_t code, std::array<std::uint8_t, 5> detail, Frames& said) {
  const Emergency emergency{
      .node = id(), .code = code, .error_register = error_register(), .detail = detail};
  errors_.enter(emergency);
  said.push_back(encode(emergency));
}

void CanopenDevice::gone(std::uint16_t code, Frames& said) {
  said.push_back(encode(Emergency{
      .node = id(),
      .code = kErrorReset,
      .error_register = error_register(),
      .detail = {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8)}}));
}

/// Sorts what is the protocol's from what is the module's.
void CanopenDevice::hear(Tick k, std::span<const Frame> inputs, Frames& said) {
  inputs_.clear();
  for (const Frame& frame : inputs) {
    if (const auto heartbeat = decode_heartbeat(frame)) {
      if (heartbeat->node == kNcNode) nc_unit_.heard(heartbeat->state, k);
      continue;
    }
    if (is_sdo(frame.id)) continue;
    inputs_.push_back(frame);
    for (Pdo& pdo : received_) {
      if (pdo.id != frame.id) continue;
      const bool was_wrong = pdo.wrong_length;
      pdo.wrong_length = frame.len != pdo.length;
      if (!pdo.wrong_length) pdo.last = frame;
      if (pdo.wrong_length && !was_wrong)
        raise(
            kPdoLengthError,
            {static_cast<std::uint8_t>(pdo.id), static_cast<std::uint8_t>(pdo.id >> 8), frame.len},
            said);
      if (!pdo.wrong_length && was_wrong) gone(kPdoLengthError, said);
    }
  }
  switch (nc_unit_.check(k)) {
    case HeartbeatWatch::Event::lost:
      module_.nc_unit_lost(true);
      raise(kHeartbeatLost, {static_cast<std::uint8_t>(kNcNode)}, said);
      break;
    case HeartbeatWatch::Event::back:
      module_.nc_unit_lost(false);
      gone(kHeartbeatLost, said);
      break;
    case HeartbeatWatch::Event::none:
      break;
  }
  if (disturbed_ && k - last_disturbance_ > kQuiet) {
    disturbed_ = false;
    gone(disturbance_, said);
  }
}

/// The module's own emergencies: history, and a register that shows all that holds.
void CanopenDevice::enter_emergencies(std::size_t first, Frames& out) {
  for (std::size_t i = first; i < out.size(); ++i) {
    if (out[i].id != kEmcyBase + id()) continue;
    auto emergency = decode_emergency(out[i]);
    if (!emergency) continue;
    if (emergency->code == kErrorReset)
      own_register_ = 0;
    else
      own_register_ |= emergency->error_register;
    emergency->error_register = error_register();
    if (emergency->code != kErrorReset) errors_.enter(*emergency);
    out[i] = encode(*emergency);
  }
}

void CanopenDevice::note(const Emergency& emergency) {
  errors_.enter(emergency);
  disturbed_ = true;
  disturbance_ = emergency.code;
  last_disturbance_ = tick_ + 1;
}

void CanopenDevice::request(const Frame& frame, Frames& out) {
  if (const auto answer = server_.serve(frame, tick_)) out.push_back(*answer);
}

void CanopenDevice::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  if (k <= tick_) {  // started anew
    server_.reset();
    nc_unit_.set_time(nc_unit_.time());
    disturbed_ = false;
  }
  tick_ = k;
  said_.clear();
  hear(k, inputs, said_);
  const std::size_t first = out.size();
  module_.step(k, inputs_, out);
  if (out.size() > first && out[first].id == sent_.id) sent_.last = out[first];
  enter_emergencies(first, out);
  out.insert(out.end(), said_.begin(), said_.end());
  for (const Frame& frame : inputs)
    if (server_.concerns(frame)) request(frame, out);
  if (const auto abort = server_.expire(k)) out.push_back(*abort);
  if (heartbeat_due(k, id(), period_))
    out.push_back(encode(Heartbeat{id(), NmtState::operational}));
}

}  // namespace vcnc
