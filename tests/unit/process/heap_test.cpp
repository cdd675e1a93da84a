#include "services/program/process/heap.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace {

std::size_t resident_kb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::size_t kb = 0;
    if (word == "VmRSS:" && status >> kb) return kb;
  }
  return 0;
}

TEST(HeapTest, WhatIsFreeBelowABlockInUseIsGivenBack) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another allocator";
#endif
  constexpr std::size_t kBlocks = 32 << 10, kBlockBytes = 1 << 10;
  std::vector<std::unique_ptr<std::byte[]>> blocks(kBlocks);
  for (auto& block : blocks) {
    block = std::make_unique<std::byte[]>(kBlockBytes);
    std::memset(block.get(), 1, kBlockBytes);
  }
  const std::size_t full_kb = resident_kb();
  const auto in_use = std::move(blocks.back());
  blocks.clear();
  tandem::trim_heap();
  EXPECT_LT(resident_kb(), full_kb - (kBlocks * kBlockBytes >> 10U) / 2);
}

TEST(HeapTest, ATrimmerEndsWithoutWaitingForItsTime) {
  const auto threads = [] {
    const std::filesystem::directory_iterator tasks("/proc/self/task");
    return std::distance(begin(tasks), end(tasks));
  };
  const auto before = threads();
  for (int i = 0; i < 100; ++i) {
    const tandem::HeapTrimmer trimmer;
    EXPECT_GT(threads(), before);
  }
  // The system lists a thread for a moment after it was joined.
  for (int i = 0; i < 1000 && threads() != before; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(threads(), before);
}

}  // namespace
