#pragma once
// What comes of an epoch before its server is followed.

#include <cstddef>
#include <deque>
#include <utility>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::client {

/// Messages of this epoch from a participant that is not the followed server, kept while that server counts
/// as alive. The sender may turn out to be its heir. Only the latest are kept.
struct Early {
  static constexpr std::size_t kMaxMessages = 2048, kMaxBytes = 16U << 20U;
  std::deque<transport::Received<transport::DeltaMessage>> deltas;
  std::deque<transport::Received<transport::ScheduledInputMessage>> inputs;
  std::size_t bytes = 0;  ///< of the deltas

  void add(transport::Received<transport::DeltaMessage>&& delta) {
    bytes += delta.message.payload.size();
    deltas.push_back(std::move(delta));
    while (deltas.size() > kMaxMessages || bytes > kMaxBytes) {
      bytes -= deltas.front().message.payload.size();
      deltas.pop_front();
    }
  }
  void add(transport::Received<transport::ScheduledInputMessage>&& input) {
    inputs.push_back(std::move(input));
    if (inputs.size() > kMaxMessages) inputs.pop_front();
  }
};

}  // namespace tandem::client
