#include "diagnosis/records/told_laps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "diagnosis/records/stretches.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kShortestLap = 50;  // samples
constexpr double kBeyond = 2;             // samples that a lap may reach beyond the run
constexpr double kBrokenOff = 0.02;       // of a lap, that may be missing at its end

class LapCut {
 public:
  LapCut(const MapColumns& columns, const TimeBase& base, Record& record)
      : columns_(columns), map_(columns.map()), base_(base), record_(record) {}

  void by_times() {
    std::map<std::string, int> known;  // condition: its number
    std::vector<const KeyLines*> lines;
    for (const ImportMap::Lap& lap : map_.laps) {
      const double from = (lap.from - base_.begin) / base_.period;
      const double to = (lap.to - base_.begin) / base_.period;
      const auto last = static_cast<double>(base_.samples);
      if (from < -kBeyond || to > last + kBeyond)
        columns_.refuse(
            lap.lines, "laps.", from < -kBeyond || from >= last ? "from_s" : "to_s",
            fmt::format("the lap lies {}, {:.3f} .. {:.3f} s",
                        to <= 0 || from >= last ? "outside the run" : "partly outside the run",
                        base_.begin, base_.begin + (last - 1) * base_.period));
      const std::string name = lap.condition.empty()
                                   ? fmt::format("lap {}", record_.stretches.size() + 1)
                                   : lap.condition;
      const int number = known.emplace(name, static_cast<int>(known.size())).first->second;
      const auto begin = static_cast<std::size_t>(std::clamp(std::round(from), 0.0, last)),
                 end = static_cast<std::size_t>(std::clamp(std::round(to), 0.0, last));
      if (end < begin + kShortestLap)
        columns_.refuse(lap.lines, "laps.", "to_s", too_short(end > begin ? end - begin : 0));
      record_.stretches.push_back({begin, end, number, 0, name});
      lines.push_back(&lap.lines);
    }
    number_repetitions(true, lines, "laps.", "condition");
  }

  void by_column() {
    const std::size_t rows = base_.index.size();
    const MeasuredColumn& laps = columns_.find(map_.lap_column, 0, map_.lines, "", "lap_column");
    const MeasuredColumn* conditions =
        map_.condition_column.empty()
            ? nullptr
            : &columns_.find(map_.condition_column, 0, map_.lines, "", "condition_column");
    for (const auto& [c, key] : {std::pair(&laps, "lap_column"), {conditions, "condition_column"}})
      if (c && c->value.size() != rows)
        columns_.refuse(map_.lines, "", key,
                        fmt::format("column \"{}\" has {} rows, the others have {}", c->name,
                                    c->value.size(), rows));
    std::map<double, int> known;  // condition: its number
    const auto differ = [](double a, double b) {
      return std::isfinite(a) || std::isfinite(b) ? !(a == b) : false;
    };
    int next = 0;  // number of a condition not seen before; one that is not told is none of these
    std::size_t begin = 0;
    for (std::size_t i = 1; i <= rows; ++i) {
      const bool ends = i == rows || differ(laps.value[i], laps.value[i - 1]) ||
                        (conditions && differ(conditions->value[i], conditions->value[i - 1]));
      if (!ends) continue;
      if (std::isfinite(laps.value[begin])) {
        const double of = conditions ? conditions->value[begin] : 0;
        const int number = std::isfinite(of) ? known.emplace(of, next).first->second : next;
        next = std::max(next, number + 1);
        const std::size_t first = base_.index[begin], end = base_.index[i - 1] + 1;
        if (end < first + kShortestLap)
          columns_.refuse(map_.lines, "", "lap_column", too_short(end - first));
        record_.stretches.push_back(
            {first, end, number, 0,
             conditions ? fmt::format("{} {:g}", conditions->name, of) : "lap"});
      }
      begin = i;
    }
    const std::vector<const KeyLines*> lines(record_.stretches.size(), &map_.lines);
    number_repetitions(conditions != nullptr, lines, "", "condition_column");
  }

 private:
  struct Motion {
    int told;  // condition by the map
    Stretch first;
    int laps = 0;
    std::size_t length() const { return first.end - first.begin; }
  };

  /// Laps of one condition repeat a motion. One that does another is refused, if `told` that it
  /// does not, by the key that told so in `lines`, one per lap; one that was broken off, or that
  /// nobody told of, is a motion of its own.
  void number_repetitions(bool told, const std::vector<const KeyLines*>& lines,
                          const std::string& path, std::string_view key) {
    std::vector<Motion> motions;
    std::vector<std::size_t> motion_of;
    for (std::size_t i = 0; i < record_.stretches.size(); ++i) {
      Stretch& lap = record_.stretches[i];
      std::string unlike;
      std::size_t m = 0;
      for (; m < motions.size(); ++m) {
        if (motions[m].told != lap.condition) continue;
        const bool same = same_way(record_, lap, record_, motions[m].first);
        const std::string off =
            same ? other_length(lap, motions[m].first) : "are different motions";
        if (off.empty()) break;
        unlike =
            fmt::format("the laps \"{}\" at {:.3f} and {:.3f} s {}", lap.label,
                        record_.time_of(motions[m].first.begin), record_.time_of(lap.begin), off);
        if (!same && told)
          columns_.refuse(*lines[i], path, key,
                          unlike + "; laps of one condition repeat the same one");
      }
      if (m == motions.size()) {
        if (!unlike.empty())
          record_.warnings.push_back(unlike + ": they count as motions of their own");
        motions.push_back({lap.condition, lap});
      }
      motion_of.push_back(m);
      lap.repetition = motions[m].laps++;
    }
    const std::vector<int> conditions = conditions_of(motions);
    for (std::size_t i = 0; i < motion_of.size(); ++i)
      record_.stretches[i].condition = conditions[motion_of[i]];
  }

  /// Of the motions of one condition the one with the most laps keeps its number, of these the
  /// longest, so that the same laps have the same number in another run, where one is broken off.
  static std::vector<int> conditions_of(const std::vector<Motion>& motions) {
    int next = 0;
    std::map<int, std::size_t> chief;
    for (std::size_t m = 0; m < motions.size(); ++m) {
      next = std::max(next, motions[m].told + 1);
      const std::size_t c = chief.try_emplace(motions[m].told, m).first->second;
      if (std::pair(motions[m].laps, motions[m].length()) >
          std::pair(motions[c].laps, motions[c].length()))
        chief[motions[m].told] = m;
    }
    std::vector<int> conditions;
    for (std::size_t m = 0; m < motions.size(); ++m)
      conditions.push_back(chief[motions[m].told] == m ? motions[m].told : next++);
    return conditions;
  }

  /// Empty: both last as long.
  std::string other_length(const Stretch& lap, const Stretch& first) const {
    const auto a = static_cast<double>(first.end - first.begin);
    const auto b = static_cast<double>(lap.end - lap.begin);
    if (std::abs(a - b) <= kBeyond + kBrokenOff * a) return "";
    return fmt::format("take {:.3f} and {:.3f} s", a * base_.period, b * base_.period);
  }

  static std::string too_short(std::size_t samples) {
    return fmt::format("a lap has {} samples of the run; at least {} are needed to tell its noise",
                       samples, kShortestLap);
  }

  const MapColumns& columns_;
  const ImportMap& map_;
  const TimeBase& base_;
  Record& record_;
};

}  // namespace

void add_told_laps(const MapColumns& columns, const TimeBase& base, Record& record) {
  LapCut cut(columns, base, record);
  if (!columns.map().laps.empty())
    cut.by_times();
  else if (!columns.map().lap_column.empty())
    cut.by_column();
}

}  // namespace vcnc
