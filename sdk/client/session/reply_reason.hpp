#pragma once
// Why a server did not do what a client asked for, in words.

#include <cstdint>
#include <string>

namespace tandem::client {

/// For a human. `reason`: transport::Reason, or a number that this version does not know; empty for kNone.
[[nodiscard]] std::string describe(std::uint32_t reason);

}  // namespace tandem::client
