#include "bus/dds/dds_subscriber.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "bus/dds/entity.hpp"

namespace vcnc {
namespace {

constexpr int kTakeSliceMs = 50;
constexpr int kLateSlices = 20;               ///< patience with what should be on its way: 1 s
constexpr std::uint64_t kReportEvery = 2000;  ///< rows between two progress messages

using dds::check;

}  // namespace

struct DdsSubscriber::State {
  State(TelemetrySink& s, const DdsSubscriberOptions& options)
      : sink(s),
        domain(options.domain ? options.domain : std::make_shared<DdsDomain>()),
        participant(dds_create_participant(domain->id(), nullptr, nullptr), "the participant"),
        rows(participant, dds::stream_qos()),
        begins(participant, dds::state_qos()),
        alarms(participant, dds::state_qos()),
        ends(participant, dds::state_qos()),
        progress(participant, dds::progress_qos()),
        waitset(dds_create_waitset(participant.get()), "the waitset"),
        guid(dds::guid_of(rows.get())) {
    for (const dds_entity_t reader : {rows.get(), begins.get(), alarms.get(), ends.get()}) {
      check(dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS), "the waitset");
      check(dds_waitset_attach(waitset.get(), reader, 0), "the waitset");
    }
  }

  void run();
  void follow();
  void wait() {
    check(dds_waitset_wait(waitset.get(), nullptr, 0, DDS_MSECS(kTakeSliceMs)), "waiting");
  }
  void announce();
  void report(const dds::Guid& to);
  bool take_begin();
  bool take_rows();
  void take_alarms();
  void take_end();
  void deliver_rows(const vcnc_dds_Rows& batch);
  void deliver_alarms(std::uint64_t before_seq);
  void finish(RunEnd end, std::uint64_t total);
  bool machine_alive();
  bool is_stopping() {
    const std::lock_guard lock(mutex);
    return stopping;
  }

  TelemetrySink& sink;
  std::shared_ptr<DdsDomain> domain;
  dds::Entity participant;
  dds::Reader<vcnc_dds_Rows> rows;
  dds::Reader<vcnc_dds_Begin> begins;
  dds::Reader<vcnc_dds_Alarm> alarms;
  dds::Reader<vcnc_dds_End> ends;
  dds::Writer<vcnc_dds_Progress> progress;
  dds::Entity waitset;
  dds::Guid guid;

  // The thread's own.
  std::set<dds::Guid> announced;
  bool begun = false;
  std::string run_id;
  dds::Guid machine{};
  std::uint64_t next_seq = 0, reported_seq = 0, edge_lost = 0;
  bool any_row = false;
  struct PendingAlarm {
    std::uint64_t at_seq;
    Alarm alarm;
  };
  std::map<std::uint32_t, PendingAlarm> pending_alarms;
  std::uint32_t next_alarm = 0;
  struct PendingEnd {
    RunEnd end;
    std::uint64_t rows;
    std::uint32_t alarms;
  };
  std::optional<PendingEnd> pending_end;

  mutable std::mutex mutex;  ///< guards what follows
  std::condition_variable ended_changed;
  bool stopping = false, ended = false;
  std::uint64_t lost = 0;
  std::exception_ptr failure;
  std::thread thread;
};

DdsSubscriber::DdsSubscriber(TelemetrySink& sink, DdsSubscriberOptions options)
    : state_(std::make_unique<State>(sink, options)) {
  state_->thread = std::thread([this] { state_->run(); });
}

DdsSubscriber::~DdsSubscriber() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->thread.join();
}

bool DdsSubscriber::wait_for_end(int timeout_ms) {
  std::unique_lock lock(state_->mutex);
  const auto done = [&] { return state_->ended; };
  if (timeout_ms < 0) {
    state_->ended_changed.wait(lock, done);
  } else if (!state_->ended_changed.wait_for(lock, std::chrono::milliseconds(timeout_ms), done)) {
    return false;
  }
  if (state_->failure) std::rethrow_exception(state_->failure);
  return true;
}

std::uint64_t DdsSubscriber::lost_rows() const {
  const std::lock_guard lock(state_->mutex);
  return state_->lost;
}

// ------------------------------------------------------------------ the receiving thread
void DdsSubscriber::State::run() {
  std::exception_ptr error;
  try {
    follow();
  } catch (...) {
    error = std::current_exception();
  }
  const std::lock_guard lock(mutex);
  failure = error;
  ended = true;
  ended_changed.notify_all();
}

void DdsSubscriber::State::follow() {
  while (!begun) {
    if (is_stopping()) return;
    announce();
    if (!take_begin()) wait();
  }
  // From here on nobody reads it, and unread data would wake every wait.
  check(dds_waitset_detach(waitset.get(), begins.get()), "the waitset");
  int idle_slices = 0;
  while (!is_stopping()) {
    // Whether the machine lives is asked first: what it said before its death is taken after.
    const bool alive = machine_alive();
    take_end();
    idle_slices = take_rows() ? 0 : idle_slices + 1;
    take_alarms();
    deliver_alarms(next_seq);
    const bool all_rows = pending_end && next_seq >= pending_end->rows;
    const bool all_alarms = pending_end && next_alarm >= pending_end->alarms;
    if (pending_end && ((all_rows && all_alarms) || idle_slices > kLateSlices))
      return finish(pending_end->end, pending_end->rows);
    if (!pending_end && !alive && idle_slices > kLateSlices) {
      RunEnd gone;
      gone.reason = "NC unit gone";
      gone.cycles = static_cast<std::int64_t>(next_seq);
      return finish(gone, next_seq);
    }
    if (idle_slices > 0) wait();
  }
}

