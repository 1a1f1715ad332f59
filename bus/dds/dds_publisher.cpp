#include "bus/dds/dds_publisher.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "bus/dds/entity.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kWakeRows = 20;                     ///< rows that are worth a message
constexpr std::size_t kMostRows = 100;                    ///< rows in one message
constexpr auto kPatience = std::chrono::milliseconds(2);  ///< with fewer rows than that
constexpr int kMatchSliceMs = 20;
constexpr int kStallMs = 60'000;  ///< a subscriber that takes nothing for so long is stuck

using dds::check;

template <std::size_t N>
void copy_id(char (&to)[N], const std::string& from) {
  const std::size_t n = std::min(N - 1, from.size());
  std::memcpy(to, from.data(), n);
  to[n] = '\0';
}

char* text(const std::string& s) { return const_cast<char*>(s.c_str()); }  // DDS only reads it

}  // namespace

struct DdsPublisher::State {
  explicit State(DdsPublisherOptions o)
      : options(std::move(o)),
        domain(options.domain ? options.domain : std::make_shared<DdsDomain>()),
        participant(dds_create_participant(domain->id(), nullptr, nullptr), "the participant"),
        rows(participant, dds::stream_qos()),
        begins(participant, dds::state_qos()),
        alarms(participant, dds::state_qos()),
        ends(participant, dds::state_qos()),
        progress(participant, dds::progress_qos()),
        waitset(dds_create_waitset(participant.get()), "the waitset"),
        guid(dds::guid_of(rows.get())),
        ring(options.buffer_rows) {
    batch.reserve(kMostRows * kRowWidth);
    pending_alarms.reserve(64);
    check(dds_set_status_mask(progress.get(), DDS_DATA_AVAILABLE_STATUS), "the waitset");
    check(dds_waitset_attach(waitset.get(), progress.get(), 0), "the waitset");
  }

  struct Slot {
    std::uint64_t seq = 0;
    TelemetryRow row;
  };
  struct PendingAlarm {
    std::uint64_t at_seq = 0;
    Alarm alarm;
  };

  void run();
  void publish_pending(std::unique_lock<std::mutex>& lock);
  void write_alarms(const std::vector<PendingAlarm>& list);
  void write_rows(std::uint64_t first_seq, std::uint64_t dropped_so_far);
  template <class T>
  void write(dds::Writer<T>& writer, const T& sample);
  std::size_t read_progress();  ///< returns the number of subscribers
  bool anyone_behind(std::uint64_t seq);
  void await_window(std::uint64_t seq);
  bool is_stopping() {
    const std::lock_guard lock(mutex);
    return stopping;
  }

  DdsPublisherOptions options;
  std::shared_ptr<DdsDomain> domain;
  dds::Entity participant;
  dds::Writer<vcnc_dds_Rows> rows;
  dds::Writer<vcnc_dds_Begin> begins;
  dds::Writer<vcnc_dds_Alarm> alarms;
  dds::Writer<vcnc_dds_End> ends;
  dds::Reader<vcnc_dds_Progress> progress;
  dds::Entity waitset;
  dds::Guid guid;

  std::mutex mutex;  ///< guards what follows
  std::condition_variable filled, drained;
  std::vector<Slot> ring;
  std::size_t head = 0, count = 0;
  std::uint64_t next_seq = 0, dropped = 0;
  std::vector<PendingAlarm> pending_alarms;
  bool stopping = false, idle = true;
  std::string failure;

  // Before the thread starts: the caller's; from then on only the thread's.
  std::string run_id;
  std::vector<double> batch;
  std::uint32_t alarm_number = 0;
  std::thread thread;

  std::mutex subscribers_mutex;
  std::map<dds_instance_handle_t, std::uint64_t> subscribers;  ///< how far each of them is
};

// ------------------------------------------------------------------ the machine's side
DdsPublisher::DdsPublisher(DdsPublisherOptions options)
    : state_(std::make_unique<State>(std::move(options))) {}

DdsPublisher::~DdsPublisher() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->filled.notify_all();
  state_->drained.notify_all();
  if (state_->thread.joinable()) state_->thread.join();
}

