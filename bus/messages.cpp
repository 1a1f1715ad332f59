#include "bus/messages.hpp"

#include <algorithm>
#include <cmath>

#include "bus/wire_docs.hpp"
#include "bus/wire_table.hpp"

namespace vcnc {

namespace {

using wire::Field;

// Counts per unit.
constexpr double kCount = 1, kLength = 1e10, kSpeed = 1e8, kSpindleSpeed = 1e5, kShare = 1e4;

template <class T>
T as(double value) {
  return static_cast<T>(static_cast<std::int64_t>(value));
}

// An accessor pair for a member expression of message `m` with an integer or enumeration type, and
// one for a double.
#define VCNC_INTEGER(M, member)                             \
  [](const M& m) { return static_cast<double>(m.member); }, \
      [](M& m, double v) { m.member = as<std::remove_cvref_t<decltype(m.member)>>(v); }
#define VCNC_NUMBER(M, member) \
  [](const M& m) { return m.member; }, [](M& m, double v) { m.member = v; }

// name, unit, offset, bytes, signed, counts per unit, accessors
// clang-format off
constexpr std::array<Field<Nmt>, 2> kNmt{{
    {"command", "", 0, 1, false, kCount, VCNC_INTEGER(Nmt, command)},
    {"node", "", 1, 1, false, kCount, VCNC_INTEGER(Nmt, node)},
}};
constexpr std::array<Field<Sync>, 1> kSync{{
    {"counter", "", 0, 1, false, kCount, VCNC_INTEGER(Sync, counter)},
}};
constexpr std::array<Field<Heartbeat>, 1> kHeartbeat{{
    {"state", "", 0, 1, false, kCount, VCNC_INTEGER(Heartbeat, state)},
}};
constexpr std::array<Field<Emergency>, 7> kEmergency{{
    {"code", "", 0, 2, false, kCount, VCNC_INTEGER(Emergency, code)},
    {"error_register", "", 2, 1, false, kCount, VCNC_INTEGER(Emergency, error_register)},
    {"detail_0", "", 3, 1, false, kCount, VCNC_INTEGER(Emergency, detail[0])},
    {"detail_1", "", 4, 1, false, kCount, VCNC_INTEGER(Emergency, detail[1])},
    {"detail_2", "", 5, 1, false, kCount, VCNC_INTEGER(Emergency, detail[2])},
    {"detail_3", "", 6, 1, false, kCount, VCNC_INTEGER(Emergency, detail[3])},
    {"detail_4", "", 7, 1, false, kCount, VCNC_INTEGER(Emergency, detail[4])},
}};
constexpr std::array<Field<GroupCommand>, 15> kGroupCommand{{
    {"tick", "", 0, 2, false, kCount, VCNC_INTEGER(GroupCommand, tick)},
    {"controlword", "", 2, 2, false, kCount, VCNC_INTEGER(GroupCommand, controlword)},
    {"x_position", "m", 4, 6, true, kLength, VCNC_NUMBER(GroupCommand, axes[0].position)},
    {"x_velocity", "m/s", 10, 4, true, kSpeed, VCNC_NUMBER(GroupCommand, axes[0].velocity)},
    {"y_position", "m", 14, 6, true, kLength, VCNC_NUMBER(GroupCommand, axes[1].position)},
    {"y_velocity", "m/s", 20, 4, true, kSpeed, VCNC_NUMBER(GroupCommand, axes[1].velocity)},
    {"z_position", "m", 24, 6, true, kLength, VCNC_NUMBER(GroupCommand, axes[2].position)},
    {"z_velocity", "m/s", 30, 4, true, kSpeed, VCNC_NUMBER(GroupCommand, axes[2].velocity)},
    {"a_position", "rad", 34, 6, true, kLength, VCNC_NUMBER(GroupCommand, axes[3].position)},
    {"a_velocity", "rad/s", 40, 4, true, kSpeed, VCNC_NUMBER(GroupCommand, axes[3].velocity)},
    {"c_position", "rad", 44, 6, true, kLength, VCNC_NUMBER(GroupCommand, axes[4].position)},
    {"c_velocity", "rad/s", 50, 4, true, kSpeed, VCNC_NUMBER(GroupCommand, axes[4].velocity)},
    {"spindle_mode", "", 54, 1, false, kCount, VCNC_INTEGER(GroupCommand, spindle_mode)},
    {"flags", "", 55, 1, false, kCount, VCNC_INTEGER(GroupCommand, flags)},
    {"spindle_speed", "rad/s", 56, 4, true, kSpindleSpeed, VCNC_NUMBER(GroupCommand, spindle_speed)},
}};
constexpr std::array<Field<DriveStatus>, 5> kDriveStatus{{
    {"tick", "", 0, 2, false, kCount, VCNC_INTEGER(DriveStatus, tick)},
    {"statusword", "", 2, 2, false, kCount, VCNC_INTEGER(DriveStatus, statusword)},
    {"position", "m|rad", 4, 6, true, kLength, VCNC_NUMBER(DriveStatus, position)},
    {"second_encoder", "m|rad", 10, 4, true, kLength, VCNC_NUMBER(DriveStatus, second_encoder)},
    {"force", "", 14, 2, true, kShare, VCNC_NUMBER(DriveStatus, force)},
}};
constexpr std::array<Field<DriveStatus>, 5> kSpindleStatus{{
    {"tick", "", 0, 2, false, kCount, VCNC_INTEGER(DriveStatus, tick)},
    {"statusword", "", 2, 2, false, kCount, VCNC_INTEGER(DriveStatus, statusword)},
    {"angle", "rad", 4, 6, true, kLength, VCNC_NUMBER(DriveStatus, position)},
    {"speed", "rad/s", 10, 4, true, kSpindleSpeed, VCNC_NUMBER(DriveStatus, second_encoder)},
    {"force", "", 14, 2, true, kShare, VCNC_NUMBER(DriveStatus, force)},
}};
constexpr std::array<Field<ProbeSample>, 11> kProbeSample{{
    {"tick", "", 0, 2, false, kCount, VCNC_INTEGER(ProbeSample, tick)},
    {"flags", "", 2, 2, false, kCount, VCNC_INTEGER(ProbeSample, flags)},
    {"deflection_x", "m", 4, 4, true, kLength, VCNC_NUMBER(ProbeSample, deflection[0])},
    {"deflection_y", "m", 8, 4, true, kLength, VCNC_NUMBER(ProbeSample, deflection[1])},
    {"deflection_z", "m", 12, 4, true, kLength, VCNC_NUMBER(ProbeSample, deflection[2])},
    {"x_cos", "", 16, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[0])},
    {"x_sin", "", 18, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[1])},
    {"y_cos", "", 20, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[2])},
    {"y_sin", "", 22, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[3])},
    {"z_cos", "", 24, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[4])},
    {"z_sin", "", 26, 2, false, kCount, VCNC_INTEGER(ProbeSample, adc[5])},
}};
constexpr std::array<Field<OvertravelState>, 4> kOvertravelState{{
    {"tick", "", 0, 2, false, kCount, VCNC_INTEGER(OvertravelState, tick)},
    {"state", "", 2, 1, false, kCount, VCNC_INTEGER(OvertravelState, state)},
    {"cause", "", 3, 1, false, kCount, VCNC_INTEGER(OvertravelState, cause)},
    {"deflection", "m", 4, 4, true, kLength, VCNC_NUMBER(OvertravelState, deflection)},
}};
constexpr std::array<Field<SdoMessage>, 7> kSdo{{
    {"command", "", 0, 1, false, kCount, VCNC_INTEGER(SdoMessage, command)},
    {"index", "", 1, 2, false, kCount, VCNC_INTEGER(SdoMessage, index)},
    {"sub_index", "", 3, 1, false, kCount, VCNC_INTEGER(SdoMessage, sub)},
    {"data_0", "", 4, 1, false, kCount, VCNC_INTEGER(SdoMessage, data[0])},
    {"data_1", "", 5, 1, false, kCount, VCNC_INTEGER(SdoMessage, data[1])},
    {"data_2", "", 6, 1, false, kCount, VCNC_INTEGER(SdoMessage, data[2])},
    {"data_3", "", 7, 1, false, kCount, VCNC_INTEGER(SdoMessage, data[3])},
}};