/// Tells every telemetry writer in sight that this subscriber is ready for its rows.
void DdsSubscriber::State::announce() {
  std::array<dds_instance_handle_t, 16> handles{};
  const auto n = static_cast<std::size_t>(
      check(dds_get_matched_publications(rows.get(), handles.data(), handles.size()), "matching"));
  for (std::size_t i = 0; i < std::min(n, handles.size()); ++i) {
    dds_builtintopic_endpoint_t* endpoint =
        dds_get_matched_publication_data(rows.get(), handles[i]);
    if (endpoint == nullptr) continue;
    dds::Guid writer;
    std::copy(std::begin(endpoint->key.v), std::end(endpoint->key.v), writer.begin());
    dds_builtintopic_free_endpoint(endpoint);
    if (announced.insert(writer).second) report(writer);
  }
}

void DdsSubscriber::State::report(const dds::Guid& to) {
  vcnc_dds_Progress sample{};
  std::copy(guid.begin(), guid.end(), std::begin(sample.reader));
  std::copy(to.begin(), to.end(), std::begin(sample.writer));
  sample.next_seq = next_seq;
  reported_seq = next_seq;
  const dds_return_t result = progress.write(sample);
  if (result != DDS_RETCODE_TIMEOUT) check(result, "reporting the progress");
}

bool DdsSubscriber::State::take_begin() {
  std::optional<RunBegin> begin;
  begins.take([&](const vcnc_dds_Begin* b, const dds_sample_info_t&) {
    if (b == nullptr || begin) return;
    begin = RunBegin{b->run_id, b->program_name, b->declared_toml, b->piece_toml, b->seed};
    std::copy(std::begin(b->writer), std::end(b->writer), machine.begin());
  });
  if (!begin) return false;
  begun = true;
  run_id = begin->run_id;
  sink.begin(*begin);
  return true;
}

bool DdsSubscriber::State::take_rows() {
  const std::size_t n = rows.take([&](const vcnc_dds_Rows* batch, const dds_sample_info_t&) {
    if (batch != nullptr && run_id == batch->run_id) deliver_rows(*batch);
  });
  return n > 0;
}

void DdsSubscriber::State::deliver_rows(const vcnc_dds_Rows& batch) {
  if (batch.width != kRowWidth || batch.values._length % kRowWidth != 0)
    throw DdsError(
        fmt::format("DDS: rows of {} numbers arrive, this program knows {}: the NC unit is of "
                    "another version",
                    batch.width, kRowWidth));
  // Alarms travel on their own; those before these rows are on their way.
  for (int slices = 0; next_alarm + pending_alarms.size() < batch.alarms && slices < kLateSlices;) {
    take_alarms();
    if (next_alarm + pending_alarms.size() < batch.alarms) ++slices, wait();
  }
  if (batch.first_seq > next_seq) {
    const std::uint64_t missing = batch.first_seq - next_seq;
    if (!any_row) edge_lost += missing;
    const std::lock_guard lock(mutex);
    lost += missing;
  }
  next_seq = std::max(next_seq, batch.first_seq);
  any_row = true;
  std::array<double, kRowWidth> numbers{};
  for (std::size_t at = 0; at < batch.values._length; at += kRowWidth) {
    deliver_alarms(next_seq);
    std::copy_n(batch.values._buffer + at, kRowWidth, numbers.begin());
    sink.row(std::bit_cast<TelemetryRow>(numbers));
    ++next_seq;
  }
  if (next_seq - reported_seq >= kReportEvery) report(machine);
}

void DdsSubscriber::State::take_alarms() {
  while (alarms.take([&](const vcnc_dds_Alarm* a, const dds_sample_info_t&) {
    if (a == nullptr || run_id != a->run_id || a->number < next_alarm) return;
    pending_alarms[a->number] = {a->at_seq, {a->tick, a->code, a->source, a->text}};
  }) > 0) {
  }
}

/// Alarms in their order, up to those raised before the row of this number.
void DdsSubscriber::State::deliver_alarms(std::uint64_t before_seq) {
  while (!pending_alarms.empty() && pending_alarms.begin()->first == next_alarm &&
         pending_alarms.begin()->second.at_seq <= before_seq) {
    sink.alarm(pending_alarms.begin()->second.alarm);
    pending_alarms.erase(pending_alarms.begin());
    ++next_alarm;
  }
}

void DdsSubscriber::State::take_end() {
  ends.take([&](const vcnc_dds_End* e, const dds_sample_info_t&) {
    if (e == nullptr || run_id != e->run_id) return;
    RunEnd end;
    end.complete = e->complete;
    end.reason = e->reason;
    end.cycles = e->cycles;
    end.trace_hash = e->trace_hash;
    end.wall_seconds = e->wall_seconds;
    end.bus_load_worst = e->bus_load_worst;
    end.gaps = e->gaps;
    pending_end = {end, e->rows, e->alarms};
  });
}

void DdsSubscriber::State::finish(RunEnd end, std::uint64_t total) {
  if (total > next_seq) {
    edge_lost += total - next_seq;
    const std::lock_guard lock(mutex);
    lost += total - next_seq;
  }
  deliver_alarms(total);
  end.gaps += edge_lost;
  sink.end(end);
}

/// The machine's writer asserts itself all the time; silence or its removal means it is gone.
bool DdsSubscriber::State::machine_alive() {
  dds_liveliness_changed_status_t status{};
  check(dds_get_liveliness_changed_status(rows.get(), &status), "liveliness");
  dds_subscription_matched_status_t matched{};
  check(dds_get_subscription_matched_status(rows.get(), &matched), "matching");
  return status.alive_count > 0 || matched.total_count == 0;
}

}  // namespace vcnc
