#pragma once
// Reads both clocks at once, as a ClientCore needs them.

#include "sdk/client/client_core.hpp"
#include "sdk/wire/clock.hpp"

namespace tandem::client {

[[nodiscard]] inline Now now() { return {transport::steady_ns(), transport::wall_ns()}; }

}  // namespace tandem::client
