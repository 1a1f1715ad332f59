#include "apps/keep_memory.hpp"

#include <malloc.h>

#include <limits>

namespace vcnc {

void keep_memory() {
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
}

}  // namespace vcnc
