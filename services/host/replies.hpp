#pragma once
// What clients are told.

#include <array>
#include <cstdint>
#include <map>

#include "sdk/transport/messages.hpp"
#include "services/host/outbox.hpp"
#include "services/host/roster.hpp"

namespace tandem::host {

/// Queues replies: on a change, otherwise at most twice a second. A reply that finds no room is tried again.
class ReplyDesk {
 public:
  static constexpr std::int64_t kEchoNs = 500'000'000;   ///< between replies that only echo the clock
  static constexpr std::int64_t kChangeNs = 10'000'000;  ///< between replies to one client at all

  ReplyDesk(Epoch epoch, Outbox& outbox) : epoch_(epoch), outbox_(&outbox) {}

  void send_due(std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns, std::int64_t wall_ns);
  /// Answers somebody without an account, at most twice a second each.
  void refuse(transport::ClientId client, transport::Reason reason, std::int64_t now_ns,
              std::int64_t wall_ns);

 private:
  struct Stranger {
    transport::ClientId client = 0;
    std::int64_t last_ns = INT64_MIN;
  };
  Epoch epoch_;
  Outbox* outbox_;
  std::array<Stranger, 64> strangers_{};  // the longest silent one makes room
};

}  // namespace tandem::host
