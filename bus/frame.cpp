#include "bus/frame.hpp"

#include <utility>

namespace vcnc {

// Insertion sort: stable, without a temporary buffer, and a cycle has some dozen frames that are
// nearly in order.
void sort_by_id(Frames& frames) {
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i - 1].id <= frames[i].id) continue;
    const Frame frame = frames[i];
    std::size_t j = i;
    for (; j > 0 && frames[j - 1].id > frame.id; --j) frames[j] = frames[j - 1];
    frames[j] = frame;
  }
}

}  // namespace vcnc
