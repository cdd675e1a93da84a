#include "services/workers/workers.hpp"

#include <algorithm>

namespace tandem {

Workers::Workers(std::uint32_t threads, const std::function<void()>& prepare)
    : barrier_(static_cast<std::ptrdiff_t>(std::max(threads, 1U))) {
  for (std::uint32_t i = 1; i < threads; ++i) {
    threads_.emplace_back([this, prepare] {
      if (prepare) prepare();
      for (;;) {
        barrier_.arrive_and_wait();
        if (stop_) return;
        take_blocks();
        barrier_.arrive_and_wait();
      }
    });
  }
}

Workers::~Workers() {
  stop_ = true;
  if (!threads_.empty()) barrier_.arrive_and_wait();
}

void Workers::share(std::uint32_t count, std::uint32_t block) {
  count_ = count;
  block_ = block;
  next_.store(0, std::memory_order_relaxed);
  barrier_.arrive_and_wait();
  take_blocks();
  barrier_.arrive_and_wait();
}

void Workers::take_blocks() {
  for (;;) {
    const std::uint32_t begin = next_.fetch_add(block_, std::memory_order_relaxed);
    if (begin >= count_) return;
    call_(context_, begin, std::min(begin + block_, count_));
  }
}

}  // namespace tandem
