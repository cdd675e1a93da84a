#pragma once
// How a site shows a relay that its name is its own.

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem::transport::nats {

/// Of a relay: random, and known to nobody else.
using Secret = std::array<std::uint64_t, 2>;

/// A number that only who has the secret can tell of another site's name. Never 0. SipHash-2-4 (Aumasson and
/// Bernstein 2012, section 2) of the name.
[[nodiscard]] std::uint64_t site_proof(const Secret& secret, std::string_view site);

}  // namespace tandem::transport::nats
