// Overtravel protection of the scanning probe as an explicit state machine.
//
//   NORMAL     deflection within 80 % of the usable range
//   WARN       any component beyond 80 % of its usable range
//   SOFT_STOP  any component beyond its usable range: feed hold, controlled stop, retract
//   HARD       quick stop of all axes and spindle lock, by any of
//                switch    the discrete signal of the probe's own protection unit
//                limit     |d_xy| >= lateral limit, |d_z| >= axial limit, k |d_xy| >= lateral
//                force,
//                          k |d_z| >= axial force
//                runaway   125 % of the usable range: the soft stop was not obeyed or came too late
//                signal    faulty sine or cosine (broken wire, saturated converter), or a reading
//                          that is not a number
//                slip      the ball moved too fast to be counted, or the reading jumped further
//                          than can be counted in the time between two samples (half a signal
//                          period per 100 us): it means nothing any more
//                silent    no sample for more than two cycles
//
// It only ever goes up by itself. SOFT_STOP and HARD are latched: the operator's reset opens them,
// and only when their cause is gone. NORMAL and WARN follow the deflection. A silent probe counts
// once it has been heard. While the probe is not in the spindle the machine sleeps in NORMAL, but
// keeps what is latched.
//
// Two instances exist that share no data but the bus: one in the overtravel module, one in the NC
// unit. Thresholds: usable_range() by mounting and stylus mass (model/probe/contact.hpp), limits
// and forces of the machine file. Source: overtravel values of SP2-1 class probes (x, y 18 mm with
// a 100 mm stylus and 20..65 N; z 5 mm and 400..600 N); the two stages are our own.
#pragma once

#include <cstdint>
#include <optional>

#include "model/probe/contact.hpp"

namespace vcnc {

enum class ProtectionState { normal, warn, soft_stop, hard };
enum class ProtectionCause {
  none,
  range,
  overtravel,  ///< the probe's own protection unit
  signal,
  silent,
  slip,
  limit,
  runaway
};

/// What is latched, to be kept while the machine is off.
struct ProtectionLatch {
  ProtectionState state = ProtectionState::normal;
  ProtectionCause cause = ProtectionCause::none;
  double deflection = 0;  ///< magnitude when it was latched [m]
  bool operator==(const ProtectionLatch&) const = default;
};

/// What one path sees in one cycle.
struct ProtectionEvidence {
  bool sampled = false;  ///< a sample has come; else the rest has no meaning
  Vec3 deflection = Vec3::Zero();
  bool overtravel = false, signal_fault = false, slip = false;
  /// Low 16 bits of the tick of the sample; nothing: jumps are not looked for.
  std::optional<std::uint16_t> tick{};
};

class Protection {
 public:
  static constexpr double kWarnShare = 0.8, kRunawayShare = 1.25;  ///< of the usable range
  static constexpr int kSilentCycles = 2;

  explicit Protection(const ProbeParams& probe);

  /// Begins with what was latched before the machine was switched off.
  void restore(const ProtectionLatch& latch);

  /// One cycle; `reset` is the operator's.
  void step(const ProtectionEvidence& seen, bool reset);

  ProtectionState state() const { return state_; }
  ProtectionCause cause() const { return cause_; }  ///< of the latched state
  /// Magnitude when it was latched, else now [m].
  double deflection() const { return deflection_; }
  bool latched() const { return state_ >= ProtectionState::soft_stop; }
  /// Nothing but the defaults unless latched().
  ProtectionLatch latch() const;

 private:
  struct Verdict {
    ProtectionState state = ProtectionState::normal;
    ProtectionCause cause = ProtectionCause::none;
  };
  Verdict judge(const ProtectionEvidence& seen) const;
  bool jumps(const ProtectionEvidence& seen) const;

  ProbeParams probe_;
  UsableRange range_;
  ProtectionState state_ = ProtectionState::normal;
  ProtectionCause cause_ = ProtectionCause::none;
  double deflection_ = 0;
  ProtectionEvidence last_;  ///< sample
  bool heard_ = false;
  int silent_ = 0;
};

/// One sentence for people.
const char* text_of(ProtectionCause cause);

}  // namespace vcnc
