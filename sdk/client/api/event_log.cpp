#include "sdk/client/api/event_log.hpp"

#include <utility>

namespace tandem::api {

EventLog::EventLog() : ring_(kMaxEvents) {}

void EventLog::add(Event event) {
  event.epoch = epoch_;
  event.at_ns = now_ns_;
  if (count_ == kMaxEvents) {
    first_ = (first_ + 1) % kMaxEvents;
    --count_;
    ++dropped_;
    ++dropped_since_;
  }
  ring_[(first_ + count_++) % kMaxEvents] = std::move(event);
}

std::optional<Event> EventLog::take() {
  if (count_ == 0) return std::nullopt;
  Event event = std::move(ring_[first_]);
  first_ = (first_ + 1) % kMaxEvents;
  --count_;
  event.dropped = std::exchange(dropped_since_, 0);
  return event;
}

void EventLog::on_session(const transport::SessionMessage& session) {
  const bool another = epoch_ != 0;
  epoch_ = session.epoch;
  playing_ = played_ = refused_ = demoted_ = was_alive_ = false;
  if (another) add({.kind = TANDEM_EVENT_NEW_EPOCH, .text = {}});
}

void EventLog::on_snapshot(const transport::SnapshotMessage& snapshot) {
  add({.kind = played_ ? TANDEM_EVENT_REJOINED : TANDEM_EVENT_PLAYING, .frame = snapshot.frame, .text = {}});
  playing_ = played_ = true;
}

void EventLog::on_resync(client::ResyncReason reason) {
  if (!std::exchange(playing_, false)) return;  // it was still joining
  add({.kind = TANDEM_EVENT_LOST, .text = describe(reason)});
}

void EventLog::on_outcome(const client::InputOutcome& outcome) {
  Event event;
  switch (outcome.kind) {
    case client::InputOutcome::Kind::kActed:
      event.kind = TANDEM_EVENT_INPUT_ACTED;
      event.frame = outcome.frame;
      break;
    case client::InputOutcome::Kind::kRefused:
      event.kind = TANDEM_EVENT_INPUT_REFUSED;
      event.reason = outcome.reason;
      event.text = outcome.text;
      break;
    case client::InputOutcome::Kind::kUnknown:
      event.kind = TANDEM_EVENT_INPUT_UNKNOWN;
      break;
    case client::InputOutcome::Kind::kLost:
      event.kind = TANDEM_EVENT_INPUT_LOST;
      break;
  }
  event.number = outcome.number;
  add(std::move(event));
}

void EventLog::on_happened(const client::Happened& event) {
  news_.add({.what = TANDEM_NEWS_EVENT,
             .epoch = event.epoch,
             .frame = event.frame,
             .number = event.number,
             .kind = event.event.kind,
             .body = event.event.body,
             .value_size = event.event.bytes.size(),
             .bytes = {event.event.bytes.begin(), event.event.bytes.end()}});
}

void EventLog::on_events_lost(Epoch epoch, Frame frame, std::uint64_t count) {
  news_.add({.what = TANDEM_NEWS_LOST, .epoch = epoch, .frame = frame, .number = count});
}

void EventLog::on_events_taken_back(Epoch epoch, Frame frame, std::uint64_t count) {
  news_.add({.what = TANDEM_NEWS_TAKEN_BACK, .epoch = epoch, .frame = frame, .number = count});
}

void EventLog::on_key(Epoch epoch, Frame frame, const KeyChange& change) {
  news_.add({.what = TANDEM_NEWS_KEY,
             .epoch = epoch,
             .frame = frame,
             .gone = !change.value,
             .value_size = change.value ? change.value->size() : 0,
             .key = std::string(change.key)});
}

void EventLog::end(const client::ClientCore& core) {
  if (core.session() == nullptr) return;
  if (core.phase() == ClientPhase::kRefused && !std::exchange(refused_, true)) {
    add({.kind = TANDEM_EVENT_REFUSED, .text = core.status().reason});
  }
  if (const transport::ReplyMessage* reply = core.reply()) {
    // A client that chose to be an observer gets no reason.
    const bool demoted = reply->role == transport::Role::kObserver && reply->reason != 0;
    if (demoted != std::exchange(demoted_, demoted)) {
      add({.kind = demoted ? TANDEM_EVENT_DEMOTED : TANDEM_EVENT_PROMOTED,
           .reason = reply->reason,
           .text = {}});
    }
  }
  const bool alive = core.server_alive();
  if (alive != std::exchange(alive_, alive)) {
    if (!alive) add({.kind = TANDEM_EVENT_SESSION_ENDED, .text = {}});
    if (alive && was_alive_) add({.kind = TANDEM_EVENT_SESSION_BACK, .text = {}});
  }
  was_alive_ = was_alive_ || alive;
}

}  // namespace tandem::api
