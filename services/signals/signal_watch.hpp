#pragma once
// SIGINT and SIGTERM as a flag.

#include <pthread.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <thread>

namespace tandem {

/// A thread waits for the signals, so that no handler and no global is needed. Make it before other threads:
/// its mask holds for those started later.
class SignalWatch {
 public:
  SignalWatch() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);  // inherited by all threads started from here on
    thread_ = std::jthread([this](const std::stop_token& done) {
      constexpr timespec kTick{.tv_sec = 0, .tv_nsec = 50'000'000};
      while (!done.stop_requested()) {
        if (sigtimedwait(&signals_, nullptr, &kTick) > 0) stop_.store(true, std::memory_order_relaxed);
      }
    });
  }
  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }

 private:
  sigset_t signals_{};
  std::atomic<bool> stop_{false};
  std::jthread thread_;
};

}  // namespace tandem
