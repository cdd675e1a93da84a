#pragma once
// A pool of threads that take blocks of work in turn.

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace tandem {

/// Maximum number of threads of a pool, including the caller's; more would hardly find blocks.
inline constexpr std::uint32_t kMaxThreads = 64;

/// Runs one job at a time on the calling thread and `threads - 1` others. Each thread begins with a share of
/// its own, the same in every job over the same things, as what it wrote in the job before is still in its
/// processor's caches. Then it takes blocks of the others' shares, because a static split waits for a thread
/// whose core another program is using. A thread that wakes up late
/// and finds nothing left does not delay the end. One that is interrupted while it has a block does: if for
/// some time the caller waited for longer than the others saved it, it works alone for a while, and then
/// tries again. Jobs must write to separate places.
class Workers {
 public:
  /// Each thread of the pool calls `prepare` first.
  explicit Workers(std::uint32_t threads, const std::function<void()>& prepare = {});
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers();

  /// Calls job(begin, end) for blocks of at most `block` that cover [0, count); returns when all are done.
  template <class Job>
  void run(std::uint32_t count, std::uint32_t block, const Job& job) {
    if (threads_.empty() || count <= block) {
      if (count > 0) job(std::uint32_t{0}, count);
      return;
    }
    context_ = &job;
    call_ = [](const void* context, std::uint32_t begin, std::uint32_t end) {
      (*static_cast<const Job*>(context))(begin, end);
    };
    share(count, block);
  }

 private:
  /// A thread's part of a run: the number of the run in the upper half, the number of blocks not yet taken in
  /// the lower.
  struct alignas(64) Share {
    std::atomic<std::uint64_t> ticket{0};
  };

  void share(std::uint32_t count, std::uint32_t block);
  /// Takes blocks until none is left, first of the share `own`; returns how many.
  std::uint32_t take_blocks(std::uint32_t own);
  /// The block at which a share begins.
  [[nodiscard]] std::uint32_t first_of(std::uint32_t share) const {
    return static_cast<std::uint32_t>(std::uint64_t{blocks_} * share / shares_.size());
  }
  void work_alone(std::uint32_t count, std::uint32_t block);
  /// Decides at the end of a while whether the next one is spent alone.
  void judge(std::int64_t now_ns);

  // The current run. These change only while no block is taken.
  const void* context_ = nullptr;
  void (*call_)(const void*, std::uint32_t, std::uint32_t) = nullptr;
  std::uint32_t count_ = 0;
  std::uint32_t block_ = 1, blocks_ = 0;
  std::vector<Share> shares_;  // the caller's first
  std::atomic<std::uint32_t> run_{0};
  std::atomic<std::uint32_t> undone_{0};  // blocks
  std::atomic<bool> stop_{false};
  // What the other threads are worth, of the caller's time.
  std::int64_t saved_ns_ = 0, waited_ns_ = 0, shared_ns_ = 0;  ///< since the last judgement
  std::int64_t alone_until_ns_ = 0, alone_for_ns_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace tandem
