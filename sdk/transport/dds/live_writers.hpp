#pragma once
// The writers of a reader, and their participants.

#include <dds/dds.h>

#include <map>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "sdk/transport/dds/entity.hpp"
#include "sdk/wire/session_book.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport::dds {

/// Tracks the liveliness of every writer that is matched with one reader. Thread-safe.
///
/// DDS itself only tells how many writers are alive; only a listener learns which. The listener does nothing
/// but record that.
class LiveWriters {
 public:
  /// `bell`: rung by each change; may be null.
  explicit LiveWriters(Doorbell* bell);
  LiveWriters(const LiveWriters&) = delete;
  LiveWriters& operator=(const LiveWriters&) = delete;
  ~LiveWriters() = default;

  /// Needed to create the reader, which must not outlive this object.
  [[nodiscard]] const dds_listener_t* listener() const { return listener_.get(); }
  [[nodiscard]] WriterState state(dds_instance_handle_t writer) const;
  struct Life {
    bool is_live = false, was_live = false;
  };
  /// All matched writers.
  [[nodiscard]] std::map<dds_instance_handle_t, Life> matched() const;

 private:
  struct ListenerDeleter {
    void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
  };
  void note(const dds_liveliness_changed_status_t& status);

  Doorbell* const bell_;
  mutable std::mutex mutex_;
  std::map<dds_instance_handle_t, Life> lives_;
  std::unique_ptr<dds_listener_t, ListenerDeleter> listener_;
};

/// Finds the participant behind a writer handle, and remembers it. Not thread-safe.
class Participants {
 public:
  /// Empty if the writer is not matched with `reader` any more.
  [[nodiscard]] std::optional<ParticipantId> of_writer(dds_entity_t reader, dds_instance_handle_t writer);

 private:
  std::unordered_map<dds_instance_handle_t, ParticipantId> known_;
};

[[nodiscard]] ParticipantId to_participant_id(const dds_guid_t& guid);

}  // namespace tandem::transport::dds
