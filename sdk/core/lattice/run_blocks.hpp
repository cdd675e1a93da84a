#pragma once
// Spreads work on blocks over threads, which the caller supplies.

#include <cstdint>
#include <functional>

namespace tandem {

/// Calls job(0) .. job(count - 1), in any order and on any threads, and returns when all are done. Empty: the
/// caller's thread runs one after the other.
using RunBlocks = std::function<void(std::uint32_t count, const std::function<void(std::uint32_t)>& job)>;

/// Calls job(0) .. job(count - 1) by `run`.
template <class Job>
void run_jobs(std::uint32_t count, const RunBlocks& run, const Job& job) {
  if (run && count > 1) {
    run(count, std::cref(job));  // by reference: a copy would be allocated
  } else {
    for (std::uint32_t i = 0; i < count; ++i) job(i);
  }
}

}  // namespace tandem
