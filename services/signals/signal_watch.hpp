#pragma once
// SIGINT and SIGTERM as a flag.

#include <pthread.h>

#include <atomic>
#include <csignal>
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
    thread_ = std::thread([this] {
      while (!done_) {
        // A process that was stopped and goes on gets here without a signal.
        if (sigwaitinfo(&signals_, nullptr) > 0 && !done_) stop_.store(true, std::memory_order_relaxed);
      }
    });
  }
  ~SignalWatch() {
    done_ = true;
    pthread_kill(thread_.native_handle(), SIGTERM);  // blocked in every thread: it ends the wait only
    thread_.join();
  }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  SignalWatch(SignalWatch&&) = delete;
  SignalWatch& operator=(SignalWatch&&) = delete;

  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }

 private:
  sigset_t signals_{};
  std::atomic<bool> stop_{false}, done_{false};
  std::thread thread_;
};

}  // namespace tandem
