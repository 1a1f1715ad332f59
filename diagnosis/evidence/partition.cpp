#include "diagnosis/evidence/partition.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "diagnosis/records/stretches.hpp"

namespace vcnc {
namespace {

/// Pieces of equal length from `from` to `to`, a few per condition, where no motion says what is
/// one.
std::vector<Stretch> even_stretches(std::size_t from, std::size_t to) {
  constexpr std::size_t kPieces = 24, kPerCondition = 4;
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < kPieces; ++i) {
    const std::size_t begin = from + (to - from) * i / kPieces,
                      end = from + (to - from) * (i + 1) / kPieces;
    if (end > begin)
      all.push_back({begin, end, static_cast<int>(i / kPerCondition),
                     static_cast<int>(i % kPerCondition), "piece " + std::to_string(i + 1)});
  }
  return all;
}

}  // namespace

std::vector<std::vector<Stretch>> Partition::repetitions() const {
  if (!repeated) return {};
  std::map<int, std::vector<Stretch>> laps;
  for (const Stretch& s : stretches) laps[s.condition].push_back(s);
  std::vector<std::vector<Stretch>> all;
  for (auto& [condition, of] : laps) {
    if (of.size() < 2) continue;
    std::size_t length = of.front().end - of.front().begin;
    for (const Stretch& s : of) length = std::min(length, s.end - s.begin);
    for (Stretch& s : of) s.end = s.begin + length;
    all.push_back(std::move(of));
  }
  return all;
}

std::size_t Partition::conditions() const {
  std::set<int> all;
  for (const RecordBlock& b : blocks) all.insert(b.condition);
  return all.size();
}

bool Partition::once(const Stretch& stretch) const {
  return repeated && std::count_if(stretches.begin(), stretches.end(), [&](const Stretch& s) {
                       return s.condition == stretch.condition;
                     }) == 1;
}

Partition partition(const Record& record) {
  Partition p;
  p.stretches = record.stretches;
  std::map<int, int> repetitions;
  for (const Stretch& s : p.stretches) ++repetitions[s.condition];
  p.repeated = std::any_of(repetitions.begin(), repetitions.end(),
                           [](const auto& c) { return c.second > 1; });
  if (p.stretches.empty())
    p.stretches = even_stretches(0, record.samples());
  else if (!p.repeated)
    p.stretches = even_stretches(p.stretches.front().begin, p.stretches.back().end);

  for (const std::vector<Stretch>& laps : p.repetitions())
    p.run_in[laps.front().condition] = run_in(record, laps);

  const auto second =
      static_cast<std::size_t>(std::max(1.0, std::round(1 / std::max(record.period, 1e-9))));
  std::map<int, int> seen, first;  // laps of a condition so far; the one of them that is held out
  int singles = 0;
  for (std::size_t i = 0; i < p.stretches.size(); ++i) {
    const Stretch& s = p.stretches[i];
    const std::size_t length = s.end - s.begin;
    const std::size_t pieces = std::max<std::size_t>(1, (length + second / 2) / second);
    const bool once = p.once(s);
    const int lap = seen[s.condition]++;
    const int of =
        first.try_emplace(s.condition, 1 - static_cast<int>(first.size()) % 2).first->second;
    for (std::size_t k = 0; k < pieces; ++k) {
      // What was run once is held out in pieces.
      const bool held_out = once ? singles++ % 2 == 1 : lap % 2 == of;
      p.blocks.push_back({s.begin + length * k / pieces, s.begin + length * (k + 1) / pieces, i,
                          s.condition, held_out, once});
    }
  }
  return p;
}

}  // namespace vcnc