// clang-format on
#undef VCNC_INTEGER
#undef VCNC_NUMBER

constexpr std::uint8_t kNmtLength = 2, kSyncLength = 1, kHeartbeatLength = 1, kEmergencyLength = 8,
                       kGroupCommandLength = 64, kDriveStatusLength = 16, kProbeSampleLength = 32,
                       kOvertravelLength = 8, kSdoLength = 8;
constexpr std::uint16_t kProbeId = kStatusBase + kProbeNode,
                        kOvertravelId = kStatusBase + kOvertravelNode;

Frame blank(int id, std::uint8_t len, bool fd) {
  Frame frame;
  frame.id = static_cast<std::uint16_t>(id);
  frame.len = len;
  frame.fd = fd;
  return frame;
}

/// The node behind a COB-ID base + 1..last; 0: none.
int node_of(const Frame& frame, int base, int last) {
  const int node = frame.id - base;
  return node >= 1 && node <= last ? node : 0;
}

bool fits(const Frame& frame, int id, int len) { return frame.id == id && frame.len == len; }

}  // namespace

std::string_view text_of(NmtState state) {
  switch (state) {
    case NmtState::boot_up:
      return "boot-up";
    case NmtState::stopped:
      return "stopped";
    case NmtState::operational:
      return "operational";
    case NmtState::pre_operational:
      return "pre-operational";
  }
  return "unknown";
}

