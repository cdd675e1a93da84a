#pragma once
// Watches sessions: what `tandem top` shows.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport {

/// A sample with the time that its writer gave it.
template <class M>
struct Stamped : Received<M> {
  std::int64_t written_ns = 0;  ///< wall clock of the writer's host, as that host says
};

/// What DDS tells about a participant besides what it writes. All of it is that participant's own word.
struct Peer {
  std::string name;                ///< "tandem client ID"; other text for strangers
  std::string host, process, pid;  ///< empty unless the participant uses Cyclone DDS
  /// The lease of its status writer; with a long one, nobody waits for the client (kObserverLease).
  std::chrono::nanoseconds lease{0};
};

/// Watches all sessions of a domain, or of a NATS server, without joining any. All calls from one thread.
class Monitor {
 public:
  virtual ~Monitor() = default;
  /// Announcements of all live servers.
  virtual void list_sessions(std::vector<Received<SessionMessage>>& out) = 0;
  /// The status samples since the last call: at most the latest 8 of each server and client, oldest first.
  virtual void take(std::vector<Stamped<ServerStatusMessage>>& out) = 0;
  virtual void take(std::vector<Stamped<ClientStatusMessage>>& out) = 0;
  /// The participant that wrote a client's status; empty if it has left or was never heard.
  [[nodiscard]] virtual std::optional<Peer> describe(const ParticipantId& client) = 0;
  /// Sends a command to the server of the session that it names. With DDS Security only an operator may.
  virtual Result<void> write(const CommandMessage& message) = 0;
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  /// Why nothing can be heard, in one line for people; empty: it can.
  [[nodiscard]] virtual std::string trouble() const { return {}; }
};

}  // namespace tandem::transport
