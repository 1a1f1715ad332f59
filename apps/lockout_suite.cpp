#include "apps/lockout_suite.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "apps/lockout_random.hpp"
#include "model/input_error.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

/// "crash-17": the number; -1 where `id` does not begin so.
std::int64_t number_after(const std::string& id, const std::string& prefix) {
  if (!id.starts_with(prefix) || id.size() == prefix.size() || id.size() > prefix.size() + 15)
    return -1;
  std::int64_t number = 0;
  for (std::size_t i = prefix.size(); i < id.size(); ++i) {
    if (id[i] < '0' || id[i] > '9') return -1;
    number = 10 * number + (id[i] - '0');
  }
  return number;
}

}  // namespace

std::vector<LockoutItem> lockout_items(const LockoutOptions& options) {
  std::vector<LockoutItem> items;
  std::set<std::string> used;
  std::optional<LockoutFolder> folder;
  for (const std::string& file : options.files) {
    std::string id = fs::path(file).stem().string();
    for (int copy = 2; !used.insert(id).second; ++copy)
      id = fmt::format("{}-{}", fs::path(file).stem().string(), copy);
    LockoutItem item{id, load_scenario(file)};
    if (item.scenario.name.empty()) item.scenario.name = item.id;
    if (!options.only.empty() && options.only != item.id) continue;
    if (!folder) folder.emplace();
    check_runnable(item.scenario, file, folder->path());
    items.push_back(std::move(item));
  }
  const std::int64_t crash = number_after(options.only, "crash-"),
                     ordinary = number_after(options.only, "ordinary-"),
                     faulted = number_after(options.only, "faulted-");
  const auto name = [](const char* prefix, std::uint64_t i) {
    return fmt::format("{}{}", prefix, i);
  };
  if (!options.only.empty() && items.empty() && crash < 0 && ordinary < 0 && faulted < 0)
    throw InputError(
        "--only " + options.only +
        ": no such run; expected crash-N, ordinary-N, faulted-N or the name of a scenario file");
  const bool all = options.only.empty();
  if ((all && options.crashes + options.ordinary + options.faulted > 0) || crash >= 0 ||
      ordinary >= 0 || faulted >= 0) {
    const ScenarioDraw draw(options.seed, options.machines);
    if (crash >= 0) items.push_back({options.only, draw.crash(static_cast<std::uint64_t>(crash))});
    if (ordinary >= 0)
      items.push_back({options.only, draw.ordinary(static_cast<std::uint64_t>(ordinary))});
    if (faulted >= 0)
      items.push_back({options.only, draw.faulted(static_cast<std::uint64_t>(faulted))});
    if (all) {
      for (std::uint64_t i = 0; i < options.crashes; ++i)
        items.push_back({name("crash-", i), draw.crash(i)});
      for (std::uint64_t i = 0; i < options.ordinary; ++i)
        items.push_back({name("ordinary-", i), draw.ordinary(i)});
      for (std::uint64_t i = 0; i < options.faulted; ++i)
        items.push_back({name("faulted-", i), draw.faulted(i)});
    }
  }
  return items;
}

LockoutFolder::LockoutFolder() {
  std::error_code error;
  std::string pattern = (fs::temp_directory_path(error) / "vcnc-lockout-XXXXXX").string();
  if (error || !::mkdtemp(pattern.data()))
    throw InputError("TMPDIR: no folder can be made in it; it must name a folder one can write to");
  path_ = pattern;
}

