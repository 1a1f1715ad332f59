// Finds what makes an axis vibrate by itself.
//
// A limit cycle (play or too much gain within the loop, friction that sticks) has no phase that the
// laps repeat: to a fit it is noise, and sample by sample nothing can tell what makes it. But the
// model vibrates too when it has the same fault. So where an axis' own signals hold a strong line
// that does not repeat, each candidate of its drive is simulated at a few sizes, and the lines of
// the simulated laps are sought as those of the measured ones (noise_audit.hpp). A candidate is a
// cause if the axis then vibrates at the measured frequency within a factor of two: frequency and
// amplitude depend little on the size of a play and much on the stiffness behind it, which nobody
// declares. So of the size no more is known than that it is among those that do so, and all causes
// are one class. They explain the vibration where the model also vibrates as strongly, within a
// factor of three in every signal of the drive; else they are what is likely. (The position of a
// mass follows from the force by the frequency squared: where the force is recorded, that factor of
// two counts as well.)
// A line of the declared machine alone says that what is declared of its drive is not there; it has
// no causes.
// A line that is clear but not loud is told only where the model vibrates as strongly: every drive
// hums a little.
//
// Play may also rattle without a line, faster than a record of 1 kHz can show, or only while the
// axis stands, where no lap is compared. Then the drive is more restless than in the healthy run
// (unrest.hpp), three times as much in some signal. Causes are those candidates that make the model
// as restless in every signal under the same condition, in motion or at rest, as strongly as above;
// without any, the drive is as good as any other, and so it is where more than a dozen do, which
// tells nothing of what it is.
//
// Validity: frequencies below half the rate of the record; an axis of which the position or the
// force is recorded. Limit cycles of play: Nordin & Gutman, Automatica 38 (2002) 1633-1649.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/beforehand/unrest.hpp"
#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/evidence/noise_audit.hpp"

namespace vcnc {

/// What makes the model vibrate like the machine.
struct ChatterCause {
  std::size_t candidate = 0;
  double size = 0;           ///< middle of those that do so, in usual ones
  double low = 0, high = 0;  ///< of its first number, in the unit of the key
  NoiseLine line;            ///< of the model, the likest; where the machine has one
  Unrest unrest;             ///< of the model in the signal that has grown most
  bool as_strong = false;    ///< as the machine's, there
};

struct Chatter {
  std::size_t axis = 0;
  NoiseLine line;                    ///< strongest, as measured; strength 0: none
  bool of_model = false;             ///< the declared machine has it, the measured one has not
  Unrest unrest;                     ///< that of its signals which has grown most
  double times = 0;                  ///< what it was in the healthy run
  std::vector<ChatterCause> causes;  ///< the likest first; none: something outside the drive
  std::size_t too_many = 0;          ///< causes that were, and tell nothing

  bool has_line() const { return line.strength > 0; }
  bool is_restless() const;
  /// Whether what the drive does can be told from what it should do.
  bool hides_drive() const { return has_line() || !causes.empty(); }
};

/// A machine with a candidate: its first number larger by `size` usual ones, the others as usual
/// where they are nothing.
Machine with_candidate(Machine machine, const Candidate& candidate, double size);

/// `healthy`: how it was when the machine was healthy; nothing where that is not known.
std::vector<Chatter> find_chatter(const Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const HealthyNoise& healthy);

}  // namespace vcnc
