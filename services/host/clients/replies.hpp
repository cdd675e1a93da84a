#pragma once
// Replies to clients.

#include <array>
#include <cstdint>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::host {

/// Queues replies when they are due (accounts::ReplySchedule). If the outbox has no room, a reply is tried
/// again. A client with an account has writers of its own, which are opened with its first reply.
class ReplyDesk {
 public:
  static constexpr std::int64_t kStrangerNs = kSecond;  ///< minimum time between two answers to the same
                                                        ///< client
  static constexpr double kStrangersPerSecond = 20;     ///< also the maximum burst

  ReplyDesk(Epoch epoch, Outbox& outbox) : epoch_(epoch), outbox_(&outbox) {}

  void send_due(Roster& roster, std::int64_t now_ns, std::int64_t wall_ns);
  /// Answers a client without an account. Each gets at most one answer a second and all together 20 a second,
  /// because every client reads these answers.
  void refuse(transport::ClientId client, transport::Reason reason, std::int64_t now_ns, std::int64_t wall_ns,
              std::uint32_t needed_kbit_s = 0);

 private:
  [[nodiscard]] bool close_forgotten(Roster& roster);

  struct Stranger {
    transport::ClientId client = 0;
    std::int64_t last_ns = INT64_MIN;
  };
  Epoch epoch_;
  Outbox* outbox_;
  std::array<Stranger, 64> strangers_{};  // the one that was silent the longest makes room
  accounts::TokenBucket strangers_rate_{kStrangersPerSecond, kStrangersPerSecond};
};

}  // namespace tandem::host
