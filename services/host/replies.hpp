#pragma once
// What clients are told.

#include <array>
#include <cstdint>
#include <map>

#include "sdk/transport/messages.hpp"
#include "sdk/transport/units.hpp"
#include "services/host/outbox.hpp"
#include "services/host/roster.hpp"
#include "services/host/token_bucket.hpp"

namespace tandem::host {

/// Queues replies: on a change, otherwise once a second at most. A reply that finds no room is tried again.
/// A client with an account is answered through a writer of its own, opened with its first reply.
class ReplyDesk {
 public:
  static constexpr std::int64_t kEchoNs =
      kSecond;  ///< between replies that only echo the clock; twice for observers
  static constexpr std::int64_t kChangeNs = 10 * kMillisecond;  ///< between replies to one client at all
  /// An outcome is told for so long; the topic is reliable, so the newest reply is what may be lost with a
  /// link.
  static constexpr std::int64_t kToldNs = 5 * kSecond;
  static constexpr double kStrangersPerSecond = 20;  ///< and as many at once

  ReplyDesk(Epoch epoch, Outbox& outbox) : epoch_(epoch), outbox_(&outbox) {}

  void send_due(Roster& roster, std::int64_t now_ns, std::int64_t wall_ns);
  /// Answers somebody without an account, at most once a second each, and 20 a second all together: every
  /// client reads it.
  void refuse(transport::ClientId client, transport::Reason reason, std::int64_t now_ns,
              std::int64_t wall_ns);

 private:
  [[nodiscard]] bool close_forgotten(Roster& roster);

  struct Stranger {
    transport::ClientId client = 0;
    std::int64_t last_ns = INT64_MIN;
  };
  Epoch epoch_;
  Outbox* outbox_;
  std::array<Stranger, 64> strangers_{};  // the longest silent one makes room
  TokenBucket strangers_rate_{kStrangersPerSecond, kStrangersPerSecond};
};

}  // namespace tandem::host
