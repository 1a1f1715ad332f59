// Every message on the bus: typed values, and the codec that turns them into bytes.
//
// One table per message in messages.cpp (offset, width, scale) is the only place that knows byte
// positions. All numbers are little-endian. Positions travel as 48-bit integers of 0.1 nm or
// 1e-10 rad, velocities as 32-bit integers of 10 nm/s or 1e-8 rad/s, spindle speeds in 1e-5 rad/s.
// The codec saturates at the ends, which are symmetric; the most negative code says "not a number"
// and is decoded as such, so a value that is none cannot pass for a position. Bytes without a field
// are 0.
//
//   COB-ID    sender      bytes  message
//   000       NC unit     2      NMT command
//   080       NC unit     1      SYNC with counter 1..240
//   080+id    any         8      EMCY
//   180+id    drives      16     DriveStatus   (id 1..5: X Y Z A C; 6: spindle)
//   187       probe       32     ProbeSample
//   188       overtravel  8      OvertravelState
//   200       NC unit     64     GroupCommand
//   580+id    modules     8      SDO answer
//   600+id    any client  8      SDO request
//   700+id    any         1      heartbeat, boot-up (77F: NC unit)
//
// 780h+id is a token of the simulation, not of the simulated bus: a module with faults in simulated
// time (bus/fault.hpp) ends its answer with it, so that the barrier knows that it has stepped even
// if it says nothing. The barrier takes it away; no module, log or hash ever sees it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "bus/frame.hpp"
#include "bus/tick.hpp"

namespace vcnc {

// ------------------------------------------------------------------ identifiers (CiA 301)
inline constexpr std::uint16_t kNmtId = 0x000, kSyncId = 0x080, kEmcyBase = 0x080,
                               kStatusBase = 0x180, kCommandId = 0x200, kSdoAnswerBase = 0x580,
                               kSdoRequestBase = 0x600, kHeartbeatBase = 0x700, kTokenBase = 0x780;
inline constexpr int kSpindleNode = 6, kProbeNode = 7, kOvertravelNode = 8, kNcNode = 127;
constexpr bool is_sdo(std::uint16_t id) { return id > kSdoAnswerBase && id < kHeartbeatBase; }
constexpr int drive_node(std::size_t axis) { return static_cast<int>(axis) + 1; }

/// What the modules are: device types (1000h; 0: no standard profile) and product codes (1018h).
inline constexpr std::uint32_t kServoDrive = 0x00020192, kSpindleDrive = 0x00010192, kNoProfile = 0;
inline constexpr std::uint32_t kAxisDriveProduct = 1, kSpindleDriveProduct = 2, kProbeProduct = 3,
                               kOvertravelProduct = 4;

enum class NmtCommand : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  preop = 0x80,
  reset_node = 0x81,
  reset_comm = 0x82
};
enum class NmtState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7f
};

std::string_view text_of(NmtState state);

struct Nmt {
  NmtCommand command = NmtCommand::start;
  std::uint8_t node = 0;  ///< 0: all
};
struct Sync {
  std::uint8_t counter = 1;  ///< 1..240
};
struct Heartbeat {
  int node = 0;
  NmtState state = NmtState::boot_up;
};
struct Emergency {
  int node = 0;
  std::uint16_t code = 0;  ///< CiA 301/402 error code
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> detail{};
};
/// SDO request or answer. In segments `index`, `sub` and `data` together are seven bytes of data.
struct SdoMessage {
  int node = 0;              ///< the server
  std::uint8_t command = 0;  ///< specifier in the upper three bits
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::array<std::uint8_t, 4> data{};
};

// ------------------------------------------------------------------ cyclic messages
/// Set-points of all drives for the end of the cycle in which they act.
struct GroupCommand {
  struct Setpoint {
    double position = 0;  ///< [m or rad]
    double velocity = 0;  ///< [m/s or rad/s] at that position
  };
  enum class SpindleMode : std::uint8_t {
    off = 0,
    clockwise = 1,
    counter_clockwise = 2,
    orient = 3
  };
  std::uint16_t tick = 0;         ///< low 16 bits of the tick in which it was sent
  std::uint16_t controlword = 0;  ///< CiA 402, for the five axes together
  std::array<Setpoint, 5> axes{};
  SpindleMode spindle_mode = SpindleMode::off;
  std::uint8_t flags = 0;    ///< kSpindleLock, kResetLatch
  double spindle_speed = 0;  ///< [rad/s]
};
inline constexpr std::uint8_t kSpindleLock = 0x01;  ///< the NC unit asks the spindle drive to lock
inline constexpr std::uint8_t kResetLatch = 0x02;   ///< operator's reset, held for some cycles

