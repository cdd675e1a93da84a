#pragma once
// The thread that writes what the host queued, so that a slow write never holds up the simulation.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sdk/transport/port.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Drains an outbox into a port from construction to stop(). Deltas, scheduled inputs and the session are
/// written again until they are accepted, or until the middleware has refused one for 10 s for another reason
/// than its own congestion: then nothing more is written. Other messages are given up after an error, as they
/// are either repeated or superseded by the host.
class Publisher {
 public:
  /// Both must outlive the publisher.
  Publisher(Outbox& outbox, transport::ServerPort& port, std::chrono::nanoseconds patience = kPatience);
  ~Publisher() { stop(); }
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Waits until the outbox is empty, for a second at most, or until nothing more is written.
  void flush() const;
  /// Ends the thread; what is still queued then is not written. Blocks for one write at most.
  void stop();
  /// Writes that failed since the start. Thread-safe.
  [[nodiscard]] std::uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }
  /// The last failure's text, empty without one. Thread-safe.
  [[nodiscard]] std::string last_failure() const;
  /// True once nothing more is written: the session cannot go on. Thread-safe.
  [[nodiscard]] bool gave_up() const { return gave_up_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::chrono::seconds kPatience{10};

  void run(const std::stop_token& stop);
  void insist(const Outgoing& message, const std::stop_token& stop);
  /// What went wrong, if anything.
  std::optional<ErrorCode> write(const Outgoing& message);

  Outbox* outbox_;
  transport::ServerPort* port_;
  std::chrono::nanoseconds patience_;
  std::atomic<std::uint64_t> failures_{0};
  std::atomic<bool> gave_up_{false};
  mutable std::mutex mutex_;
  std::string last_failure_;
  std::jthread thread_;
};

}  // namespace tandem::host
