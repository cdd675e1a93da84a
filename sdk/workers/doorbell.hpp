#pragma once
// Wakes a waiting thread from threads of the middleware.

#include <semaphore.h>
#include <time.h>

#include <atomic>
#include <chrono>

namespace tandem::transport {

/// One or more rings end one wait. It is a semaphore, because that enters the kernel once to wake and once to
/// wait, and only if a thread really waits; the mutex of a condition variable takes two more calls.
/// Thread-safe; one thread waits.
class Doorbell {
 public:
  Doorbell() { sem_init(&rings_, 0, 0); }
  ~Doorbell() { sem_destroy(&rings_); }
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;
  Doorbell(Doorbell&&) = delete;
  Doorbell& operator=(Doorbell&&) = delete;

  void ring() {
    if (!rung_.exchange(true)) sem_post(&rings_);
  }
  /// Waits until it rings, at most `timeout`. Returns at once if it has rung since the last wait.
  void wait(std::chrono::nanoseconds timeout) {
    // This happens before the waiting thread looks at what came, so a later ring counts for the next wait. It
    // is an exchange, so that the thread sees what a ring without a post announced.
    if (rang_within(timeout)) rung_.exchange(false);
  }

 private:
  bool rang_within(std::chrono::nanoseconds timeout) {
    if (timeout.count() <= 0) return sem_trywait(&rings_) == 0;
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    const auto whole = std::chrono::floor<std::chrono::seconds>(timeout);
    until.tv_sec += static_cast<time_t>(whole.count());
    until.tv_nsec += static_cast<long>((timeout - whole).count());
    if (until.tv_nsec >= kSecondNs) {
      ++until.tv_sec;
      until.tv_nsec -= kSecondNs;
    }
    return sem_clockwait(&rings_, CLOCK_MONOTONIC, &until) == 0;
  }

  static constexpr long kSecondNs = 1'000'000'000;
  sem_t rings_{};
  std::atomic<bool> rung_ = false;
};

}  // namespace tandem::transport
