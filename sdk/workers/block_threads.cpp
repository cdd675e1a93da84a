#include "sdk/workers/block_threads.hpp"

#include <memory>
#include <mutex>

#include "sdk/workers/workers.hpp"

namespace tandem {
namespace {

struct Pool {
  explicit Pool(std::uint32_t threads) : workers(threads) {}
  std::mutex mutex;  // held by the caller that the threads work for
  Workers workers;
};

}  // namespace

RunBlocks blocks_on_threads(std::uint32_t threads) {
  if (threads <= 1) return {};
  return [pool = std::make_shared<Pool>(threads)](std::uint32_t count,
                                                  const std::function<void(std::uint32_t)>& job) {
    const auto run = [&job](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) job(i);
    };
    const std::unique_lock lock(pool->mutex, std::try_to_lock);
    if (!lock) return run(0, count);
    pool->workers.run(count, 1, run);
  };
}

}  // namespace tandem
