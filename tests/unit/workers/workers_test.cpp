#include "sdk/workers/workers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

namespace tandem {
namespace {

/// How often each index below `count` was given to a job; blocks are checked on the way.
std::vector<int> visits(Workers& workers, std::uint32_t count, std::uint32_t block) {
  std::vector<int> seen(count);  // no atomics: blocks do not share an index
  std::atomic<bool> in_range = true;
  workers.run(count, block, [&](std::uint32_t begin, std::uint32_t end) {
    if (begin >= end || end > count) in_range = false;
    for (std::uint32_t i = begin; i < end && i < count; ++i) ++seen[i];
  });
  EXPECT_TRUE(in_range);
  return seen;
}

TEST(Workers, EveryIndexIsVisitedOnce) {
  for (const std::uint32_t threads : {1U, 2U, 3U, 8U}) {
    Workers workers(threads);
    for (const auto& [count, block] :
         {std::pair{1U, 1U}, {1000U, 1U}, {1000U, 7U}, {1000U, 999U}, {64U, 64U}}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << count << " in blocks of " << block);
      EXPECT_EQ(visits(workers, count, block), std::vector<int>(count, 1));
    }
  }
}

TEST(Workers, BlocksAreOfTheSizeAskedForButForTheLast) {
  Workers workers(3);
  std::mutex mutex;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> blocks;
  workers.run(25, 10, [&](std::uint32_t begin, std::uint32_t end) {
    const std::lock_guard lock(mutex);
    blocks.emplace_back(begin, end);
  });
  std::ranges::sort(blocks);
  EXPECT_EQ(blocks, (std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 10}, {10, 20}, {20, 25}}));
}

// So that a thread finds in its processor's caches what it wrote in the run before.
TEST(Workers, TheCallerBeginsWithTheFirstBlocksAndAnotherThreadWithTheLast) {
  Workers workers(2);
  std::array<std::thread::id, 2> by;
  std::atomic<int> taken = 0;
  workers.run(2, 1, [&](std::uint32_t begin, std::uint32_t) {
    by.at(begin) = std::this_thread::get_id();
    // Whoever has a block waits until the other has one as well.
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    for (++taken; taken < 2 && std::chrono::steady_clock::now() < end;) std::this_thread::yield();
  });
  EXPECT_EQ(by[0], std::this_thread::get_id());
  EXPECT_NE(by[1], std::this_thread::get_id());
}

TEST(Workers, NothingToDoCallsNoJob) {
  for (const std::uint32_t threads : {1U, 4U}) {
    Workers workers(threads);
    workers.run(0, 8, [](std::uint32_t, std::uint32_t) { ADD_FAILURE(); });
  }
}

TEST(Workers, OneThreadWorksOnTheCallersWithoutCutting) {
  Workers workers(1);
  int calls = 0;
  workers.run(1000, 8, [&, caller = std::this_thread::get_id()](std::uint32_t begin, std::uint32_t end) {
    ++calls;
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(begin, 0U);
    EXPECT_EQ(end, 1000U);
  });
  EXPECT_EQ(calls, 1);
}

// A run reads what the run before it wrote, on whichever thread: the end of a run orders the two.
TEST(Workers, ARunSeesWhatTheRunBeforeItWrote) {
  constexpr std::uint32_t kCount = 512;
  Workers workers(4);
  std::vector<std::uint32_t> here(kCount), there(kCount);
  for (std::uint32_t run = 0; run < 2000; ++run) {
    workers.run(kCount, 1 + run % 64, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) there[i] = here[kCount - 1 - i] + 1;
    });
    std::swap(here, there);
  }
  EXPECT_EQ(here, std::vector<std::uint32_t>(kCount, 2000));
}

TEST(Workers, AWorkerThatWokeLateFindsNothingLeftAndTheNextRunComplete) {
  Workers workers(8);  // more than there are cores, so that some sleep through a run
  for (int run = 0; run < 5000; ++run) {
    int first = 0, second = 0;
    workers.run(2, 1, [&](std::uint32_t begin, std::uint32_t) { (begin == 0 ? first : second) += 1; });
    ASSERT_EQ(first, 1) << run;
    ASSERT_EQ(second, 1) << run;
  }
}

TEST(Workers, AllThreadsTakePartAndEachWasPreparedFirst) {
  constexpr std::uint32_t kThreads = 4;
  std::mutex mutex;
  std::set<std::thread::id> prepared, working;
  Workers workers(kThreads, [&] {
    const std::lock_guard lock(mutex);
    prepared.insert(std::this_thread::get_id());
  });
  // Each block waits for the others, so that no thread can take two.
  std::atomic<std::uint32_t> taken = 0;
  workers.run(kThreads, 1, [&](std::uint32_t, std::uint32_t) {
    for (++taken; taken < kThreads;) std::this_thread::yield();
    const std::lock_guard lock(mutex);
    working.insert(std::this_thread::get_id());
  });
  EXPECT_EQ(working.size(), kThreads);
  EXPECT_EQ(prepared.size(), kThreads - 1) << "all but the caller's";
  working.erase(std::this_thread::get_id());
  EXPECT_EQ(working, prepared);
}

TEST(Workers, SeveralPoolsWorkAtTheSameTime) {
  std::vector<std::jthread> callers;
  std::array<std::vector<int>, 3> seen;
  callers.reserve(seen.size());
  for (auto& mine : seen) {
    callers.emplace_back([&mine] {
      Workers workers(2);
      for (int run = 0; run < 200; ++run) mine = visits(workers, 300, 11);
    });
  }
  callers.clear();
  for (const auto& mine : seen) EXPECT_EQ(mine, std::vector<int>(300, 1));
}

TEST(Workers, APoolEndsWhileIdleAtOnceAndAfterARun) {
  for (int i = 0; i < 200; ++i) {
    Workers unused(4);
    Workers used(4);
    EXPECT_EQ(visits(used, 10, 1), std::vector<int>(10, 1));
  }
}

// A thread whose core another program uses keeps its block for milliseconds, and all wait for it.
TEST(Workers, ThreadsThatCostMoreThanTheyHelpAreLeftOutForAWhile) {
  Workers workers(2);
  const std::thread::id caller = std::this_thread::get_id();
  int alone = 0;  // runs, one after the other
  for (int run = 0; run < 2000 && alone < 5; ++run) {
    std::atomic<int> by_caller = 0;
    workers.run(8, 1, [&](std::uint32_t, std::uint32_t) {
      const bool mine = std::this_thread::get_id() == caller;
      by_caller += mine ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::microseconds(mine ? 100 : 3000));
    });
    alone = by_caller == 8 ? alone + 1 : 0;
  }
  EXPECT_EQ(alone, 5);
}

}  // namespace
}  // namespace tandem
