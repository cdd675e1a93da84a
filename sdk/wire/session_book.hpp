#pragma once
// The session announcements that a port has seen, by participant: which one is current, and what to report.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sdk/wire/port.hpp"

namespace tandem::transport {

/// The state of a writer of announcements. A silent one may come back; a gone one has to be discovered again.
enum class WriterState : std::uint8_t { kLive, kSilent, kGone };

/// Remembers each participant's newest announcement. A transport hands out a sample only once, but a server
/// that was silent for a while (stopped, cut off) comes back without announcing itself again. Not
/// thread-safe.
///
/// One of them is current: the one seen first among those that are alive and were not passed over. It stays
/// current as long as it is alive and not passed over, whatever others announce. The announcement of a server
/// that stands by is never current and counts as nobody's.
class SessionBook {
 public:
  using StateOf = std::function<WriterState(std::uint64_t writer, const ParticipantId& participant)>;

  /// Stores an announcement. `writer` is an id that the transport never reuses.
  void put(std::uint64_t writer, Received<SessionMessage> announcement);
  /// Forgets writers that are gone and notes which are alive.
  void update(const StateOf& state_of);

  /// Appends the current announcement if it is not the one appended before.
  void take_current(std::vector<Received<SessionMessage>>& out);
  /// For kForItsSuccessor the successor becomes current at once; without one nothing changes.
  void pass_over_current(PassOver until);
  /// Appends all live announcements in the order they were first seen.
  void list_live(std::vector<Received<SessionMessage>>& out) const;
  [[nodiscard]] bool any_live() const;
  [[nodiscard]] bool epoch_live(Epoch epoch) const;
  /// True if the server of that epoch left while it was alive, as one does that says so.
  [[nodiscard]] bool ended(Epoch epoch) const { return ended_ == epoch && !epoch_live(epoch); }

 private:
  struct Entry {
    std::uint64_t writer = 0;
    std::uint64_t version = 0;  // counts up over all announcements
    bool live = true;
    std::optional<PassOver> passed_over = {};
    Received<SessionMessage> announcement;
    [[nodiscard]] bool serves() const {
      return live && announcement.message.server_role == ServerRole::kLive;
    }
  };
  void make_room();
  void pass_over_for_successor();

  std::vector<Entry> entries_;  // in the order in which they are considered
  std::uint64_t versions_ = 0;
  std::optional<Epoch> ended_;            // the last one that did
  std::optional<std::uint64_t> current_;  // writer of the current announcement
  std::uint64_t reported_ = 0;            // version of the announcement appended last; 0: none
};

}  // namespace tandem::transport
