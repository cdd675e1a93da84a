#include "tests/bench/lab/scale/machine.hpp"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

namespace tandem::lab {

double memory_bytes_per_s(std::uint32_t threads) {
  constexpr std::size_t kBytes = std::size_t{256} << 20U;
  constexpr int kRounds = 3;
  std::vector<char> from(kBytes, 1), to(kBytes, 2);
  const std::size_t part = kBytes / threads;
  double best = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto began = std::chrono::steady_clock::now();
    std::vector<std::jthread> others;
    const auto copy = [&](std::uint32_t i) {
      std::memcpy(to.data() + i * part, from.data() + i * part, part);
    };
    for (std::uint32_t i = 1; i < threads; ++i) others.emplace_back(copy, i);
    copy(0);
    others.clear();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    best = std::max(best, 2.0 * static_cast<double>(part) * threads / took.count());
  }
  return best;
}

std::uint64_t free_memory_bytes() {
  std::ifstream info("/proc/meminfo");
  std::string name, unit;
  std::uint64_t kilobytes = 0;
  while (info >> name >> kilobytes) {
    if (name == "MemAvailable:") return kilobytes << 10U;
    std::getline(info, unit);
  }
  return 0;
}

std::int64_t heap_bytes() {
  const struct mallinfo2 info = ::mallinfo2();
  return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
}

}  // namespace tandem::lab
