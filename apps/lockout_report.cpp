#include "apps/lockout_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "model/safety/protection.hpp"

namespace vcnc {

namespace {

constexpr std::size_t kMostFailures = 20;  ///< told on the terminal

struct Row {
  const char* name;
  const char* unit;
  const Distribution* values;
  double scale;
};

std::vector<Row> rows(const LockoutSummary& s) {
  return {{"out of range to braking", "ms", &s.reaction, 1e3},
          {"hard stage to quick stop", "ms", &s.hard_reaction, 1e3},
          {"spindle locked", "ms", &s.lock_time, 1e3},
          {"stand-still", "ms", &s.standstill_time, 1e3},
          {"stopping distance", "mm", &s.stopping_distance, 1e3},
          {"deepest, share of limit", "%", &s.limit_share, 100},
          {"  where it may pass it", "%", &s.unchecked_share, 100}};
}

std::string table(const LockoutSummary& s) {
  std::string text = fmt::format("{:26}{:>8}{:>10}{:>10}{:>10}{:>10}\n", "", "runs", "min",
                                 "median", "95 %", "max");
  for (const Row& row : rows(s)) {
    const Distribution& d = *row.values;
    if (d.empty()) continue;
    text += fmt::format("{:26}{:>8}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}  {}\n", row.name,
                        d.sorted.size(), d.min() * row.scale, d.quantile(0.5) * row.scale,
                        d.quantile(0.95) * row.scale, d.max() * row.scale, row.unit);
  }
  return text;
}

std::string bars(const char* title, const Distribution& d, double scale, double from, double to,
                 std::size_t bins, const char* unit) {
  if (d.empty()) return "";
  std::string text = fmt::format("\n{}\n", title);
  const auto counts = d.histogram(from / scale, to / scale, bins);
  const std::size_t most = *std::max_element(counts.begin(), counts.end());
  const double width = (to - from) / static_cast<double>(bins);
  for (std::size_t i = 0; i < bins; ++i) {
    const double a = from + width * static_cast<double>(i);
    // Anything at all shows as a bar.
    const std::size_t length = (counts[i] * 50 + most - 1) / most;
    text += fmt::format("{:8.2f} .. {:<7.2f} {} {:>7} {}\n", a, a + width, unit, counts[i],
                        std::string(length, '#'));
  }
  return text;
}

std::string escaped_json(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 0x20)
      result += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    else
      result += c;
  }
  return result;
}

/// A number of JSON: what never happened is null.
std::string number(double v) { return std::isfinite(v) ? fmt::format("{}", v) : "null"; }

std::string distribution_json(const Distribution& d, double scale) {
  if (d.empty()) return "{\"runs\": 0}";
  return fmt::format("{{\"runs\": {}, \"min\": {}, \"median\": {}, \"p95\": {}, \"max\": {}}}",
                     d.sorted.size(), number(d.min() * scale), number(d.quantile(0.5) * scale),
                     number(d.quantile(0.95) * scale), number(d.max() * scale));
}

std::string run_json(const LockoutVerdict& v) {
  const TripFigures& f = v.figures;
  std::string failures;
  for (const std::string& sentence : v.failures)
    failures += fmt::format("{}\"{}\"", failures.empty() ? "" : ", ", escaped_json(sentence));
  std::string faults;
  for (const std::string& fault : v.faults)
    faults += fmt::format("{}\"{}\"", faults.empty() ? "" : ", ", escaped_json(fault));
  return fmt::format(
      "    {{\"id\": \"{}\", \"name\": \"{}\", \"kind\": \"{}\", \"expect\": \"{}\", \"passed\": "
      "{}, "
      "\"failures\": [{}], \"refused\": {}, \"soft_stop\": {}, \"quick_stop\": {}, \"cause\": "
      "\"{}\", \"countable\": {}, \"threshold_ms\": {}, \"reaction_ms\": {}, \"hard_reaction_ms\": "
      "{}, \"lock_ms\": {}, "
      "\"standstill_ms\": {}, \"speed_mm_s\": {}, \"stopping_distance_mm\": {}, \"deepest_mm\": "
      "{}, "
      "\"force_N\": {}, \"share_of_limit\": {}, \"feed_checked\": {}, \"cycles\": {}, \"reason\": "
      "\"{}\", \"faults\": [{}], \"exit_code\": {}, \"phase\": \"{}\", \"trace_hash\": \"{}\"}}",
      escaped_json(v.id), escaped_json(v.name), to_string(v.kind), to_string(v.expect), v.passed(),
      failures, v.end.refused, f.soft, f.hard,
      f.tripped() ? text_of(static_cast<ProtectionCause>(f.cause)) : "", f.countable,
      number(f.threshold * 1e3), number(f.reaction() * 1e3), number(f.hard_reaction() * 1e3),
      number((f.locked - f.threshold) * 1e3), number((f.standstill - f.threshold) * 1e3),
      number(f.speed * 1e3), number(f.stopping_distance * 1e3), number(f.deepest * 1e3),
      number(f.force), number(f.limit_share), v.within_limit, v.cycles, escaped_json(v.end.reason),
      faults, v.process ? std::to_string(v.process->exit_code) : "null",
      v.process ? v.process->phase : "", v.trace_hash);
}

