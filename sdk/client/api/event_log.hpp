#pragma once
// A queue of a client's events, which the application empties when it likes.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/api/news_queue.hpp"
#include "sdk/client/client_core.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

struct Event {
  tandem_event_kind kind = 0;
  std::uint32_t reason = 0;   ///< transport::Reason
  std::uint32_t dropped = 0;  ///< number of events dropped since the previously taken one
  std::uint64_t number = 0;
  Frame frame = 0;
  Epoch epoch = 0;
  std::int64_t at_ns = 0;
  std::string text;  ///< empty: that of the reason
};

/// Listens to a core and stores events. Bounded; allocates only if an event has a text. Not thread-safe.
class EventLog final : public client::CoreListener {
 public:
  static constexpr std::size_t kMaxEvents = 256;

  EventLog();

  /// Call before each poll: events of the poll get this time.
  void begin(std::int64_t steady_ns) { now_ns_ = steady_ns; }
  /// Call after each poll: adds the events that a core does not report itself.
  void end(const client::ClientCore& core);

  [[nodiscard]] std::optional<Event> take();
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  void on_session(const transport::SessionMessage& session) override;
  void on_snapshot(const transport::SnapshotMessage& snapshot) override;
  void on_outcome(const client::InputOutcome& outcome) override;
  void on_resync(client::ResyncReason reason) override;

  [[nodiscard]] NewsQueue& news() { return news_; }
  void on_happened(const client::Happened& event) override;
  void on_events_lost(Epoch epoch, Frame frame, std::uint64_t count) override;
  void on_events_taken_back(Epoch epoch, Frame frame, std::uint64_t count) override;
  void on_key(Epoch epoch, Frame frame, const KeyChange& change) override;

 private:
  void add(Event event);

  std::int64_t now_ns_ = 0;
  NewsQueue news_;
  std::vector<Event> ring_;  // kMaxEvents long
  std::size_t first_ = 0, count_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint32_t dropped_since_ = 0;

  Epoch epoch_ = 0;  // of the session; 0 before the first
  bool playing_ = false, played_ = false;
  bool refused_ = false, demoted_ = false, alive_ = false, was_alive_ = false;
};

}  // namespace tandem::api