LockoutFolder::~LockoutFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::vector<LockoutVerdict> LockoutRunner::run(const std::vector<LockoutItem>& items) const {
  const LockoutFolder folder;
  const std::size_t threads = std::max<std::size_t>(
      1, std::min(items.size(), static_cast<std::size_t>(
                                    jobs > 0 ? static_cast<unsigned>(jobs)
                                             : std::max(1u, std::thread::hardware_concurrency()))));
  std::vector<LockoutVerdict> verdicts(items.size());
  std::vector<char> done(items.size(), 0);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t finished = 0, failed = 0, alive = threads;
  std::exception_ptr error;
  const auto stopped = [&] { return stop && *stop; };

  const auto work = [&] {
    TripLog log;
    try {
      for (std::size_t i; !stopped() && (i = next++) < items.size();) {
        verdicts[i] = run_lockout(items[i].id, items[i].scenario,
                                  {.work_folder = folder.path(), .sabotage = sabotage}, log);
        const std::lock_guard lock(mutex);
        done[i] = 1;
        ++finished;
        failed += verdicts[i].passed() ? 0 : 1;
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!error) error = std::current_exception();
      next = items.size();
    }
    const std::lock_guard lock(mutex);
    --alive;
    changed.notify_one();
  };
  std::vector<std::thread> workers;
  for (std::size_t i = 0; i < threads; ++i) workers.emplace_back(work);
  {
    std::unique_lock lock(mutex);
    while (alive > 0) {
      changed.wait_for(lock, std::chrono::milliseconds(200));
      if (!progress) continue;
      const std::size_t f = finished, bad = failed;
      lock.unlock();
      progress(f, bad);
      lock.lock();
    }
  }
  for (std::thread& worker : workers) worker.join();
  if (error) std::rethrow_exception(error);
  std::vector<LockoutVerdict> kept;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (done[i]) kept.push_back(std::move(verdicts[i]));
  return kept;
}

Distribution::Distribution(std::vector<double> values) : sorted(std::move(values)) {
  std::sort(sorted.begin(), sorted.end());
}

double Distribution::quantile(double share) const {
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(
                    std::clamp(rank, 1.0, static_cast<double>(sorted.size()))) -
                1];
}

std::vector<std::size_t> Distribution::histogram(double from, double to, std::size_t bins) const {
  std::vector<std::size_t> counts(bins, 0);
  for (const double v : sorted) {
    const double place = std::floor((v - from) / (to - from) * static_cast<double>(bins));
    ++counts[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(bins - 1)))];
  }
  return counts;
}

LockoutSummary summarise(const std::vector<LockoutVerdict>& verdicts) {
  LockoutSummary s;
  std::vector<double> soft, hard, distance, share, unchecked, lock, still;
  for (const LockoutVerdict& v : verdicts) {
    const TripFigures& f = v.figures;
    ++s.runs;
    if (v.process) {
      ++s.processes;
      s.as_expected += v.passed();
      continue;
    }
    const bool faulted = !v.faults.empty() || v.expect == Scenario::Expect::fault_safe;
    const bool crash = !faulted && v.expect != Scenario::Expect::none;
    ++(faulted ? s.faulted : crash ? s.crashes : s.ordinary);
    s.unsafe += faulted && !v.passed();
    s.borne += faulted && v.end.complete;
    s.as_expected += v.passed();
    s.refused += v.end.refused;
    s.soft += f.soft && !f.hard;
    s.hard += f.hard && !f.soft;
    s.both += f.soft && f.hard;
    s.missed += crash && v.expect != Scenario::Expect::refused && !v.end.refused && !f.tripped();
    s.false_trips += !crash && !faulted && f.tripped();
    if (faulted || !f.tripped()) continue;  // figures are those of the healthy machine
    s.uncountable += !f.countable;
    (v.within_limit ? share : unchecked).push_back(f.limit_share);
    if (f.countable && f.hard_threshold < f.quick_stop) hard.push_back(f.hard_reaction());
    s.early += !(f.threshold < f.action);
    if (!f.countable || !(f.threshold < f.action)) continue;
    soft.push_back(f.reaction());
    lock.push_back(f.locked - f.threshold);
    if (std::isfinite(f.standstill)) still.push_back(f.standstill - f.threshold);
    if (std::isfinite(f.stopping_distance)) distance.push_back(f.stopping_distance);
  }
  s.reaction = Distribution(std::move(soft));
  s.hard_reaction = Distribution(std::move(hard));
  s.stopping_distance = Distribution(std::move(distance));
  s.limit_share = Distribution(std::move(share));
  s.unchecked_share = Distribution(std::move(unchecked));
  s.lock_time = Distribution(std::move(lock));
  s.standstill_time = Distribution(std::move(still));
  return s;
}

}  // namespace vcnc