void DdsPublisher::wait_for_subscriber(int timeout_ms) {
  State& s = *state_;
  for (int waited_ms = 0;; waited_ms += kMatchSliceMs) {
    if (const std::size_t n = s.read_progress(); n > 0 && s.rows.matched() >= n) return;
    if (waited_ms >= timeout_ms)
      throw DdsError("no analysis has subscribed to the telemetry within " +
                     std::to_string(timeout_ms) + " ms");
    // Matching has no data to wake up for, so the wait is cut into slices
    check(dds_waitset_wait(s.waitset.get(), nullptr, 0, DDS_MSECS(kMatchSliceMs)), "waiting");
  }
}

void DdsPublisher::begin(const RunBegin& begin) {
  State& s = *state_;
  if (s.thread.joinable()) throw std::logic_error("the run has begun already");
  s.run_id = begin.run_id.substr(0, sizeof(vcnc_dds_Rows::run_id) - 1);
  vcnc_dds_Begin sample{};
  copy_id(sample.run_id, s.run_id);
  std::copy(s.guid.begin(), s.guid.end(), std::begin(sample.writer));
  sample.program_name = text(begin.program_name);
  sample.declared_toml = text(begin.declared_toml);
  sample.piece_toml = text(begin.piece_toml);
  sample.seed = begin.seed;
  check(s.begins.write(sample), "publishing the begin of the run");
  s.thread = std::thread([&s] { s.run(); });
}

void DdsPublisher::row(const TelemetryRow& row) {
  State& s = *state_;
  bool wake = false;
  {
    std::unique_lock lock(s.mutex);
    const std::uint64_t seq = s.next_seq++;
    if (!s.options.paced)
      s.drained.wait(lock,
                     [&] { return s.count < s.ring.size() || s.stopping || !s.failure.empty(); });
    if (s.count == s.ring.size() || !s.failure.empty()) {
      ++s.dropped;
      return;
    }
    s.ring[(s.head + s.count) % s.ring.size()] = {seq, row};
    ++s.count;
    wake = s.count == 1 || s.count == kWakeRows;
  }
  if (wake) s.filled.notify_one();
}

void DdsPublisher::alarm(const Alarm& alarm) {
  State& s = *state_;
  {
    const std::lock_guard lock(s.mutex);
    s.pending_alarms.push_back({s.next_seq, alarm});
  }
  s.filled.notify_one();
}

void DdsPublisher::end(const RunEnd& end) {
  State& s = *state_;
  std::uint64_t total = 0;
  {
    std::unique_lock lock(s.mutex);
    s.drained.wait(lock, [&] {
      return (s.count == 0 && s.pending_alarms.empty() && s.idle) || !s.failure.empty();
    });
    if (!s.failure.empty()) throw DdsError(s.failure);
    total = s.next_seq;
  }
  constexpr dds_duration_t kDelivery = DDS_SECS(30);
  check(dds_wait_for_acks(s.rows.get(), kDelivery), "delivering the last rows");
  vcnc_dds_End sample{};
  copy_id(sample.run_id, s.run_id);
  sample.rows = total;
  sample.alarms = s.alarm_number;
  sample.complete = end.complete;
  sample.reason = text(end.reason);
  sample.cycles = end.cycles;
  sample.trace_hash = text(end.trace_hash);
  sample.wall_seconds = end.wall_seconds;
  sample.bus_load_worst = end.bus_load_worst;
  sample.gaps = end.gaps;
  check(s.ends.write(sample), "publishing the end of the run");
  check(dds_wait_for_acks(s.ends.get(), kDelivery), "delivering the end of the run");
}

std::uint64_t DdsPublisher::dropped() const {
  const std::lock_guard lock(state_->mutex);
  return state_->dropped;
}

// ------------------------------------------------------------------ the publishing thread
void DdsPublisher::State::run() {
  std::unique_lock lock(mutex);
  try {
    while (true) {
      idle = true;
      if (count == 0 && pending_alarms.empty()) drained.notify_all();
      filled.wait(lock, [&] { return stopping || count > 0 || !pending_alarms.empty(); });
      if (stopping) return;
      idle = false;
      filled.wait_for(lock, kPatience, [&] { return stopping || count >= kWakeRows; });
      publish_pending(lock);
    }
  } catch (const std::exception& e) {
    if (!lock.owns_lock()) lock.lock();
    failure = e.what();
    dropped += count;
    count = 0;
    drained.notify_all();
  }
}

