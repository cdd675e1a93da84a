#pragma once
// How work on blocks is spread over threads, without knowing any.

#include <cstdint>
#include <functional>

namespace tandem {

/// Calls job(0) .. job(count - 1), in any order and on any threads, and returns when all are done. Empty: one
/// after the other on the caller's thread.
using RunBlocks = std::function<void(std::uint32_t count, const std::function<void(std::uint32_t)>& job)>;

}  // namespace tandem
