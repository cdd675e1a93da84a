#pragma once
// Ports over Cyclone DDS. This header sees no DDS; everything behind it does.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdk/transport/port.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Of DDS domains; the ports of a higher one would be out of range.
inline constexpr std::uint32_t kMaxDomain = 230;

struct DdsOptions {
  std::uint32_t domain = 0;  ///< DDS domain, 0..kMaxDomain
  std::string session = "default";
  /// Client ports: shown by DDS tools, and told to servers before the session is known, so that their writers
  /// for it are there when it joins. 0: not told.
  ClientId client = 0;
  /// Server ports: deltas kept for slow readers; see delta_depth() in limits.hpp.
  std::uint32_t delta_depth = 64;
  /// A peer that shows no sign of life for this long counts as dead. Shorter gives false alarms on busy
  /// machines.
  std::chrono::nanoseconds lease = std::chrono::seconds(1);
  /// For clients that nobody waits for: their signs of life would be most of what they send.
  static constexpr std::chrono::nanoseconds kObserverLease = std::chrono::seconds(20);
  /// How long one write is repeated while the middleware cannot take it, before kTimeout.
  std::chrono::nanoseconds write_timeout = std::chrono::seconds(2);
  /// When not null and set, writes stop repeating. Must outlive the port.
  const std::atomic<bool>* stop = nullptr;
};

/// Joins the domain as "tandemd SESSION". Environment: CYCLONEDDS_URI, on top of our defaults
/// (idl/PROTOCOL.md). Errors: kInvalidArgument (domain, session name, depth, lease), kTransport (also what
/// CYCLONEDDS_URI says).
[[nodiscard]] Result<std::unique_ptr<ServerPort>> make_dds_server_port(const DdsOptions& options);

/// Joins the domain as "tandem client ID". Errors: as above.
[[nodiscard]] Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options);

/// Watches all sessions of a domain without taking part in any. All calls from one thread.
class Monitor {
 public:
  virtual ~Monitor() = default;
  /// Announcements of all live servers.
  virtual void list_sessions(std::vector<Received<SessionMessage>>& out) = 0;
  /// Status samples since the last call, the latest 8 of each server and client, oldest first.
  virtual void take(std::vector<Received<ServerStatusMessage>>& out) = 0;
  virtual void take(std::vector<Received<ClientStatusMessage>>& out) = 0;
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
};

/// Joins the domain as "tandem monitor"; only `options.domain` is used. Errors: as above.
[[nodiscard]] Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options);

}  // namespace tandem::transport
