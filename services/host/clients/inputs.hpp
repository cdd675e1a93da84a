#pragma once
// What clients may do to a session.

#include <cstdint>

#include "sdk/transport/messages.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Keeps the accounts of inputs: what a client may send, and what became of it. Not thread-safe.
class InputDesk {
 public:
  InputDesk(Epoch epoch, FrameSource& source, Outbox& outbox)
      : epoch_(epoch), source_(&source), outbox_(&outbox) {}

  /// Decides one input of a known client; the outcome stands in its account and is what this returns.
  transport::Reason handle(Account& account, const transport::InputMessage& input, std::int64_t now_ns);
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  transport::Reason decide(Account& account, const transport::InputMessage& input, std::int64_t now_ns,
                           Frame& acts_on);

  Epoch epoch_;
  FrameSource* source_;
  Outbox* outbox_;
  std::uint64_t refused_ = 0;
};

}  // namespace tandem::host