Frame encode(const Nmt& m) {
  Frame frame = blank(kNmtId, kNmtLength, false);
  wire::put_all<kNmt>(m, frame);
  return frame;
}
Frame encode(const Sync& m) {
  Frame frame = blank(kSyncId, kSyncLength, false);
  wire::put_all<kSync>(m, frame);
  return frame;
}
Frame encode(const Heartbeat& m) {
  Frame frame = blank(kHeartbeatBase + std::clamp(m.node, 1, 127), kHeartbeatLength, false);
  wire::put_all<kHeartbeat>(m, frame);
  return frame;
}
Frame encode(const Emergency& m) {
  Frame frame = blank(kEmcyBase + std::clamp(m.node, 1, 127), kEmergencyLength, false);
  wire::put_all<kEmergency>(m, frame);
  return frame;
}
Frame encode(const GroupCommand& m) {
  Frame frame = blank(kCommandId, kGroupCommandLength, true);
  wire::put_all<kGroupCommand>(m, frame);
  return frame;
}
Frame encode(const DriveStatus& m) {
  Frame frame = blank(kStatusBase + std::clamp(m.node, 1, kSpindleNode), kDriveStatusLength, true);
  if (frame.id == kStatusBase + kSpindleNode)
    wire::put_all<kSpindleStatus>(m, frame);
  else
    wire::put_all<kDriveStatus>(m, frame);
  return frame;
}
Frame encode(const ProbeSample& m) {
  Frame frame = blank(kProbeId, kProbeSampleLength, true);
  wire::put_all<kProbeSample>(m, frame);
  return frame;
}
Frame encode(const OvertravelState& m) {
  Frame frame = blank(kOvertravelId, kOvertravelLength, true);
  wire::put_all<kOvertravelState>(m, frame);
  return frame;
}

namespace {

Frame encode_sdo(const SdoMessage& m, int base) {
  Frame frame = blank(base + std::clamp(m.node, 1, 127), kSdoLength, false);
  wire::put_all<kSdo>(m, frame);
  return frame;
}
std::optional<SdoMessage> decode_sdo(const Frame& frame, int base) {
  SdoMessage m;
  m.node = node_of(frame, base, 127);
  if (m.node == 0 || frame.len != kSdoLength) return std::nullopt;
  wire::take_all<kSdo>(frame, m);
  return m;
}

}  // namespace

Frame encode_sdo_request(const SdoMessage& m) { return encode_sdo(m, kSdoRequestBase); }
Frame encode_sdo_answer(const SdoMessage& m) { return encode_sdo(m, kSdoAnswerBase); }
std::optional<SdoMessage> decode_sdo_request(const Frame& frame) {
  return decode_sdo(frame, kSdoRequestBase);
}
std::optional<SdoMessage> decode_sdo_answer(const Frame& frame) {
  return decode_sdo(frame, kSdoAnswerBase);
}

