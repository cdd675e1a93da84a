#pragma once
// Spreads work on blocks over threads, which the caller supplies.

#include <cstdint>
#include <functional>

namespace tandem {

/// Calls job(0) .. job(count - 1), in any order and on any threads, and returns when all are done. Empty: the
/// caller's thread runs one after the other.
using RunBlocks = std::function<void(std::uint32_t count, const std::function<void(std::uint32_t)>& job)>;

/// Does the same by `run`, which may be empty. Allocates nothing by itself.
template <class Job>
void run_jobs(const RunBlocks& run, std::uint32_t count, const Job& job) {
  if (run && count > 1) {
    run(count, std::ref(job));
  } else {
    for (std::uint32_t i = 0; i < count; ++i) job(i);
  }
}

}  // namespace tandem
