#include "analysis/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <sstream>

#include "analysis/evaluation.hpp"
#include "configs/config.hpp"

namespace vcnc {
namespace {

/// FNV-1a over the bits of numbers.
class Fingerprint {
 public:
  void add(double value) {
    std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
    for (int i = 0; i < 8; ++i, bits >>= 8) hash_ = (hash_ ^ (bits & 0xff)) * 0x100000001b3u;
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

/// "table.key" to value, in the order of the text.
std::vector<std::pair<std::string, std::string>> keys_of(const std::string& toml) {
  std::vector<std::pair<std::string, std::string>> keys;
  std::istringstream in(toml);
  std::string line, table;
  std::map<std::string, int> listed;  // how many of a [[table]] there were
  while (std::getline(in, line)) {
    if (line.empty() || line.front() == '#') continue;
    if (line.starts_with("[[")) {
      const std::string name = line.substr(2, line.size() - 4);
      table = fmt::format("{}[{}].", name, listed[name]++);
      continue;
    }
    if (line.front() == '[') {
      table = line.substr(1, line.size() - 2) + ".";
      continue;
    }
    const std::size_t equals = line.find(" = ");
    if (equals != line.npos)
      keys.emplace_back(table + line.substr(0, equals), line.substr(equals + 3));
  }
  return keys;
}

/// Means of e_n in bins of the station, counted as the statistics are (analysis/evaluation.hpp):
/// whole laps of a closed line, else everything.
class Profile {
 public:
  void add(double s, double e_n, int lap) {
    if (lap != lap_) finish_lap(lap);
    const auto bin = static_cast<std::size_t>(std::max(s, 0.0) / kProfileBin);
    if (bin >= current_.size()) current_.resize(bin + 1);
    current_[bin].sum += e_n;
    ++current_[bin].count;
  }
  Curve curve(bool whole_laps) {
    if (!whole_laps) merge(rest_, laps_), merge(rest_, current_);
    const std::vector<Bin>& bins = whole_laps ? laps_ : rest_;
    Curve result;
    for (std::size_t i = 0; i < bins.size(); ++i)
      if (bins[i].count > 0)
        result.add((static_cast<double>(i) + 0.5) * kProfileBin,
                   bins[i].sum / static_cast<double>(bins[i].count));
    return result;
  }

 private:
  struct Bin {
    double sum = 0;
    std::int64_t count = 0;
  };
  static void merge(std::vector<Bin>& into, const std::vector<Bin>& from) {
    if (into.size() < from.size()) into.resize(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
      into[i].sum += from[i].sum;
      into[i].count += from[i].count;
    }
  }
  void finish_lap(int next) {
    merge(lap_ >= 1 && next > lap_ ? laps_ : rest_, current_);
    current_.clear();
    lap_ = next;
  }

  std::vector<Bin> current_, laps_, rest_;
  int lap_ = 0;
};

bool runs(const TelemetryRow& row) {
  const auto state = static_cast<NcState>(static_cast<int>(row.state));
  return state == NcState::running || state == NcState::dwell || state == NcState::hold;
}

bool measured(const ComparedRun& run) { return run.summary.groups.front().e_n.count > 0; }

/// Why e_n of the two cannot be put over one station; empty: it can.
std::string line_obstacle(const Comparison& c) {
  for (const ComparedRun* run : {&c.a, &c.b})
    if (!measured(*run))
      return fmt::format("e_n: run {} measured nothing on a piece.", run == &c.a ? "A" : "B");
  if (!c.piece.empty())
    return fmt::format("e_n station by station: the pieces differ ({} and {}).",
                       c.a.summary.piece_name, c.b.summary.piece_name);
  const Summary &a = c.a.summary, &b = c.b.summary;
  if ((a.line_length > 0) != (b.line_length > 0))
    return "e_n station by station: only one of the runs follows a scan line.";
  if (a.line_length > 0 &&
      (std::abs(a.line_z - b.line_z) > 0.05e-3 || std::abs(a.line_length - b.line_length) > 0.5e-3))
    return fmt::format(
        "e_n station by station: the scan lines differ ({:.2f} mm at z = {:.3f} mm and {:.2f} mm "
        "at z = {:.3f} mm).",
        a.line_length * 1e3, a.line_z * 1e3, b.line_length * 1e3, b.line_z * 1e3);
  if (!(a.line_length > 0) && !c.same_motion)
    return "e_n station by station: without a scan line it needs the same commanded motion.";
  return "";
}

// ----------------------------------------------------------------------------------------- text

double in_um(double metres) { return std::round(metres * 1e8) / 100 + 0.0; }

std::string cell(double value, int digits = 2) { return fmt::format("{:>10.{}f}", value, digits); }

std::string error_rows(const char* name, const Statistics& a, const Statistics& b) {
  std::string text;
  const auto row = [&](const char* who, auto&& get) {
    text += fmt::format("  {:<8} {:<5}", who[0] == 'A' ? name : "", who);
    for (const double value : get()) text += cell(value);
    text += '\n';
  };
  const auto figures = [](const Statistics& s) {
    return std::array{in_um(s.max), in_um(s.min), in_um(s.mean()), in_um(s.rms()),
                      in_um(s.peak_to_peak())};
  };
  row("A", [&] { return figures(a); });
  row("B", [&] { return figures(b); });
  row("B-A", [&] {
    auto d = figures(b);
    const auto of_a = figures(a);
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = d[i] - of_a[i] + 0.0;
    return d;
  });
  return text;
}

std::string run_lines(const char* letter, const ComparedRun& run) {
  const Summary& s = run.summary;
  return fmt::format(
      "{}  {}\n   {} on {}{}; {:.2f} s, seed {}{}\n   {}  {}\n", letter, run.name, s.program_name,
      s.machine_name, s.piece_name.empty() ? ", no piece" : ", piece " + s.piece_name, run.seconds,
      s.seed, s.end.complete ? "" : ", " + s.end.reason, to_string(s.verdict), s.verdict_reason);
}

std::string axis_rows(const Comparison& c) {
  std::string text = fmt::format("  {:<8} {:<7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "axis", "",
                                 "max A", "max B", "B-A", "rms A", "rms B", "B-A");
  const auto row = [&](std::string_view axis, const char* what, const Statistics& a,
                       const Statistics& b, double scale, int digits) {
    const auto shown = [&](double v) {
      const double power = std::pow(10.0, digits);
      return std::round(v * scale * power) / power + 0.0;
    };
    text += fmt::format("  {:<8} {:<7}", axis, what);
    for (const auto& [x, y] : {std::pair{shown(a.max_abs()), shown(b.max_abs())},
                               std::pair{shown(a.rms()), shown(b.rms())}})
      text += cell(x, digits) + cell(y, digits) + cell(y - x + 0.0, digits);
    text += '\n';
  };
  for (std::size_t j = 0; j < kAxisCount; ++j)
    row(kAxisNames[j], is_rotary(j) ? "arcsec" : "um", c.a.summary.following[j],
        c.b.summary.following[j], is_rotary(j) ? 3600 / kDegree : 1e6, 2);
  for (std::size_t j = 0; j < kAxisCount; ++j)
    row(fmt::format("force {}", kAxisNames[j]), "%", c.a.force[j], c.b.force[j], 100, 2);
  return text;
}

std::string key_rows(const char* title, const std::vector<KeyDifference>& keys) {
  if (keys.empty()) return "";
  std::size_t width = 0;
  for (const KeyDifference& k : keys) width = std::max(width, k.key.size());
  std::string text = fmt::format("{}\n", title);
  constexpr std::size_t kMost = 60;
  const auto value = [](const std::string& v) {
    return v.empty() ? std::string("-") : v.size() <= kMost ? v : v.substr(0, kMost) + " ...";
  };
  for (const KeyDifference& k : keys)
    text += fmt::format("  {:<{}}  A {}   B {}\n", k.key, width, value(k.a), value(k.b));
  return text;
}

}  // namespace

ComparedRun read_run(const RecordingReader& recording, const std::string& name) {
  ComparedRun run;
  run.name = name;
  run.begin = recording.begin();
  Evaluation evaluation(recording.begin());
  run.seconds = static_cast<double>(recording.rows()) * seconds(1);
  for (Envelope& e : run.following) e = Envelope(0, run.seconds, 1200);
  Fingerprint motion;
  Profile profile;
  recording.for_each([&](const TelemetryRow& row) {
    const EvaluatedRow now = evaluation.row(row);
    for (std::size_t j = 0; j < kAxisCount; ++j) {
      motion.add(row.q_cmd[j]);
      run.following[j].add(seconds(now.error.tick), now.error.following[j]);
      if (runs(row)) run.force[j].add(row.force[j], seconds(now.error.tick));
    }
    if (now.counts()) profile.add(now.place.s, now.error.e_n, now.lap);
  });
  for (const Alarm& alarm : recording.alarms()) evaluation.alarm(alarm);
  run.summary = evaluation.finish(recording.end());
  run.motion = motion.value();
  run.profile = profile.curve(run.summary.whole_laps > 0);
  return run;
}

std::vector<KeyDifference> differing_keys(const std::string& a, const std::string& b) {
  const auto of_a = keys_of(a), of_b = keys_of(b);
  const std::map<std::string, std::string> in_a(of_a.begin(), of_a.end()),
      in_b(of_b.begin(), of_b.end());
  std::vector<KeyDifference> result;
  for (const auto& [key, value] : of_a) {
    const auto other = in_b.find(key);
    if (other == in_b.end())
      result.push_back({key, value, ""});
    else if (other->second != value)
      result.push_back({key, value, other->second});
  }
  for (const auto& [key, value] : of_b)
    if (!in_a.contains(key)) result.push_back({key, "", value});
  return result;
}

Comparison compare(ComparedRun a, ComparedRun b) {
  Comparison c;
  c.a = std::move(a);
  c.b = std::move(b);
  c.machine = differing_keys(c.a.begin.declared_toml, c.b.begin.declared_toml);
  // Where the piece file lies is no property of the machine.
  std::erase_if(c.machine, [](const KeyDifference& k) { return k.key == "setup.piece"; });
  c.piece = differing_keys(c.a.begin.piece_toml, c.b.begin.piece_toml);
  const Summary &sa = c.a.summary, &sb = c.b.summary;
  c.same_motion = sa.rows == sb.rows && c.a.motion == c.b.motion;
  c.same_trace = !sa.end.trace_hash.empty() && sa.end.trace_hash == sb.end.trace_hash;
  const std::string obstacle = line_obstacle(c);
  c.same_line = obstacle.empty();
  if (!c.same_line) c.not_comparable.push_back(obstacle);
  if (c.same_line) {
    std::map<double, double> before;
    for (std::size_t i = 0; i < c.a.profile.size(); ++i)
      before[c.a.profile.x[i]] = c.a.profile.y[i];
    for (std::size_t i = 0; i < c.b.profile.size(); ++i)
      if (const auto at = before.find(c.b.profile.x[i]); at != before.end())
        c.e_n_difference.add(at->first, c.b.profile.y[i] - at->second);
  }
  if (!c.same_motion)
    c.not_comparable.push_back(
        "Following error and force moment by moment: the commanded motions differ.");
  if (sa.end.trace_hash.empty() || sb.end.trace_hash.empty())
    c.not_comparable.push_back("Trace hash: a run was interrupted before it had one.");
  for (const ComparedRun* run : {&c.a, &c.b})
    if (!run->summary.end.complete)
      c.not_comparable.push_back(fmt::format("The whole program: run {} ended early ({}).",
                                             run == &c.a ? "A" : "B", run->summary.end.reason));
  return c;
}

std::string to_text(const Comparison& c) {
  const Summary &a = c.a.summary, &b = c.b.summary;
  std::string text = run_lines("A", c.a) + run_lines("B", c.b);
  text += fmt::format("commanded motion: {};  trace hash: {}\n",
                      c.same_motion ? "equal" : "differs", c.same_trace ? "equal" : "differs");
  if (measured(c.a) && measured(c.b)) {
    const ErrorGroup &ga = a.groups.front(), &gb = b.groups.front();
    text += fmt::format("  {:<8} {:<5}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "error/um", "", "max",
                        "min", "mean", "rms", "p-p");
    text += error_rows("e_n", ga.e_n, gb.e_n) + error_rows("e_plan", ga.e_plan, gb.e_plan) +
            error_rows("e_servo", ga.e_servo, gb.e_servo) +
            error_rows("e_rest", ga.e_rest, gb.e_rest);
  }
  if (c.same_line && c.e_n_difference.size() > 0)
    text += fmt::format(
        "  e_n station by station, B-A: mean {:.2f}, rms {:.2f}, largest {:.2f} um over {:.1f} "
        "mm\n",
        in_um(mean(c.e_n_difference)), in_um(rms(c.e_n_difference)),
        in_um(max_abs(c.e_n_difference)),
        static_cast<double>(c.e_n_difference.size()) * kProfileBin * 1e3);
  text += axis_rows(c);
  // What was injected is not in a recording: the analysis is not to know.
  text += c.machine.empty() ? "declared machines: equal (injected effects are not compared)\n"
                            : key_rows("declared machines differ:", c.machine);
  text += key_rows("pieces differ:", c.piece);
  if (!c.not_comparable.empty()) text += "cannot be compared:\n";
  for (const std::string& sentence : c.not_comparable) text += "  " + sentence + "\n";
  return text;
}

}  // namespace vcnc
