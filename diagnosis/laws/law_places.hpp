// Laws of one place of an axis: a cover that catches, a chip on the guide, a worn tooth.
//
// What acts over some millimetres of a travel only, perhaps one way only, is next to nothing to ten
// hat functions over all of it. So narrow hats are held against the residual z one by one, each for
// the one direction and the other; with c what one changes, it promises
//
//   forwards, backwards   (z'c)^2 / c'c
//   both ways             (z'c_f + z'c_b)^2 / (c_f'c_f + c_b'c_b), against the motion with a minus
//
// on the fitted laps. About the one that promises most those belong to the law that promise a part
// of that, up to some; its knots are theirs, and one on either side.
#pragma once

#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/laws/law_columns.hpp"

namespace vcnc {

/// Of every force and displacement over its own axis' position the most promising place, for each
/// direction, both, and against the motion; without values. `left`: the residual.
std::vector<Law> laws_of_places(const Evidence& evidence, const LawColumns& columns,
                                const Column& left);

/// Which of some neighbours belong to the place of the most promising one: [first, last).
struct Neighbours {
  std::size_t first = 0, last = 0;
};
Neighbours about_the_most(const std::vector<double>& promises);

}  // namespace vcnc
