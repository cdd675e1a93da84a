#pragma once
// Whether a program is alive and does what it is for.

#include <atomic>
#include <cstdint>
#include <string>

#include "sdk/transport/clock.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::metrics {

/// One thread, that of the program's work, writes; any thread reads. Neither waits.
class Health {
 public:
  /// A thread that has not been heard of for this time hangs. Longer than any frame or write may take.
  static constexpr std::int64_t kHangsNs = 5 * kSecond;
  static constexpr const char* kStarting = "it starts";

  /// The work goes on. `obstacle`: why the program does not do what it is for; null if it does. It has to be
  /// a literal, as it is read later.
  void beat(std::int64_t now_ns, const char* obstacle) {
    obstacle_.store(obstacle, std::memory_order_relaxed);
    beat_ns_.store(now_ns, std::memory_order_relaxed);
  }

  struct Answer {
    bool good = false;
    std::string text;  ///< one line for a human
  };
  /// A program that starts is alive, however long that takes.
  [[nodiscard]] Answer alive(std::int64_t now_ns = transport::steady_ns()) const {
    const std::int64_t beat_ns = beat_ns_.load(std::memory_order_relaxed);
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
};

}  // namespace tandem::metrics
