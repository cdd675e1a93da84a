#pragma once
// Whether a program is alive and does what it is for.

#include <atomic>
#include <cstdint>
#include <string>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::metrics {

/// One thread, that of the program's work, writes; any thread reads. Neither waits.
class Health {
 public:
  /// A thread that has not been heard of for this time hangs. Longer than any frame or write may take.
  static constexpr std::int64_t kHangsNs = 5 * kSecond;
  /// Frames that their source makes, and that stand still here for so long, do so for good.
  static constexpr std::int64_t kStandsNs = 10 * kSecond;
  static constexpr const char* kStarting = "it starts";

  /// The work goes on. `obstacle`: why the program does not do what it is for; null if it does. It has to be
  /// a literal, as it is read later.
  void beat(std::int64_t now_ns, const char* obstacle) {
    obstacle_.store(obstacle, std::memory_order_relaxed);
    beat_ns_.store(now_ns, std::memory_order_relaxed);
  }

  /// Call it several times a second. `frames`: their number so far. `due`: their source says that it makes
  /// them: it is not suspended, not paused, and not in a step that may last.
  void saw_frames(std::uint64_t frames, bool due, std::int64_t now_ns) {
    if (!due || frames != frames_ || !due_) stands_ns_.store(due ? now_ns : 0, std::memory_order_relaxed);
    frames_ = frames;
    due_ = due;
  }

  struct Answer {
    bool good = false;
    std::string text;  ///< one line for a human
  };
  /// A program that starts is alive, however long that takes.
  [[nodiscard]] Answer alive(std::int64_t now_ns = transport::steady_ns()) const {
    const std::int64_t beat_ns = beat_ns_.load(std::memory_order_relaxed);
    const std::int64_t stands_ns = stands_ns_.load(std::memory_order_relaxed);
    if (stands_ns != 0 && now_ns - stands_ns > kStandsNs)
      return {false, "no frame has come for " + std::to_string((now_ns - stands_ns) / kSecond) +
                         " s, although their source makes them\n"};
    if (beat_ns == 0 || now_ns - beat_ns <= kHangsNs) return {true, "alive\n"};
    return {false, "its work has not gone on for " + std::to_string((now_ns - beat_ns) / kSecond) + " s\n"};
  }
  [[nodiscard]] Answer ready(std::int64_t now_ns = transport::steady_ns()) const {
    if (Answer answer = alive(now_ns); !answer.good) return answer;
    const char* const obstacle = obstacle_.load(std::memory_order_relaxed);
    return obstacle == nullptr ? Answer{true, "ready\n"} : Answer{false, std::string(obstacle) + '\n'};
  }

 private:
  std::atomic<const char*> obstacle_{kStarting};
  std::atomic<std::int64_t> beat_ns_{0};
  std::atomic<std::int64_t> stands_ns_{0};  // since when frames are due; 0: none are
  std::uint64_t frames_ = 0;                // of the thread that works
  bool due_ = false;
};

}  // namespace tandem::metrics
