#include "services/program/process/heap.hpp"

#include <chrono>
#include <stop_token>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace tandem {
namespace {

constexpr std::chrono::seconds kInterval{15};

}  // namespace

void trim_heap() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

HeapTrimmer::HeapTrimmer() {
  thread_ = std::jthread([this](const std::stop_token& ends) {
    std::unique_lock lock(mutex_);
    while (!ends.stop_requested()) {
      ended_.wait_for(lock, ends, kInterval, [] { return false; });
      trim_heap();
    }
  });
}

}  // namespace tandem
