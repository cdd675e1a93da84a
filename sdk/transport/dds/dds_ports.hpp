#pragma once
// Ports that use Cyclone DDS. This header includes no DDS header; only the code behind it does.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
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
  /// DDS Security: folder of this program's identity, which `tandem pki issue` made. Empty: none, unless
  /// CYCLONEDDS_URI has one.
  std::string secure = {};
  /// Client ports: it sends inputs. With the identity of an observer it cannot.
  bool acts = true;
};

/// Joins the domain as "tandemd SESSION". The environment variable CYCLONEDDS_URI overrides Tandem's defaults
/// (idl/PROTOCOL.md). Errors: kInvalidArgument (domain, session name, depth, lease; an identity that is not
/// good, or not a server's), kIo (a file of the identity), kTransport (also what CYCLONEDDS_URI causes).
[[nodiscard]] Result<std::unique_ptr<ServerPort>> make_dds_server_port(const DdsOptions& options);

/// Joins the domain as "tandem client ID". Errors: as above. A port that does not act cannot write inputs.
[[nodiscard]] Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options);

/// Watches all sessions of a domain without joining any. All calls from one thread.
class Monitor {
 public:
  virtual ~Monitor() = default;
  /// Announcements of all live servers.
  virtual void list_sessions(std::vector<Received<SessionMessage>>& out) = 0;
  /// The status samples since the last call: at most the latest 8 of each server and client, oldest first.
  virtual void take(std::vector<Received<ServerStatusMessage>>& out) = 0;
  virtual void take(std::vector<Received<ClientStatusMessage>>& out) = 0;
  /// Sends a command to the server of the session that it names. With DDS Security only an operator may.
  virtual Result<void> write(const CommandMessage& message) = 0;
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
};

/// Takes the lines that Cyclone DDS would write on stderr: of those that are no errors 50 at once and one a
/// second, cut to 240 bytes, without control characters; the next one says how many were left out. `error`:
/// the process ends after it; other errors reach callers as well. Called by any thread, several at once.
/// Lines about a configuration (CYCLONEDDS_URI) come while the domain is opened. Call it before that, and
/// once; only programs do, as the sink is one for the process.
void set_dds_log(void (*write)(std::string_view line, bool error));

/// Opens the domain, calls `while_open` if it is not empty, and closes the domain, without a participant and
/// so without traffic. Errors: kTransport for what CYCLONEDDS_URI causes, of which Cyclone DDS writes the
/// details to stderr.
[[nodiscard]] Result<void> check_dds_domain(std::uint32_t domain,
                                            const std::function<void()>& while_open = {});

/// Joins the domain as "tandem monitor"; only `options.domain` and `options.secure` are used. Errors: as
/// above.
[[nodiscard]] Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options);

}  // namespace tandem::transport
