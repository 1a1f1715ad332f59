// Which parts of a record are repetitions of the same motion, found in its commands alone.
//
// A part in which some axis moves is searched for laps: from a sample on, the commanded positions
// of all axes come back to the same values after a time T, sample by sample, for at least one more
// lap; a rotary axis may have turned round in between. What is no lap is one stretch from
// standstill to standstill or to the next laps. Two stretches are of one condition when the
// commands at equal shares of both are the same and take the same time, and the known forces of the
// one are those of the other within a twentieth.
//
// Laps need not be a whole number of samples: they begin at the samples next to k T.
#pragma once

#include <vector>

#include "diagnosis/records/record.hpp"

namespace vcnc {

inline constexpr double kStandingSpeed = 0.2e-3;  ///< [m/s]; rotary: the same in rad/s
inline constexpr double kStandingTime = 25e-3;    ///< [s]

/// Where the axis is told to move, or has been within kStandingTime: a standing axis keeps a
/// friction force that nobody can predict. True everywhere where no command is known.
std::vector<char> moving(const Record& record, std::size_t axis);

/// In order of time, not overlapping; empty where no command is known.
std::vector<Stretch> stretches_of(const Record& record);

/// Samples from the beginning of laps of one condition on that still hold what came before, which
/// was not the same before all of them: the first of several laps follows a ramp, the others a lap.
/// Of 0.3 s, and no more than half a lap; 0 where all came from the same, or no command is known.
std::size_t run_in(const Record& record, const std::vector<Stretch>& laps);

enum class At { any_place, the_same_place };

/// Whether all axes go the same way in both, as far as the shorter one lasts: where they were told
/// to be, else where they were. At the same place: within a millimetre or a milliradian.
bool same_way(const Record& a, const Stretch& of_a, const Record& b, const Stretch& of_b,
              At place = At::any_place);

}  // namespace vcnc
