#pragma once
// Ports that use Cyclone DDS. This header includes no DDS header; only the code behind it does.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/transport/port.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Maximum number of a DDS domain; the network ports of a higher one would be out of range.
inline constexpr std::uint32_t kMaxDomain = 230;

struct DdsOptions {
  std::uint32_t domain = 0;  ///< DDS domain, 0..kMaxDomain
  std::string session = "default";
  /// Client ports: DDS tools show this id, and servers learn it before the session is known, so that their
  /// writers for the client exist when it joins. 0: not announced.
  ClientId client = 0;
  /// Server ports: number of deltas kept for slow readers; see delta_depth() in limits.hpp.
  std::uint32_t delta_depth = 64;
  /// A peer without a sign of life for this long counts as dead. A shorter lease gives false alarms on busy
  /// machines.
  std::chrono::nanoseconds lease = std::chrono::seconds(1);
  /// The lease of clients that the server does not wait for. With a short lease, signs of life would be most
  /// of what they send.
  static constexpr std::chrono::nanoseconds kObserverLease = std::chrono::seconds(20);
  /// How long a write is repeated while the middleware cannot take it, before it fails with kTimeout.
  std::chrono::nanoseconds write_timeout = std::chrono::seconds(2);
  /// If this is not null and set, writes are not repeated any more. It must outlive the port.
  const std::atomic<bool>* stop = nullptr;
};

/// Joins the domain as "tandemd SESSION". The environment variable CYCLONEDDS_URI overrides Tandem's defaults
/// (idl/PROTOCOL.md). Errors: kInvalidArgument (domain, session name, depth, lease), kTransport (also what
/// CYCLONEDDS_URI causes).
[[nodiscard]] Result<std::unique_ptr<ServerPort>> make_dds_server_port(const DdsOptions& options);

/// Joins the domain as "tandem client ID". Errors: as above.
[[nodiscard]] Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options);

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

/// Watches all sessions of a domain without joining any. All calls from one thread.
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
  /// Sends a command to the server of the session that it names.
  virtual Result<void> write(const CommandMessage& message) = 0;
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
};

/// Takes the lines that Cyclone DDS would write on stderr. `error`: the process ends after it; other errors
/// reach callers as well. Called by any thread, several at once. Lines about a configuration (CYCLONEDDS_URI)
/// come while the domain is opened. Call it before that, and once; only programs do, as the sink is one for
/// the process.
void set_dds_log(void (*write)(std::string_view line, bool error));

/// Opens the domain and closes it, without a participant and so without traffic. Errors: kTransport for what
/// CYCLONEDDS_URI causes, of which Cyclone DDS writes the details to stderr.
[[nodiscard]] Result<void> check_dds_domain(std::uint32_t domain);

/// Joins the domain as "tandem monitor"; only `options.domain` is used. Errors: as above.
[[nodiscard]] Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options);

}  // namespace tandem::transport
