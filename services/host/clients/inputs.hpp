#pragma once
// Accepts or refuses the inputs of clients.

#include <cstdint>

#include "sdk/wire/messages.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/frames/journal.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/report.hpp"

namespace tandem::host {

/// Decides inputs and keeps their accounts: what a client may send, and the outcomes. Not thread-safe.
class InputDesk {
 public:
  InputDesk(Epoch epoch, FrameSource& source, Outbox& outbox, Journal& journal)
      : epoch_(epoch), source_(&source), outbox_(&outbox), journal_(&journal) {}

  /// Decides one input of a known client, whose DDS participant is `peer`. Returns the outcome and records it
  /// in the account.
  transport::Reason handle(Account& account, Peer& peer, const transport::InputMessage& input,
                           std::int64_t now_ns);
  /// Records the outcome of an input that was decided later. No effect if the account is gone.
  void settle(Roster& roster, InputVerdict&& later, std::int64_t now_ns);
  /// Decides an input of the server itself; `next` is the frame whose step comes. Returns the frame that it
  /// acts on. Errors: kInvalidArgument (the simulation refuses it), kCapacity, kUnsupported (a recording).
  Result<Frame> inject(const engine::Input& input, Frame next, std::int64_t now_ns);
  [[nodiscard]] const Refusals& refused() const { return refused_; }

 private:
  [[nodiscard]] InputVerdict decide(Account& account, Peer& peer, const transport::InputMessage& input,
                                    std::int64_t now_ns);

  Epoch epoch_;
  FrameSource* source_;
  Outbox* outbox_;
  Journal* journal_;
  Refusals refused_;
};

}  // namespace tandem::host
