#pragma once
// What threads of the middleware wake a waiting thread by.

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace tandem::transport::dds {

/// Rung once or often, it ends one wait. Cheaper than a guard condition on a waitset: nobody enters the
/// kernel unless somebody really waits. Thread-safe; one thread waits.
class Doorbell {
 public:
  void ring() {
    bool wake = false;
    {
      const std::lock_guard lock(mutex_);
      wake = waiting_ && !rung_;
      rung_ = true;
    }
    if (wake) rang_.notify_one();
  }
  /// Until it rings, at once if it has rung since the last wait; or for so long.
  void wait(std::chrono::nanoseconds timeout) {
    std::unique_lock lock(mutex_);
    waiting_ = true;
    if (!rung_ && timeout.count() > 0) rang_.wait_for(lock, timeout, [this] { return rung_; });
    waiting_ = rung_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable rang_;
  bool waiting_ = false, rung_ = false;
};

}  // namespace tandem::transport::dds
