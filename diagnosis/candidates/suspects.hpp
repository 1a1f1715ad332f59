// What somebody suspects, and wants to be held against the data before anything else.
//
// A suspect is an effect at a place ("X.backlash", "geometry.squareness"), an effect wherever it
// may be ("backlash"), or a declared number ("axes.X.load_kg"). With suspects, nothing else is
// sought: neither other effects, nor declared numbers out of tolerance, nor laws without a name.
// What they leave together is the least that any diagnosis with these names can leave, so that two
// suspicions are compared by what each leaves on the held-out laps.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"

namespace vcnc {

/// All are suspected where there are no suspects.
bool is_suspected(const std::vector<std::string>& suspects, const Candidate& candidate);
/// The same of a declared number by its key.
bool is_suspected(const std::vector<std::string>& suspects, const std::string& key);

/// Those of `all` that are suspected. Throws InputError naming a suspect that is none of them and
/// no key of `numbers`.
std::vector<Candidate> suspected(std::vector<Candidate> all,
                                 const std::vector<std::string>& numbers,
                                 const std::vector<std::string>& suspects);

}  // namespace vcnc
