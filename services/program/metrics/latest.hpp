#pragma once
// Hands figures from the thread that works to the one that answers scrapes.

#include <mutex>

namespace tandem::metrics {

/// Holds the newest value. The writer never waits: while a reader copies, its value is dropped, and the next
/// one comes a moment later.
template <class T>
class Latest {
 public:
  void offer(const T& value) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock) value_ = value;
  }
  [[nodiscard]] T get() const {
    const std::scoped_lock lock(mutex_);
    return value_;
  }

 private:
  mutable std::mutex mutex_;
  T value_{};
};

}  // namespace tandem::metrics
