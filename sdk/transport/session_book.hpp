#pragma once
// The session announcements a port has seen, by writer: which one is current, and what to report.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sdk/transport/port.hpp"

namespace tandem::transport {

/// How a writer of announcements stands. A silent one may come back; a gone one has to be discovered again.
enum class WriterState : std::uint8_t { kLive, kSilent, kGone };

/// Remembers each writer's newest announcement, because a transport hands out a sample once, while a server
/// that was silent for a while (stopped, cut off) comes back without announcing itself again. Not
/// thread-safe.
class SessionBook {
 public:
  using StateOf = std::function<WriterState(std::uint64_t writer, const ParticipantId& participant)>;

  /// `writer` is any id that a transport never reuses.
  void put(std::uint64_t writer, Received<SessionMessage> announcement);
  /// Forgets writers that are gone and takes note of who lives.
  void update(const StateOf& state_of);

  /// Appends the announcement seen last among the live ones, when it is not the one appended before.
  void take_current(std::vector<Received<SessionMessage>>& out);
  /// Appends all live announcements in the order they were first seen.
  void list_live(std::vector<Received<SessionMessage>>& out) const;
  [[nodiscard]] bool any_live() const;
  [[nodiscard]] bool epoch_live(Epoch epoch) const;

 private:
  struct Entry {
    std::uint64_t writer = 0;
    std::uint64_t order = 0;
    bool live = true;
    Received<SessionMessage> announcement;
  };
  std::vector<Entry> entries_;  // ascending by order
  std::uint64_t next_order_ = 1;
  std::uint64_t reported_ = 0;  // order of the entry appended last; 0: none
};

}  // namespace tandem::transport
