#pragma once
// Base64 with the alphabet for addresses and without padding (RFC 4648, section 5), as a JWT has it.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::tokens {

[[nodiscard]] std::string to_base64url(std::span<const std::uint8_t> bytes);
/// Nothing for a text that to_base64url() would not have made.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> from_base64url(std::string_view text);

}  // namespace tandem::tokens
