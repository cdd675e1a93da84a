#include "sdk/transport/secure/handshake_watch.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace tandem::transport::secure {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

/// What a thread does in a second.
struct Habit {
  std::string name;
  std::uint64_t user_ms, system_ms, waits, preempted;
};

/// Whether the watch, which looks every `period_s`, ever finds threads of these habits stuck within 150 s.
bool ever_stuck(const std::vector<Habit>& habits, std::int64_t period_s = 2) {
  HandshakeWatch watch;
  for (std::int64_t s = 0; s <= 150; s += period_s) {
    std::vector<ThreadUse> threads;
    const auto passed = static_cast<std::uint64_t>(s);
    for (const Habit& habit : habits) {
      const std::uint64_t waits = 100 + habit.waits * passed;
      threads.push_back({static_cast<int>(threads.size()) + 1, habit.name, habit.user_ms * passed,
                         habit.system_ms * passed, waits, waits + 7 + habit.preempted * passed});
    }
    if (watch.stuck(threads, s * kSecondNs)) return true;
  }
  return false;
}

constexpr const char* kHandshakes = "fsm";
constexpr const char* kDiscovery = "dq.builtins";
const Habit kStands{kDiscovery, 0, 0, 0, 0};

TEST(HandshakeWatch, FindsHandshakesThatSpinWhileDiscoveryStands) {
  EXPECT_TRUE(ever_stuck({{kHandshakes, 980, 20, 0, 0}, kStands}));
  EXPECT_TRUE(ever_stuck({{kHandshakes, 250, 0, 0, 90}, kStands})) << "on a busy machine";
  EXPECT_TRUE(ever_stuck(
      {{kHandshakes, 1000, 0, 0, 3}, kStands, {kHandshakes, 1, 1, 5, 0}, {kDiscovery, 2, 1, 40, 3}}))
      << "beside another domain that is well";
  EXPECT_TRUE(ever_stuck({{kHandshakes, 1000, 0, 0, 3}, {kDiscovery, 2, 1, 40, 3}}))
      << "where nobody comes or goes";
}

TEST(HandshakeWatch, ABusyMachineIsNotStuck) {
  EXPECT_FALSE(ever_stuck({})) << "without DDS Security";
  EXPECT_FALSE(ever_stuck({{kHandshakes, 0, 0, 0, 0}, kStands})) << "nobody there";
  EXPECT_FALSE(ever_stuck({{kHandshakes, 10, 0, 0, 5}, kStands})) << "threads that get no processor";
  EXPECT_FALSE(ever_stuck({{kHandshakes, 800, 200, 0, 50}, kStands}))
      << "ten thousand strangers who are silent now";
  EXPECT_FALSE(ever_stuck({{kHandshakes, 400, 0, 0, 50}, {kDiscovery, 0, 0, 1, 0}}))
      << "a packet now and then";
  EXPECT_FALSE(ever_stuck({{kHandshakes, 900, 0, 1, 50}, kStands})) << "handshakes that wait for something";
}

TEST(HandshakeWatch, AProcessThatWasStoppedIsNotStuck) {
  HandshakeWatch watch;
  const auto after = [](std::uint64_t user_ms) {
    return std::vector<ThreadUse>{{1, kHandshakes, user_ms, 0, 10, 10}, {2, kDiscovery, 5, 5, 10, 10}};
  };
  EXPECT_FALSE(watch.stuck(after(0), 0));
  EXPECT_FALSE(watch.stuck(after(100), 3600 * kSecondNs));
}

TEST(HandshakeWatch, AThreadThatIsNewWithTheIdOfAnOldOneIsAnotherOne) {
  HandshakeWatch watch;
  EXPECT_FALSE(watch.stuck({{1, kHandshakes, 0, 0, 10, 10}, {2, kDiscovery, 5, 5, 10, 10}}, 0));
  EXPECT_FALSE(
      watch.stuck({{1, kDiscovery, 9000, 0, 10, 10}, {2, kHandshakes, 9000, 5, 10, 10}}, 20 * kSecondNs));
}

TEST(HandshakeWatch, SeesTheThreadsOfThisProcess) {
  std::atomic<bool> stop = false, stands = true;
  const auto start = [](const char* name, const std::function<void()>& work) {
    std::thread thread(work);
    pthread_setname_np(thread.native_handle(), name);
    return thread;
  };
  std::thread spins = start(kHandshakes, [&stop] {
    while (!stop.load(std::memory_order_relaxed)) {
    }
  });
  std::thread waits = start(kDiscovery, [&stands] { stands.wait(true); });
  const auto user_ms = [](const std::vector<ThreadUse>& threads) {
    const auto at = std::ranges::find(threads, kHandshakes, &ThreadUse::name);
    return at == threads.end() ? 0 : at->user_ms;
  };
  HandshakeWatch watch;
  usleep(50'000);
  const std::vector<ThreadUse> before = threads_of_this_process();
  EXPECT_GE(before.size(), 3U);
  EXPECT_FALSE(watch.stuck(before, 0));
  std::vector<ThreadUse> after;
  do {
    usleep(50'000);
    after = threads_of_this_process();
  } while (user_ms(after) < user_ms(before) + HandshakeWatch::kLeastUserMs);
  EXPECT_TRUE(watch.stuck(after, HandshakeWatch::kPatienceNs));
  stop = true;
  stands = false;
  stands.notify_all();
  spins.join();
  waits.join();
}

}  // namespace
}  // namespace tandem::transport::secure