std::string escaped_xml(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return result;
}

}  // namespace

std::string repeat_arguments(const LockoutResults& results, const LockoutVerdict& verdict) {
  const bool drawn = verdict.id.starts_with("crash-") || verdict.id.starts_with("ordinary-") ||
                     verdict.id.starts_with("faulted-") || verdict.process;
  if (verdict.process)
    return fmt::format("--processes 1 --only {} --seed {}", verdict.id, results.seed);
  return drawn ? fmt::format("--only {} --seed {}", verdict.id, results.seed)
               : fmt::format("--only {}", verdict.id);
}

std::string process_table(const LockoutResults& r) {
  struct Row {
    std::size_t runs = 0, late = 0, unsafe = 0;
    std::map<int, std::size_t> codes;
    double longest = 0;
  };
  std::map<std::string, Row> by_kind, by_node, by_phase;
  for (const LockoutVerdict& v : r.verdicts) {
    if (!v.process) continue;
    const BusFault fault = parse_fault(v.faults.front());
    const auto kind = std::find_if(fault_kinds().begin(), fault_kinds().end(),
                                   [&](const FaultKind& k) { return k.kind == fault.kind; });
    for (Row* row :
         {&by_kind[std::string(kind->name)], &by_node[fault.node], &by_phase[v.process->phase]}) {
      ++row->runs;
      row->late += !v.process->struck;
      row->unsafe += !v.passed();
      ++row->codes[v.process->exit_code];
      row->longest = std::max(row->longest, v.process->seconds);
    }
  }
  if (by_kind.empty()) return "";
  std::string text =
      "\nreal processes       runs  not safe  after the end  exit 0  exit 1  exit 3  longest\n";
  for (const auto* rows : {&by_kind, &by_node, &by_phase}) {
    for (const auto& [name, row] : *rows) {
      const auto codes = [&codes_of = row.codes](int code) {
        const auto found = codes_of.find(code);
        return found == codes_of.end() ? std::size_t{0} : found->second;
      };
      text +=
          fmt::format("  {:18} {:>4}  {:>8}  {:>13}  {:>6}  {:>6}  {:>6}  {:>5.1f} s\n", name,
                      row.runs, row.unsafe, row.late, codes(0), codes(1), codes(3), row.longest);
    }
    text += "\n";
  }
  return text;
}

std::string lockout_text(const LockoutResults& r) {
  const LockoutSummary& s = r.summary;
  std::string text;
  if (r.interrupted) text += "interrupted: not every scenario was run\n";
  text += fmt::format(
      "{} runs in {:.1f} s: {} crashes, {} ordinary, {} crashes with a fault, {} on real "
      "processes, seed {}\n",
      s.runs, r.wall_seconds, s.crashes, s.ordinary, s.faulted, s.processes, r.seed);
  text += fmt::format("  refused before anything moved   {:>7}\n", s.refused);
  text += fmt::format("  soft stop and retraction        {:>7}\n", s.soft);
  text += fmt::format("  soft stop, then quick stop      {:>7}\n", s.both);
  text += fmt::format("  quick stop at once              {:>7}\n", s.hard);
  text += fmt::format("  of these too fast to be counted {:>7}\n", s.uncountable);
  text += fmt::format("  tripped before the range was left {:>5}\n", s.early);
  text += fmt::format("  missed trips                    {:>7}\n", s.missed);
  text += fmt::format("  trips in ordinary runs          {:>7}\n", s.false_trips);
  if (s.faulted > 0) {
    text += fmt::format("  with a fault: not safe          {:>7}\n", s.unsafe);
    text += fmt::format("  with a fault: ended as if none  {:>7}\n", s.borne);
  }
  text += fmt::format("  not as expected                 {:>7}\n\n", s.runs - s.as_expected);
  text += "from the physical threshold, times and ways\n" + table(s);
  text += bars("reaction: out of range to braking axes", s.reaction, 1e3, 0, 3, 12, "ms");
  text += bars("reaction: hard stage to quick stop", s.hard_reaction, 1e3, 0, 3, 12, "ms");
  text += bars("deepest deflection, share of the mechanical limit", s.limit_share, 100, 0, 100, 10,
               "%");
  text += process_table(r);
  std::size_t told = 0;
  for (const LockoutVerdict& v : r.verdicts) {
    if (v.passed()) continue;
    if (told++ >= kMostFailures) continue;
    text += fmt::format("\nNOT AS EXPECTED  {} ({})\n", v.id, v.name);
    for (const std::string& sentence : v.failures) text += "  " + sentence + "\n";
    text += "  repeat: vcnc lockout " + repeat_arguments(r, v) + " --out FOLDER\n";
  }
  if (told > kMostFailures)
    text += fmt::format("\nand {} more; see --json or --junit\n", told - kMostFailures);
  text += s.as_expected != s.runs ? "\nFAIL\n" : r.interrupted ? "\nINTERRUPTED\n" : "\nPASS\n";
  return text;
}

