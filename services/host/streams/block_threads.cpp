#include "services/host/streams/block_threads.hpp"

#include <memory>

#include "sdk/workers/workers.hpp"

namespace tandem::host {

RunBlocks blocks_on_threads(std::uint32_t threads) {
  if (threads <= 1) return {};
  return [workers = std::make_shared<Workers>(threads)](std::uint32_t count,
                                                        const std::function<void(std::uint32_t)>& job) {
    workers->run(count, 1, [&job](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) job(i);
    });
  };
}

}  // namespace tandem::host
