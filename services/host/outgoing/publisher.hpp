#pragma once
// A thread that writes what the host queued, so that a slow write never delays the simulation.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sdk/statistics/duration_buckets.hpp"
#include "sdk/wire/port.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Drains an outbox into a port from construction to stop(). It repeats deltas, scheduled inputs and the
/// session until they are accepted. If the middleware refuses one for 10 s for a reason other than its own
/// congestion, nothing more is written. It gives up other messages after an error, because the host repeats
/// or supersedes them.
class Publisher {
 public:
  /// Both must outlive the publisher.
  Publisher(Outbox& outbox, transport::ServerPort& port, std::chrono::nanoseconds patience = kPatience);
  ~Publisher() { stop(); }
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Waits until the outbox is empty or nothing more is written, at most one second.
  void flush() const;
  /// Ends the thread. What is still queued is not written. Blocks for at most one write.
  void stop();
  /// Writes that failed since the start. Thread-safe.
  [[nodiscard]] std::uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }
  /// The last failure's text; empty if there was none. Thread-safe.
  [[nodiscard]] std::string last_failure() const;
  /// How long the deltas of a frame took to be written, all streams together, with repetitions. Thread-safe.
  [[nodiscard]] DurationBuckets::Counts durations() const { return durations_.counts(); }
  /// True once nothing more is written: the session cannot go on. Thread-safe.
  [[nodiscard]] bool gave_up() const { return gave_up_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::chrono::seconds kPatience{10};

  void run(const std::stop_token& stop);
  void insist(const Outgoing& message, const std::stop_token& stop);
  /// Writes one message; returns the error, if any.
  std::optional<ErrorCode> write(const Outgoing& message);

  Outbox* outbox_;
  transport::ServerPort* port_;
  std::chrono::nanoseconds patience_;
  std::atomic<std::uint64_t> failures_{0};
  std::atomic<bool> gave_up_{false};
  DurationBuckets durations_;
  mutable std::mutex mutex_;
  std::string last_failure_;
  std::jthread thread_;
};

}  // namespace tandem::host