// Takes what may travel in one message: rows without a gap, up to the next alarm.
void DdsPublisher::State::publish_pending(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t first = count > 0 ? ring[head].seq : next_seq;
  std::vector<PendingAlarm> due;
  while (!pending_alarms.empty() && pending_alarms.front().at_seq <= first) {
    due.push_back(std::move(pending_alarms.front()));
    pending_alarms.erase(pending_alarms.begin());
  }
  const std::uint64_t stop =
      pending_alarms.empty() ? ~std::uint64_t{0} : pending_alarms.front().at_seq;
  batch.clear();
  std::uint64_t seq = first;
  while (count > 0 && batch.size() < kMostRows * kRowWidth && ring[head].seq == seq && seq < stop) {
    const auto numbers = std::bit_cast<std::array<double, kRowWidth>>(ring[head].row);
    batch.insert(batch.end(), numbers.begin(), numbers.end());
    head = (head + 1) % ring.size();
    --count;
    ++seq;
  }
  const std::uint64_t dropped_so_far = dropped;
  lock.unlock();
  drained.notify_all();
  write_alarms(due);
  if (!batch.empty()) write_rows(first, dropped_so_far);
  lock.lock();
}

void DdsPublisher::State::write_alarms(const std::vector<PendingAlarm>& list) {
  for (const PendingAlarm& pending : list) {
    vcnc_dds_Alarm sample{};
    copy_id(sample.run_id, run_id);
    sample.number = alarm_number++;
    sample.at_seq = pending.at_seq;
    sample.tick = pending.alarm.tick;
    sample.code = pending.alarm.code;
    sample.source = text(pending.alarm.source);
    sample.text = text(pending.alarm.text);
    write(alarms, sample);
  }
}

void DdsPublisher::State::write_rows(std::uint64_t first_seq, std::uint64_t dropped_so_far) {
  if (!options.paced) await_window(first_seq);
  vcnc_dds_Rows sample{};
  copy_id(sample.run_id, run_id);
  sample.first_seq = first_seq;
  sample.dropped = dropped_so_far;
  sample.alarms = alarm_number;
  sample.width = kRowWidth;
  sample.values._buffer = batch.data();
  sample.values._length = sample.values._maximum = static_cast<std::uint32_t>(batch.size());
  write(rows, sample);
}

template <class T>
void DdsPublisher::State::write(dds::Writer<T>& writer, const T& sample) {
  dds_return_t result = writer.write(sample);
  while (result == DDS_RETCODE_TIMEOUT && !is_stopping()) result = writer.write(sample);
  if (result != DDS_RETCODE_TIMEOUT) check(result, "publishing");
}

std::size_t DdsPublisher::State::read_progress() {
  const std::lock_guard lock(subscribers_mutex);
  while (progress.take([&](const vcnc_dds_Progress* p, const dds_sample_info_t& info) {
    if (info.instance_state != DDS_IST_ALIVE) {
      subscribers.erase(info.instance_handle);
    } else if (p != nullptr && std::equal(guid.begin(), guid.end(), std::begin(p->writer))) {
      subscribers[info.instance_handle] = p->next_seq;
    }
  }) > 0) {
  }
  return subscribers.size();
}

bool DdsPublisher::State::anyone_behind(std::uint64_t seq) {
  const std::lock_guard lock(subscribers_mutex);
  return std::any_of(subscribers.begin(), subscribers.end(),
                     [&](const auto& s) { return s.second + options.window_rows < seq; });
}

void DdsPublisher::State::await_window(std::uint64_t seq) {
  read_progress();
  for (int waited_ms = 0; anyone_behind(seq) && !is_stopping(); waited_ms += kMatchSliceMs) {
    if (waited_ms >= kStallMs) throw DdsError("a subscriber has stopped taking rows");
    check(dds_waitset_wait(waitset.get(), nullptr, 0, DDS_MSECS(kMatchSliceMs)), "waiting");
    read_progress();
  }
}

}  // namespace vcnc
