#pragma once
// What clients are told.

#include <array>
#include <cstdint>
#include <map>

#include "sdk/transport/messages.hpp"
#include "sdk/transport/units.hpp"
#include "services/accounts/token_bucket.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Queues replies when they are due (accounts::ReplySchedule). A reply that finds no room is tried again.
/// A client with an account has writers of its own, opened with its first reply.
class ReplyDesk {
 public:
  static constexpr std::int64_t kStrangerNs = kSecond;  ///< between two answers to the same one
  static constexpr double kStrangersPerSecond = 20;     ///< and as many at once

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
  accounts::TokenBucket strangers_rate_{kStrangersPerSecond, kStrangersPerSecond};
};

}  // namespace tandem::host
