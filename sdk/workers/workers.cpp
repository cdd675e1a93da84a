#include "sdk/workers/workers.hpp"

#include <algorithm>
#include <chrono>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::uint64_t kRun = std::uint64_t{1} << 32U;

// The caller judges its threads after so much time with them; a scheduler's slice is a few milliseconds.
constexpr std::int64_t kJudgedNs = 20'000'000;
// How long it works alone: twice as long each time that the threads were no help again.
constexpr std::int64_t kShortestAloneNs = 50'000'000, kLongestAloneNs = 800'000'000;
// Loops of one step follow each other within microseconds, and a sleeping thread takes tens to wake.
constexpr int kLooks = 300;

std::int64_t now_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits until `value` is no longer `old`.
template <class T>
void await_change(const std::atomic<T>& value, T old) {
  for (int look = 0; look < kLooks; ++look) {
    if (value.load(std::memory_order_acquire) != old) return;
    pause();
  }
  value.wait(old);
}

std::uint32_t left_of(std::uint64_t ticket) { return static_cast<std::uint32_t>(ticket % kRun); }

}  // namespace

Workers::Workers(std::uint32_t threads, const std::function<void()>& prepare) : shares_(threads) {
  TANDEM_ASSERT(1 <= threads && threads <= kMaxThreads);
  for (std::uint32_t i = 1; i < threads; ++i) {
    threads_.emplace_back([this, prepare, i] {
      if (prepare) prepare();
      for (;;) {
        const std::uint32_t run = run_.load();
        take_blocks(i);
        if (stop_.load()) return;
        await_change(run_, run);
      }
    });
  }
}

Workers::~Workers() {
  stop_.store(true);
  run_.fetch_add(1);
  run_.notify_all();
}

void Workers::share(std::uint32_t count, std::uint32_t block) {
  TANDEM_ASSERT(undone_.load() == 0);  // one job at a time, and none from within a job
  TANDEM_ASSERT(0 < block && block < count);
  const std::int64_t began_ns = now_ns();
  if (began_ns < alone_until_ns_) return work_alone(count, block);
  count_ = count;
  block_ = block;
  const std::uint32_t blocks = (count - 1) / block + 1;
  blocks_ = blocks;
  undone_.store(blocks);
  const std::uint32_t run = run_.load() + 1;
  for (std::uint32_t i = 0; i < shares_.size(); ++i)
    shares_[i].ticket.store(run * kRun + (first_of(i + 1) - first_of(i)));
  run_.store(run);
  run_.notify_all();
  const std::uint32_t taken = take_blocks(0);
  const std::int64_t worked_ns = now_ns() - began_ns;
  for (std::uint32_t undone = undone_.load(); undone != 0; undone = undone_.load())
    await_change(undone_, undone);
  const std::int64_t end_ns = now_ns();
  // The others' blocks would have taken as long as the caller's.
  if (taken > 0) saved_ns_ += worked_ns * (blocks - taken) / taken;
  waited_ns_ += end_ns - began_ns - worked_ns;
  shared_ns_ += end_ns - began_ns;
  if (shared_ns_ > kJudgedNs) judge(end_ns);
}

void Workers::work_alone(std::uint32_t count, std::uint32_t block) {
  for (std::uint32_t begin = 0; begin < count; begin += std::min(block, count - begin))
    call_(context_, begin, begin + std::min(block, count - begin));
}

void Workers::judge(std::int64_t now_ns) {
  const bool helped = saved_ns_ > waited_ns_;
  alone_for_ns_ = helped ? 0 : std::clamp(2 * alone_for_ns_, kShortestAloneNs, kLongestAloneNs);
  alone_until_ns_ = now_ns + alone_for_ns_;
  saved_ns_ = waited_ns_ = shared_ns_ = 0;
}

std::uint32_t Workers::take_blocks(std::uint32_t own) {
  const auto shares = static_cast<std::uint32_t>(shares_.size());
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < shares; ++i) {
    const std::uint32_t share = (own + i) % shares;
    std::uint64_t ticket = shares_[share].ticket.load();
    while (left_of(ticket) != 0) {
      if (!shares_[share].ticket.compare_exchange_weak(ticket, ticket - 1)) continue;
      // The run lasts until this block counts as done, so what belongs to it may be read now.
      ++taken;
      const std::uint32_t begin = (first_of(share + 1) - left_of(ticket)) * block_;
      TANDEM_ASSERT(begin < count_);
      call_(context_, begin, std::min(begin + block_, count_));
      ticket = shares_[share].ticket.load();
    }
  }
  if (taken == 0) return 0;
  const std::uint32_t undone = undone_.fetch_sub(taken);
  TANDEM_ASSERT(undone >= taken);
  if (undone == taken) undone_.notify_one();
  return taken;
}

}  // namespace tandem
