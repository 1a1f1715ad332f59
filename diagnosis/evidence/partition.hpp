// What of a record is fitted and what is held out.
//
// Effects are chosen and judged on data they were not fitted to. Of every condition every other
// repetition is held out, by turns the early and the late ones, so that what changes with time is
// seen by both; a record without repetitions is cut into pieces which are fitted and held out in
// turn, a few neighbours being a condition. Conditions, not samples, are the unit of evidence: see
// selection.hpp.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// About a second of one stretch, 1.5 s at most.
struct RecordBlock {
  std::size_t begin = 0, end = 0;  ///< samples [begin, end)
  std::size_t stretch = 0;         ///< index into the stretches of the partition
  int condition = 0;
  bool held_out = false;
  bool once = false;  ///< run once, though others were repeated
};

struct Partition {
  std::vector<Stretch> stretches;   ///< of the record, or made up where nothing is repeated
  std::vector<RecordBlock> blocks;  ///< in order of time
  bool repeated = false;            ///< some condition was run more than once

  std::size_t conditions() const;
  /// Whether a stretch was run once, though others were repeated.
  bool once(const Stretch& stretch) const;
  /// The laps of every condition that was run more than once, all as long as its shortest.
  std::vector<std::vector<Stretch>> repetitions() const;
  /// Samples at the beginning of its laps that are no repetition, by condition (stretches.hpp).
  std::map<int, std::size_t> run_in;
};

Partition partition(const Record& record);

}  // namespace vcnc
