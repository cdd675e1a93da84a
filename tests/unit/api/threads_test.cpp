// Calls from several threads at once. The port is silent; the tests check which call waits for which.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/api/join.hpp"
#include "sdk/workers/block_threads.hpp"
#include "tests/support/client/fake_port.hpp"

namespace tandem::api {
namespace {

/// Nothing ever arrives; wait() waits for wake().
class SilentPort final : public client::FakePort {
 public:
  explicit SilentPort(std::atomic<int>& waiting) : waiting_(waiting) {}
  void wait(std::chrono::nanoseconds timeout) override {
    std::unique_lock lock(mutex_);
    ++waiting_;
    woken_.wait_for(lock, timeout, [this] { return awake_; });
    awake_ = false;
    --waiting_;
  }
  void wake() override {
    {
      const std::lock_guard lock(mutex_);
      awake_ = true;
    }
    woken_.notify_all();
  }

 private:
  std::atomic<int>& waiting_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool awake_ = false;
};

class Threads : public ::testing::Test {
 protected:
  tandem_client join(std::uint32_t background) {
    tandem_options options = TANDEM_OPTIONS_INIT;
    options.background = background;
    tandem_client client = 0;
    EXPECT_EQ(join_over(std::make_unique<SilentPort>(waiting), nullptr, &options, &client), TANDEM_OK);
    return client;
  }
  std::atomic<int> waiting = 0;  // threads within a port's wait()
};

TEST_F(Threads, AClientMayHaveThreadsForItsBodies) {
  tandem_options options = TANDEM_OPTIONS_INIT;
  for (const std::uint32_t threads : {0U, 1U, 3U}) {
    options.threads = threads;
    tandem_client client = 0;
    ASSERT_EQ(join_over(std::make_unique<SilentPort>(waiting), nullptr, &options, &client), TANDEM_OK);
    EXPECT_EQ(tandem_leave(client), TANDEM_OK);
  }
}

TEST(BlockThreads, WorkForOneCallerAtATimeAndTheOtherWorksAlone) {
  EXPECT_FALSE(blocks_on_threads(1, Callers::kMany));
  const RunBlocks run = blocks_on_threads(3, Callers::kMany);
  const auto work = [&run](std::vector<int>& done) {
    for (int round = 0; round < 300; ++round)
      run(static_cast<std::uint32_t>(done.size()), [&done](std::uint32_t i) { ++done[i]; });
  };
  std::vector<int> one(20), other(30);
  std::thread beside([&] { work(other); });
  work(one);
  beside.join();
  EXPECT_EQ(one, std::vector<int>(20, 300));
  EXPECT_EQ(other, std::vector<int>(30, 300));
}

TEST(BlockThreads, ACallFromWithinAJobIsWorkedOffAlone) {
  const RunBlocks run = blocks_on_threads(3, Callers::kMany);
  std::atomic<int> done = 0;
  run(5, [&](std::uint32_t) { run(4, [&](std::uint32_t) { ++done; }); });
  EXPECT_EQ(done, 20);
}

TEST_F(Threads, AClientWithAThreadIsNotUpdatedByAnother) {
  const tandem_client client = join(1);
  EXPECT_EQ(tandem_update(client, 0), TANDEM_WRONG_THREAD);
  EXPECT_EQ(tandem_leave(client), TANDEM_OK);
}

TEST_F(Threads, OnlyOneThreadUpdatesAtATime) {
  const tandem_client client = join(0);
  std::atomic<bool> done = false;
  std::thread other([&] {
    while (!done) tandem_update(client, 1000);
  });
  while (waiting == 0) std::this_thread::yield();
  // Its rounds are short, but it waits in nearly all of that time.
  bool refused = false;
  for (int i = 0; i < 10'000'000 && !refused; ++i) refused = tandem_update(client, 0) == TANDEM_WRONG_THREAD;
  EXPECT_TRUE(refused);
  done = true;
  other.join();
  EXPECT_EQ(tandem_leave(client), TANDEM_OK);
}

TEST_F(Threads, LeavingEndsTheWaitsOfOthers) {
  for (const std::uint32_t background : {0U, 1U}) {
    const tandem_client client = join(background);
    std::atomic<int> began = 0;
    std::vector<std::thread> others;
    for (int i = 0; i < 3; ++i) {
      others.emplace_back([&] {
        ++began;
        const tandem_result result = tandem_wait_until_playing(client, 3600);
        EXPECT_TRUE(result == TANDEM_INVALID_HANDLE || result == TANDEM_WRONG_THREAD) << result;
      });
    }
    while (began < 3 || waiting == 0) std::this_thread::yield();
    EXPECT_EQ(tandem_leave(client), TANDEM_OK);
    for (std::thread& other : others) other.join();
  }
}

TEST_F(Threads, CallsAndLeavingMayMeetInAnyOrder) {
  for (int round = 0; round < 50; ++round) {
    const tandem_client client = join(round % 2 == 0 ? 1 : 0);
    std::atomic<int> left = 0;
    std::vector<std::thread> others;
    for (int i = 0; i < 3; ++i) {
      others.emplace_back([&, i] {
        tandem_status status = TANDEM_STATUS_INIT;
        tandem_event event = TANDEM_EVENT_INIT;
        for (;;) {
          tandem_result result = tandem_get_status(client, &status);
          if (result == TANDEM_INVALID_HANDLE) break;
          tandem_next_event(client, &event);
          tandem_sample(client, nullptr, nullptr, nullptr);
          if (i == 0) tandem_update(client, 0);
        }
      });
    }
    for (int i = 0; i < 2; ++i) {
      others.emplace_back([&] { left += tandem_leave(client) == TANDEM_OK ? 1 : 0; });
    }
    for (std::thread& other : others) other.join();
    EXPECT_EQ(left, 1);
  }
}

TEST_F(Threads, EachHasAnErrorTextOfItsOwn) {
  EXPECT_EQ(tandem_leave(0), TANDEM_INVALID_HANDLE);
  const std::string mine = tandem_error_text();
  std::thread([] {
    EXPECT_STREQ(tandem_error_text(), "");
    EXPECT_EQ(tandem_join(nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  }).join();
  EXPECT_EQ(mine, tandem_error_text());
}

TEST_F(Threads, AForkedChildHasNoClientsAndTheParentKeepsIts) {
  const tandem_client client = join(1);
  const pid_t child = fork();
  if (child == 0) {
    tandem_status status = TANDEM_STATUS_INIT;
    tandem_client other = 0;
    const bool right = tandem_get_status(client, &status) == TANDEM_INVALID_HANDLE &&
                       tandem_leave(client) == TANDEM_INVALID_HANDLE &&
                       tandem_join(nullptr, &other) == TANDEM_TRANSPORT && other == 0;
    _exit(right ? 0 : 1);
  }
  int ended = -1;
  ASSERT_EQ(waitpid(child, &ended, 0), child);
  EXPECT_EQ(ended, 0);
  tandem_status status = TANDEM_STATUS_INIT;
  EXPECT_EQ(tandem_get_status(client, &status), TANDEM_OK);
  EXPECT_EQ(tandem_leave(client), TANDEM_OK);
}

}  // namespace
}  // namespace tandem::api