struct DriveStatus {
  int node = 0;
  std::uint16_t tick = 0;
  std::uint16_t statusword = 0;  ///< CiA 402
  double position = 0;           ///< measured at the end of the cycle [m or rad]; spindle: angle
  double second_encoder = 0;     ///< load minus motor side [m or rad]; spindle: speed [rad/s]
  double force = 0;              ///< share of the force limit, -3.2..3.2
};

struct ProbeSample {
  enum Flag : std::uint16_t {
    kContact = 0x01,
    kOutOfRange = 0x02,
    kSlip = 0x04,
    kSignalFault = 0x08,
    kOvertravel = 0x10
  };
  std::uint16_t tick = 0;  ///< low 16 bits of the instant the deflection belongs to
  std::uint16_t flags = 0;
  std::array<double, 3> deflection{};  ///< probe frame [m]
  std::array<std::uint16_t, 6> adc{};  ///< x cos, x sin, y cos, y sin, z cos, z sin
};

/// EMCY codes of the protocol (bus/emergency_codes.hpp says when).
inline constexpr std::uint16_t kErrorReset = 0x0000, kCommunicationError = 0x8100,
                               kOverrunError = 0x8110, kErrorPassive = 0x8120,
                               kHeartbeatLost = 0x8130, kBusOffRecovered = 0x8140,
                               kPdoLengthError = 0x8210;

/// EMCY code with which the overtravel module tells that it has latched.
inline constexpr std::uint16_t kOvertravelEmergency = 0xff10;

struct OvertravelState {
  enum class State : std::uint8_t { normal = 0, warn = 1, soft_stop = 2, hard = 3 };
  enum class Cause : std::uint8_t {
    none = 0,
    range = 1,
    overtravel = 2,
    signal = 3,
    silent = 4,
    slip = 5,
    limit = 6,
    runaway = 7
  };
  std::uint16_t tick = 0;
  State state = State::normal;
  Cause cause = Cause::none;
  double deflection = 0;  ///< magnitude when it tripped, else now [m]
};

// ------------------------------------------------------------------ codecs
// encode() never fails: values saturate. decode_x() gives nothing for a wrong identifier, a wrong
// length or a code of an enumeration that does not exist.
Frame encode(const Nmt&);
Frame encode(const Sync&);
Frame encode(const Heartbeat&);
Frame encode(const Emergency&);
Frame encode(const GroupCommand&);
Frame encode(const DriveStatus&);
Frame encode(const ProbeSample&);
Frame encode(const OvertravelState&);
Frame encode_sdo_request(const SdoMessage&);
Frame encode_sdo_answer(const SdoMessage&);

std::optional<Nmt> decode_nmt(const Frame&);
std::optional<Sync> decode_sync(const Frame&);
std::optional<Heartbeat> decode_heartbeat(const Frame&);
std::optional<Emergency> decode_emergency(const Frame&);
std::optional<GroupCommand> decode_group_command(const Frame&);
std::optional<DriveStatus> decode_drive_status(const Frame&);
std::optional<ProbeSample> decode_probe_sample(const Frame&);
std::optional<OvertravelState> decode_overtravel_state(const Frame&);
std::optional<SdoMessage> decode_sdo_request(const Frame&);
std::optional<SdoMessage> decode_sdo_answer(const Frame&);

/// Whether every value is a number. A receiver that acts upon values takes a frame in which one is
/// none for lost: a single flipped bit can turn zero into "not a number".
bool is_finite(const GroupCommand&);
bool is_finite(const DriveStatus&);
bool is_finite(const ProbeSample&);

constexpr std::uint8_t sync_counter(Tick k) { return static_cast<std::uint8_t>(k % 240 + 1); }
constexpr std::uint16_t low16(Tick k) { return static_cast<std::uint16_t>(k & 0xffff); }

}  // namespace vcnc
