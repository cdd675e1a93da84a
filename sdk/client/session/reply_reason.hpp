#pragma once
// Texts of the reasons why a server refused a client's request.

#include <cstdint>
#include <string>

namespace tandem::client {

/// A text for a human. `reason`: transport::Reason, or a number that this version does not know. Empty for
/// kNone.
[[nodiscard]] std::string describe(std::uint32_t reason);

}  // namespace tandem::client
