#include "sdk/transport/dds/live_writers.hpp"

#include <algorithm>
#include <iterator>

namespace tandem::transport::dds {
namespace {

// Writer handles are never reused, so entries only age. The limit is far above the number of writers of a
// session.
constexpr std::size_t kMaxKnown = 4096;

}  // namespace

LiveWriters::LiveWriters(Doorbell* bell) : bell_(bell), listener_(dds_create_listener(this)) {
  dds_lset_liveliness_changed(
      listener_.get(), [](dds_entity_t /*reader*/, const dds_liveliness_changed_status_t status, void* self) {
        static_cast<LiveWriters*>(self)->note(status);
      });
}

void LiveWriters::note(const dds_liveliness_changed_status_t& status) {
  {
    const std::lock_guard lock(mutex_);
    const dds_instance_handle_t writer = status.last_publication_handle;
    if (status.alive_count_change > 0) {
      lives_[writer] = {.is_live = true, .was_live = true};
    } else if (status.not_alive_count_change > 0) {
      lives_[writer].is_live = false;
    } else {
      lives_.erase(writer);
    }
  }
  if (bell_ != nullptr) bell_->ring();
}

WriterState LiveWriters::state(dds_instance_handle_t writer) const {
  const std::lock_guard lock(mutex_);
  const auto found = lives_.find(writer);
  if (found == lives_.end()) return WriterState::kGone;
  return found->second.is_live ? WriterState::kLive : WriterState::kSilent;
}

std::map<dds_instance_handle_t, LiveWriters::Life> LiveWriters::matched() const {
  const std::lock_guard lock(mutex_);
  return lives_;
}

std::optional<ParticipantId> Participants::of_writer(dds_entity_t reader, dds_instance_handle_t writer) {
  if (const auto known = known_.find(writer); known != known_.end()) return known->second;
  const Endpoint endpoint(dds_get_matched_publication_data(reader, writer));
  if (!endpoint) return std::nullopt;
  if (known_.size() >= kMaxKnown) known_.clear();
  return known_.emplace(writer, to_participant_id(endpoint->participant_key)).first->second;
}

ParticipantId to_participant_id(const dds_guid_t& guid) {
  ParticipantId id;
  static_assert(sizeof guid.v == sizeof id.bytes);
  std::copy(std::begin(guid.v), std::end(guid.v), id.bytes.begin());
  return id;
}

}  // namespace tandem::transport::dds
