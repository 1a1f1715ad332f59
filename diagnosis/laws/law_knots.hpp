// Where a law without a name has more knots than those it began with.
//
// Between two neighbours three narrower hat functions are tried at once, one in the middle and one
// in either half (a wave as long as the interval shows in no middle alone):
//
//   knots   |               |      of the law so far
//   hats        /\  /--\  /\       a quarter, half and a quarter as wide
//
// Where what is gained on the held-out laps is less by `worth` without the three, a knot in the
// middle stays, and both halves are looked at in turn, to an eighth of the first distance. Source:
// hierarchical hat functions, Bungartz & Griebel, Acta Numerica 13 (2004) 147-269.
#pragma once

#include <functional>
#include <vector>

namespace vcnc {

/// 1 at `at`, 0 up to `low` and from `high` on, straight between.
struct Hat {
  double low, at, high;
  bool operator==(const Hat&) const = default;
};

/// `knots` ascending, with those that are worth it. `gain`: held-out chi-square that a law gains
/// with its first knots and these hats besides.
std::vector<double> with_more_knots(std::vector<double> knots,
                                    const std::function<double(const std::vector<Hat>&)>& gain,
                                    double worth);

}  // namespace vcnc
