#pragma once
// What threads of the middleware wake a waiting thread by.

#include <semaphore.h>
#include <time.h>

#include <atomic>
#include <chrono>

namespace tandem::transport::dds {

/// Rung once or often, it ends one wait. A semaphore, because it enters the kernel once to wake and once to
/// wait, and only where somebody really waits; a condition variable's mutex takes two more calls.
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
  /// Until it rings, at once if it has rung since the last wait; or for so long.
  void wait(std::chrono::nanoseconds timeout) {
    // Before whoever waited looks at what came: a ring from here on counts for the next wait. An exchange, so
    // that what a ring without a post announced is seen.
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

}  // namespace tandem::transport::dds
