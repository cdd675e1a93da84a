#pragma once
// What the worlds of two epochs have in common.

#include <optional>

#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// The last frame that both worlds share when a client comes from `left` to `entered`; empty if they are not
/// known to share any.
[[nodiscard]] std::optional<Frame> shared_history(const transport::SessionMessage& left,
                                                  const transport::SessionMessage& entered);

}  // namespace tandem::client