std::string lockout_json(const LockoutResults& r) {
  const LockoutSummary& s = r.summary;
  std::string text = "{\n";
  text += fmt::format(
      "  \"seed\": {},\n  \"runs\": {},\n  \"crashes\": {},\n  \"ordinary\": {},\n"
      "  \"faulted\": {},\n  \"processes\": {},\n  \"unsafe\": {},\n  \"borne\": {},\n"
      "  \"as_expected\": {},\n  \"missed\": {},\n  \"false_trips\": {},\n  \"refused\": {},\n"
      "  \"soft_stops\": {},\n  \"soft_then_quick_stops\": {},\n  \"quick_stops\": {},\n"
      "  \"uncountable\": {},\n  \"early\": {},\n  \"interrupted\": {},\n",
      r.seed, s.runs, s.crashes, s.ordinary, s.faulted, s.processes, s.unsafe, s.borne,
      s.as_expected, s.missed, s.false_trips, s.refused, s.soft, s.both, s.hard, s.uncountable,
      s.early, r.interrupted);
  const auto add = [&](const char* key, const Distribution& d, double scale) {
    text += fmt::format("  \"{}\": {},\n", key, distribution_json(d, scale));
  };
  add("reaction_ms", s.reaction, 1e3);
  add("hard_reaction_ms", s.hard_reaction, 1e3);
  add("lock_ms", s.lock_time, 1e3);
  add("standstill_ms", s.standstill_time, 1e3);
  add("stopping_distance_mm", s.stopping_distance, 1e3);
  add("share_of_limit", s.limit_share, 1);
  add("share_of_limit_unchecked", s.unchecked_share, 1);
  text += "  \"results\": [\n";
  for (std::size_t i = 0; i < r.verdicts.size(); ++i)
    text += run_json(r.verdicts[i]) + (i + 1 < r.verdicts.size() ? ",\n" : "\n");
  return text + "  ]\n}\n";
}

std::string lockout_junit(const LockoutResults& r) {
  std::map<std::string, std::vector<const LockoutVerdict*>> suites;
  for (const LockoutVerdict& v : r.verdicts)
    suites[v.process          ? "processes"
           : v.faults.empty() ? to_string(v.kind)
                              : "faulted"]
        .push_back(&v);
  const auto failed = [](const std::vector<const LockoutVerdict*>& suite) {
    return std::count_if(suite.begin(), suite.end(),
                         [](const LockoutVerdict* v) { return !v->passed(); });
  };
  const LockoutSummary& s = r.summary;
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuites name=\"vcnc lockout\" tests=\"{}\" failures=\"{}\" errors=\"0\">\n",
      s.runs, s.runs - s.as_expected);
  for (const auto& [kind, suite] : suites) {
    text += fmt::format(
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"0\">\n", kind,
        suite.size(), failed(suite));
    for (const LockoutVerdict* v : suite) {
      text += fmt::format("    <testcase classname=\"lockout.{}\" name=\"{}: {}\" time=\"{:.3f}\"",
                          kind, escaped_xml(v->id), escaped_xml(v->name),
                          static_cast<double>(v->cycles) * kCycle);
      if (v->passed()) {
        text += "/>\n";
        continue;
      }
      std::string all;
      for (const std::string& sentence : v->failures) all += sentence + "\n";
      text += fmt::format(
          ">\n      <failure message=\"{}\">{}repeat: vcnc lockout {}</failure>\n"
          "    </testcase>\n",
          escaped_xml(v->failures.front()), escaped_xml(all), escaped_xml(repeat_arguments(r, *v)));
    }
    text += "  </testsuite>\n";
  }
  return text + "</testsuites>\n";
}

}  // namespace vcnc
