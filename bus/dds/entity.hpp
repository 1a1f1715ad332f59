// A thin owner layer over the C API of Cyclone DDS: entities, quality of service, typed topics.
// Private to this folder.
#pragma once

#include <dds/dds.h>

#include <array>
#include <memory>
#include <string>
#include <utility>

#include "bus/dds/domain.hpp"
#include "telemetry.h"

namespace vcnc::dds {

/// Passes results on; a negative one becomes a DdsError.
inline dds_return_t check(dds_return_t result, const char* what) {
  if (result < 0)
    throw DdsError(std::string("DDS: ") + what + " failed: " + dds_strretcode(-result));
  return result;
}

class Entity {
 public:
  Entity() = default;
  Entity(dds_entity_t handle, const char* what) : handle_(check(handle, what)) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Entity() {
    if (handle_ > 0) dds_delete(handle_);
  }
  dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

struct QosDelete {
  void operator()(dds_qos_t* q) const { dds_delete_qos(q); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDelete>;

/// How long a write may block before the caller is asked again.
inline constexpr dds_duration_t kMaxBlocking = DDS_MSECS(100);
/// A machine that does not assert itself for so long is gone.
inline constexpr dds_duration_t kLiveliness = DDS_SECS(3);

/// Nothing is lost: no limits, so that one slow reader cannot block the others of its process.
inline Qos stream_qos() {
  Qos q(dds_create_qos());
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, kMaxBlocking);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_liveliness(q.get(), DDS_LIVELINESS_AUTOMATIC, kLiveliness);
  return q;
}

/// The last state per key, also for those who join late.
inline Qos state_qos() {
  Qos q(dds_create_qos());
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_durability(q.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_durability_service(q.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  dds_qset_writer_data_lifecycle(q.get(), false);
  return q;
}

/// Progress of a subscriber: it is forgotten when the subscriber goes.
inline Qos progress_qos() {
  Qos q(dds_create_qos());
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, kMaxBlocking);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_durability(q.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  return q;
}

template <class T>
struct TopicOf;
#define VCNC_DDS_TOPIC(Type)                                                        \
  template <>                                                                       \
  struct TopicOf<vcnc_dds_##Type> {                                                 \
    static constexpr const char* kName = "vcnc_" #Type;                             \
    static const dds_topic_descriptor_t* type() { return &vcnc_dds_##Type##_desc; } \
  }
VCNC_DDS_TOPIC(Rows);
VCNC_DDS_TOPIC(Begin);
VCNC_DDS_TOPIC(Alarm);
VCNC_DDS_TOPIC(End);
VCNC_DDS_TOPIC(Progress);
#undef VCNC_DDS_TOPIC

template <class T>
Entity topic(const Entity& participant) {
  return {
      dds_create_topic(participant.get(), TopicOf<T>::type(), TopicOf<T>::kName, nullptr, nullptr),
      TopicOf<T>::kName};
}

template <class T>
class Writer {
 public:
  Writer(const Entity& participant, const Qos& qos)
      : topic_(topic<T>(participant)),
        writer_(dds_create_writer(participant.get(), topic_.get(), qos.get(), nullptr),
                TopicOf<T>::kName) {}
  /// DDS_RETCODE_TIMEOUT: the cache is full, try again.
  dds_return_t write(const T& sample) { return dds_write(writer_.get(), &sample); }
  dds_entity_t get() const { return writer_.get(); }
  std::uint32_t matched() const {
    dds_publication_matched_status_t status{};
    check(dds_get_publication_matched_status(writer_.get(), &status), "matching");
    return status.current_count;
  }

 private:
  Entity topic_, writer_;
};

template <class T>
class Reader {
 public:
  Reader(const Entity& participant, const Qos& qos)
      : topic_(topic<T>(participant)),
        reader_(dds_create_reader(participant.get(), topic_.get(), qos.get(), nullptr),
                TopicOf<T>::kName) {}
  dds_entity_t get() const { return reader_.get(); }

  /// Calls f(sample or null, info) for everything there is, at most kMost; returns how many.
  template <class F>
  std::size_t take(F&& f) {
    constexpr std::size_t kMost = 64;
    std::array<void*, kMost> samples{};
    std::array<dds_sample_info_t, kMost> infos;
    Loan loan{
        reader_.get(), samples.data(),
        check(dds_take(reader_.get(), samples.data(), infos.data(), kMost, kMost), "reading")};
    const auto n = static_cast<std::size_t>(loan.count);
    for (std::size_t i = 0; i < n; ++i)
      f(infos[i].valid_data ? static_cast<const T*>(samples[i]) : nullptr, infos[i]);
    return n;
  }

 private:
  struct Loan {
    dds_entity_t reader;
    void** samples;
    dds_return_t count;
    ~Loan() {
      if (count > 0) dds_return_loan(reader, samples, count);
    }
  };
  Entity topic_, reader_;
};

using Guid = std::array<std::uint8_t, 16>;
inline Guid guid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  check(dds_get_guid(entity, &guid), "the identity");
  Guid result;
  std::copy(std::begin(guid.v), std::end(guid.v), result.begin());
  return result;
}

}  // namespace vcnc::dds
