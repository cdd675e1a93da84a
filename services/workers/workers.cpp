#include "services/workers/workers.hpp"

#include <algorithm>

namespace tandem {
namespace {

constexpr std::uint64_t kRun = std::uint64_t{1} << 32U;

std::uint32_t left_of(std::uint64_t ticket) { return static_cast<std::uint32_t>(ticket % kRun); }

}  // namespace

Workers::Workers(std::uint32_t threads, const std::function<void()>& prepare) {
  for (std::uint32_t i = 1; i < threads; ++i) {
    threads_.emplace_back([this, prepare] {
      if (prepare) prepare();
      for (;;) {
        const std::uint64_t ticket = take_blocks();
        if (stop_.load()) return;
        ticket_.wait(ticket);
      }
    });
  }
}

Workers::~Workers() {
  stop_.store(true);
  ticket_.fetch_add(kRun);
  ticket_.notify_all();
}

void Workers::share(std::uint32_t count, std::uint32_t block) {
  count_ = count;
  block_ = block;
  const std::uint32_t blocks = (count - 1) / block + 1;
  undone_.store(blocks);
  ticket_.store((ticket_.load() / kRun + 1) * kRun + blocks);
  ticket_.notify_all();
  take_blocks();
  for (std::uint32_t undone = undone_.load(); undone != 0; undone = undone_.load()) undone_.wait(undone);
}

std::uint64_t Workers::take_blocks() {
  std::uint64_t ticket = ticket_.load();
  while (left_of(ticket) != 0) {
    if (!ticket_.compare_exchange_weak(ticket, ticket - 1)) continue;
    // The run lasts until this block is done, so what belongs to it may be read now.
    const std::uint32_t begin = (left_of(ticket) - 1) * block_;
    call_(context_, begin, std::min(begin + block_, count_));
    if (undone_.fetch_sub(1) == 1) undone_.notify_one();
    ticket = ticket_.load();
  }
  return ticket;
}

}  // namespace tandem
