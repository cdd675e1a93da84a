#pragma once
// The connection to a NATS server, as the ports need it. Core NATS: what is published reaches whoever
// subscribes now, at most once, and in order from one sender on one subject.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

class Doorbell;

/// A message that arrived.
struct NatsArrival {
  std::string subject;
  Bytes bytes;
};

/// publish() and wake() may be called from any thread; the others from one thread. Nothing blocks but wait()
/// and round_trip_ns().
class NatsBus {
 public:
  virtual ~NatsBus() = default;

  /// False while the server cannot be reached: what is published then is lost.
  [[nodiscard]] virtual bool connected() const = 0;
  /// The largest payload that the server takes, bytes.
  [[nodiscard]] virtual std::size_t most_bytes() const = 0;
  /// Subscribes, also after each reconnection. No effect if it is subscribed. `subject` may have wildcards. A
  /// message that several subscriptions of one `group` match arrives once; empty: of no group.
  virtual Result<void> subscribe(const std::string& subject, const std::string& group) = 0;
  Result<void> subscribe(const std::string& subject) { return subscribe(subject, {}); }
  virtual void unsubscribe(const std::string& subject) = 0;
  /// Errors: kTransport (not connected, too large). Then nothing was sent.
  virtual Result<void> publish(const std::string& subject, std::span<const std::byte> bytes) = 0;
  /// Appends what arrived.
  virtual void take(std::vector<NatsArrival>& out) = 0;
  /// Messages that arrived and were dropped, because they were not taken in time.
  [[nodiscard]] virtual std::uint64_t overrun() const = 0;
  /// Connections that ended by themselves: the NATS server, or the network, cut them.
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
  /// Why it is not connected, in one line for people; empty: it is, or it tries for the first time.
  [[nodiscard]] virtual std::string trouble() const = 0;
  /// Blocks until something arrived or wake(), or until the timeout. May return early.
  virtual void wait(std::chrono::nanoseconds timeout) = 0;
  virtual void wake() = 0;

  /// Asks the server and waits for its answer: by then it has seen all that was published, and what it
  /// refuses of that is counted soon after. Errors: kTransport.
  virtual Result<std::int64_t> round_trip_ns() = 0;
  /// How often the server said that something is not permitted.
  [[nodiscard]] virtual std::uint64_t refusals() const = 0;
};

struct NatsOptions {
  /// nats:// or tls://, HOST[:PORT], several divided by commas; a password may stand in front of HOST.
  std::string url;
  std::string name;         ///< by which the NATS server knows it
  std::string credentials;  ///< file of a NATS user (.creds); empty: none
  std::string tls_ca;       ///< file with the authorities that tls:// trusts; empty: the system's
  bool once = false;        ///< waits until it is connected, tries once, and says why it could not
  /// Rung by what arrives, for a thread that waits for several ports at once; wait() waits for it, too. Null:
  /// it has its own.
  std::shared_ptr<Doorbell> bell = nullptr;
};

/// Checks that the files are there and of their kind, that not everybody can read the user's, and that
/// authorities are for tls://. Errors, in one line with file and cure: kInvalidArgument.
[[nodiscard]] Result<void> check_nats_files(const NatsOptions& options);
/// Connects in the background, and again whenever the connection ends. Errors: kInvalidArgument (the URL, the
/// files), kTransport (the library; with `once` also what the server or the network says).
[[nodiscard]] Result<std::unique_ptr<NatsBus>> make_nats_bus(const NatsOptions& options);

/// What to say of addresses without TLS to other machines, in one line; empty if there are none.
[[nodiscard]] std::string warning_without_tls(const std::string& url);
/// True for an address of make_nats_bus(): it begins with nats:// or tls://.
[[nodiscard]] bool is_nats_url(std::string_view text);
/// The address as it may be shown.
[[nodiscard]] std::string without_password(std::string url);

}  // namespace tandem::transport
