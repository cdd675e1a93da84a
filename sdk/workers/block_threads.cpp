#include "sdk/workers/block_threads.hpp"

#include <atomic>
#include <memory>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/workers/workers.hpp"

namespace tandem {
namespace {

struct Pool {
  explicit Pool(std::uint32_t threads) : workers(threads) {}
  std::atomic<bool> at_work = false;
  Workers workers;
};

}  // namespace

RunBlocks blocks_on_threads(std::uint32_t threads, Callers callers) {
  if (threads <= 1) return {};
  return [pool = std::make_shared<Pool>(threads), callers](std::uint32_t count,
                                                           const std::function<void(std::uint32_t)>& job) {
    const auto run = [&job](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) job(i);
    };
    if (count <= 1) return run(0, count);
    if (pool->at_work.exchange(true)) {
      TANDEM_ASSERT(callers == Callers::kMany);
      return run(0, count);
    }
    pool->workers.run(count, 1, run);
    pool->at_work.store(false);
  };
}

}  // namespace tandem
