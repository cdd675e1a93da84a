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

#include "sdk/transport/network/address_watch.hpp"
#include "sdk/transport/network/profile.hpp"
#include "sdk/wire/monitor.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Maximum number of a DDS domain; the network ports of a higher one would be out of range.
inline constexpr std::uint32_t kMaxDomain = 230;

class Doorbell;
class DdsWireCount;

struct DdsOptions {
  std::uint32_t domain = 0;  ///< DDS domain, 0..kMaxDomain
  /// The kind of network, "NAME" or "NAME:key=value,..." (deploy/dds), the same for all ports of a process on
  /// the domain. With one, CYCLONEDDS_URI is not used. Empty: Tandem's defaults and then CYCLONEDDS_URI.
  std::string profile = {};
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
  /// Server ports: if this is not null, the bytes of deltas that were sent again, as a reader lacked them,
  /// are added to it once a second. It must outlive the port.
  std::atomic<std::uint64_t>* repeated_bytes = nullptr;
  /// DDS Security: folder of this program's identity, which `tandem pki issue` made. Empty: none, unless
  /// CYCLONEDDS_URI has one.
  std::string secure = {};
  /// Client ports: it hears the status of each second, as monitors do, and not only what a client needs to
  /// choose its stream.
  bool every_status = false;
  /// Client ports: it sends inputs. With the identity of an observer it cannot.
  bool acts = true;
  /// Rung by what arrives, for a thread that waits for several ports at once; wait() waits for it, too. Null:
  /// the port has its own.
  std::shared_ptr<Doorbell> bell = nullptr;
  /// Counts what the port takes on the network. Null: nothing does; a client port makes its own.
  std::shared_ptr<DdsWireCount> wire = nullptr;
};

/// Joins the domain as "tandemd SESSION". Without a profile, the environment variable CYCLONEDDS_URI
/// overrides Tandem's defaults (idl/PROTOCOL.md). Errors: kInvalidArgument (domain, profile, session name,
/// depth, lease; an identity that is not good, or not a server's), kIo (a file of the identity), kTransport
/// (also what CYCLONEDDS_URI and the profile's interfaces cause).
[[nodiscard]] Result<std::unique_ptr<ServerPort>> make_dds_server_port(const DdsOptions& options);

/// What make_dds_server_port() says of profile and identity, without opening anything. Errors: as there.
[[nodiscard]] Result<void> check_dds_profile(const DdsOptions& options);
[[nodiscard]] Result<void> check_dds_identity(const DdsOptions& options);
/// Joins the domain as "tandem client ID". Errors: as above. A port that does not act cannot write inputs.
[[nodiscard]] Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options);

/// Takes the lines that Cyclone DDS would write on stderr: of those that are no errors 50 at once and one a
/// second, the same one once a minute, cut to 240 bytes, without control characters; the next one says how
/// many were left out. `error`: the process ends after it; other errors reach callers as well. Called by any
/// thread, several at once. Lines about a configuration (CYCLONEDDS_URI) come while the domain is opened.
/// Call it before that, and once; only programs do, as the sink is one for the process.
void set_dds_log(void (*write)(std::string_view line, bool error));

/// Why the Cyclone DDS of this process hears nothing any more, which only a new process mends, in a line for
/// people; empty: it hears. It looks once in 2 s, and notices it after some 10 s. Thread-safe.
[[nodiscard]] std::string dds_fault();

/// What has become of the network on which this process serves over DDS; sets `*line` to the same for people
/// if it is not there. It looks once a second. Thread-safe.
[[nodiscard]] NetworkState dds_server_network(std::string* line = nullptr);

/// What a program that serves tells of its start: DDS uses loopback alone, as there is no network yet. Empty
/// otherwise.
[[nodiscard]] std::string dds_start_notice();

/// For a program that serves: why nobody can join it before it is started anew, as it is bound to a network
/// address that this machine has no more; empty: they can. Thread-safe.
[[nodiscard]] std::string dds_outdated();

/// A participant of a domain, in its own words.
struct HeardParticipant {
  std::string name;                    ///< "tandemd SESSION", "tandem client ID"; other text for strangers
  std::string host;                    ///< empty unless it uses Cyclone DDS
  std::vector<std::string> addresses;  ///< as host
  bool own = false;                    ///< the one that listens
};

/// Joins the domain as "tandem doctor", without a topic of ours, and listens until `enough` says so or for
/// `patience`. Of `options` counts what says where and as whom. Returns the participants there are then,
/// itself included; at most 256. Errors: as a port's.
[[nodiscard]] Result<std::vector<HeardParticipant>> listen_for_participants(
    const DdsOptions& options, Side side, std::chrono::nanoseconds patience,
    const std::function<bool(const std::vector<HeardParticipant>&)>& enough);

/// What --help says of --profile.
inline constexpr const char* kProfileHelp =
    "The kind of network, with which CYCLONEDDS_URI is not used: loopback, lan, wifi, wan or multihomed, with parameters "
    "behind a colon, as in lan:interface=eth0 or wan:server=203.0.113.5 (deploy/dds)";
/// Why the text is no profile; empty: it is one.
[[nodiscard]] std::string refusal_of_profile(const std::string& text, Side side);

/// A line for people about a profile: what it uses of this machine, and that it stands above CYCLONEDDS_URI.
/// Empty without a profile, or if it cannot be used here.
[[nodiscard]] std::string describe_dds_profile(std::uint32_t domain, const std::string& profile, Side side);

/// Joins the domain as "tandem monitor"; only domain, profile and identity of `options` are used. Errors: as
/// above.
[[nodiscard]] Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options);

}  // namespace tandem::transport
