#pragma once
// Passes a session on: follows it on one side, publishes it on the other.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/host/host.hpp"
#include "services/relay/upstream.hpp"

namespace tandem::relay {

/// The rules of idl/RELAY.md, "A relay", without a clock, a thread or a socket: a host for each epoch, fed by
/// an Upstream. Not thread-safe.
class Relay {
 public:
  /// A server that is not heard for so long is gone: the session ends here too. Longer than the history that
  /// everybody keeps, so that a link that was cut for less costs nobody a snapshot.
  static constexpr std::int64_t kGoneNs = 40 * kSecond;
  /// Time until it is tried again to publish what could not be published.
  static constexpr std::int64_t kRetryNs = 2 * kSecond;
  /// Frames that it keeps while another relay publishes, to take over from it without a gap: as many as come
  /// until it has noticed that the other ended, and some more.
  static constexpr std::int64_t kKeptNs = 10 * kSecond;

  struct Options {
    std::uint32_t client_limit = 256;
    std::uint32_t participant_limit = 16;
    std::int64_t claim_ns = kSecond / 2;  ///< how long to look for another server of the session
    std::int64_t retry_ns = kRetryNs;
    std::function<void(LogLevel, std::string_view)> log = {};
    std::int64_t (*clock_ns)() = nullptr;  ///< for figures only
  };
  using MakePort =
      std::function<Result<std::unique_ptr<transport::ServerPort>>(const transport::SessionMessage& session)>;
  /// Empties the host's outbox into the port from opened() to closing().
  class Publishing {
   public:
    virtual ~Publishing() = default;
    virtual void opened(host::Host& host, transport::ServerPort& port) = 0;
    virtual void closing() = 0;
    /// Why nothing can be published any more; empty: it can.
    [[nodiscard]] virtual std::string failure() { return {}; }
  };

  /// All but the options must outlive it.
  Relay(Options options, Upstream& upstream, MakePort make_port, Publishing& publishing);
  ~Relay() { close(); }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;
  Relay(Relay&&) = delete;
  Relay& operator=(Relay&&) = delete;

  /// Takes what arrived on both sides, and publishes what is there. Returns when it wants to be called again.
  std::int64_t poll(client::Now now);

  /// Null while nothing is published.
  [[nodiscard]] const host::Host* host() const { return host_.get(); }
  [[nodiscard]] transport::ServerPort* port() const { return port_.get(); }
  [[nodiscard]] const Upstream& upstream() const { return *upstream_; }
  [[nodiscard]] Upstream& upstream() { return *upstream_; }
  /// Another relay publishes, and this one would take over from it.
  [[nodiscard]] bool stands_by() const { return stands_by_; }
  [[nodiscard]] std::uint64_t opened() const { return opened_; }  ///< times that it began to publish
  /// Why nothing is published, for people; null if it is, and if this one stands by as it should. A literal.
  [[nodiscard]] const char* obstacle() const { return obstacle_; }

 private:
  /// Frames that one poll passes on; more of them wait for the next.
  static constexpr int kFramesPerPoll = 64;

  void open();
  void close();
  void give_up(const std::string& why);
  std::int64_t poll_host();
  void log(LogLevel level, std::string_view line) const {
    if (options_.log) options_.log(level, line);
  }

  Options options_;
  Upstream* upstream_;
  MakePort make_port_;
  Publishing* publishing_;
  client::Now now_;
  std::int64_t heard_ns_ = INT64_MIN / 2, retry_ns_ = INT64_MIN / 2;
  std::string told_;        // why it could not publish
  bool stands_by_ = false;  // another relay publishes
  const char* obstacle_ = "it looks for the session";
  std::uint64_t opened_ = 0;
  std::unique_ptr<transport::ServerPort> port_;
  std::unique_ptr<host::Host> host_;
};

}  // namespace tandem::relay
