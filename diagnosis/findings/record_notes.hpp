// What is told of a record besides what was found in it.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/beforehand/chatter_search.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

/// "position X with 83.30 Hz and 0.06 um"
std::string vibration(const NoiseLine& line);
/// "position X trembles at rest by 0.06 um rms"
std::string trembling(const Unrest& unrest);

/// Lines of the noise that are of no axis that vibrates by itself and of no found effect:
/// disturbances that do not repeat with the laps.
std::vector<std::string> notes_of_lines(const Evidence& evidence,
                                        const std::vector<Chatter>& chatter,
                                        const std::vector<FoundEffect>& effects);
/// What an axis did in one lap and not in another.
std::vector<std::string> notes_of_events(const Evidence& evidence);
/// Readings that count less than the figures tell, which are of all alike.
std::vector<std::string> notes_of_turning(const Evidence& evidence);

/// Signals that a machine leaves off in what was run once beside repeated motions: there that
/// counts as noise, and a verdict says nothing of it.
std::vector<std::string> notes_of_once(const Evidence& evidence, const Machine& machine);

}  // namespace vcnc