std::optional<Nmt> decode_nmt(const Frame& frame) {
  if (!fits(frame, kNmtId, kNmtLength)) return std::nullopt;
  Nmt m;
  wire::take_all<kNmt>(frame, m);
  switch (m.command) {
    case NmtCommand::start:
    case NmtCommand::stop:
    case NmtCommand::preop:
    case NmtCommand::reset_node:
    case NmtCommand::reset_comm:
      return m;
  }
  return std::nullopt;
}
std::optional<Sync> decode_sync(const Frame& frame) {
  if (!fits(frame, kSyncId, kSyncLength)) return std::nullopt;
  Sync m;
  wire::take_all<kSync>(frame, m);
  if (m.counter < 1 || m.counter > 240) return std::nullopt;
  return m;
}
std::optional<Heartbeat> decode_heartbeat(const Frame& frame) {
  Heartbeat m;
  m.node = node_of(frame, kHeartbeatBase, 127);
  if (m.node == 0 || frame.len != kHeartbeatLength) return std::nullopt;
  wire::take_all<kHeartbeat>(frame, m);
  switch (m.state) {
    case NmtState::boot_up:
    case NmtState::stopped:
    case NmtState::operational:
    case NmtState::pre_operational:
      return m;
  }
  return std::nullopt;
}
std::optional<Emergency> decode_emergency(const Frame& frame) {
  Emergency m;
  m.node = node_of(frame, kEmcyBase, 127);
  if (m.node == 0 || frame.len != kEmergencyLength) return std::nullopt;
  wire::take_all<kEmergency>(frame, m);
  return m;
}
std::optional<GroupCommand> decode_group_command(const Frame& frame) {
  if (!fits(frame, kCommandId, kGroupCommandLength)) return std::nullopt;
  GroupCommand m;
  wire::take_all<kGroupCommand>(frame, m);
  if (m.spindle_mode > GroupCommand::SpindleMode::orient) return std::nullopt;
  return m;
}
std::optional<DriveStatus> decode_drive_status(const Frame& frame) {
  DriveStatus m;
  m.node = node_of(frame, kStatusBase, kSpindleNode);
  if (m.node == 0 || frame.len != kDriveStatusLength) return std::nullopt;
  if (m.node == kSpindleNode)
    wire::take_all<kSpindleStatus>(frame, m);
  else
    wire::take_all<kDriveStatus>(frame, m);
  return m;
}
std::optional<ProbeSample> decode_probe_sample(const Frame& frame) {
  if (!fits(frame, kProbeId, kProbeSampleLength)) return std::nullopt;
  ProbeSample m;
  wire::take_all<kProbeSample>(frame, m);
  return m;
}
std::optional<OvertravelState> decode_overtravel_state(const Frame& frame) {
  if (!fits(frame, kOvertravelId, kOvertravelLength)) return std::nullopt;
  OvertravelState m;
  wire::take_all<kOvertravelState>(frame, m);
  if (m.state > OvertravelState::State::hard || m.cause > OvertravelState::Cause::runaway)
    return std::nullopt;
  return m;
}

bool is_finite(const GroupCommand& m) {
  return std::isfinite(m.spindle_speed) &&
         std::all_of(m.axes.begin(), m.axes.end(), [](const GroupCommand::Setpoint& s) {
           return std::isfinite(s.position) && std::isfinite(s.velocity);
         });
}
bool is_finite(const DriveStatus& m) {
  return std::isfinite(m.position) && std::isfinite(m.second_encoder) && std::isfinite(m.force);
}
bool is_finite(const ProbeSample& m) {
  return std::all_of(m.deflection.begin(), m.deflection.end(),
                     [](double d) { return std::isfinite(d); });
}

namespace {

template <class M, std::size_t n>
std::vector<WireField> listed(const std::array<Field<M>, n>& table) {
  std::vector<WireField> fields;
  for (const Field<M>& f : table)
    fields.push_back({f.name, f.unit, f.offset, f.bytes, f.is_signed, f.per_unit});
  return fields;
}

}  // namespace

std::vector<WireMessage> wire_messages() {
  return {
      {"Nmt", "NC unit", kNmtId, 0, 0, kNmtLength, false, listed(kNmt)},
      {"Sync", "NC unit", kSyncId, 0, 0, kSyncLength, false, listed(kSync)},
      {"Emergency", "every node", kEmcyBase, 1, kOvertravelNode, kEmergencyLength, false,
       listed(kEmergency)},
      {"DriveStatus", "axis drive", kStatusBase, 1, kSpindleNode - 1, kDriveStatusLength, true,
       listed(kDriveStatus)},
      {"SpindleStatus", "spindle drive", kStatusBase, kSpindleNode, kSpindleNode,
       kDriveStatusLength, true, listed(kSpindleStatus)},
      {"ProbeSample", "probe", kStatusBase, kProbeNode, kProbeNode, kProbeSampleLength, true,
       listed(kProbeSample)},
      {"OvertravelState", "overtravel", kStatusBase, kOvertravelNode, kOvertravelNode,
       kOvertravelLength, true, listed(kOvertravelState)},
      {"GroupCommand", "NC unit", kCommandId, 0, 0, kGroupCommandLength, true,
       listed(kGroupCommand)},
      {"SdoAnswer", "every node", kSdoAnswerBase, 1, kOvertravelNode, kSdoLength, false,
       listed(kSdo)},
      {"SdoRequest", "NC unit or a tool, to every node", kSdoRequestBase, 1, kOvertravelNode,
       kSdoLength, false, listed(kSdo), true},
      {"Heartbeat", "every node", kHeartbeatBase, 1, kOvertravelNode, kHeartbeatLength, false,
       listed(kHeartbeat)},
      {"NcHeartbeat", "NC unit", kHeartbeatBase + kNcNode, 0, 0, kHeartbeatLength, false,
       listed(kHeartbeat)},
  };
}

}  // namespace vcnc
