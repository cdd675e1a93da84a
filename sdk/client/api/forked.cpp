#include "sdk/client/api/forked.hpp"

#include <pthread.h>

#include <atomic>

namespace tandem::api {
namespace {

std::atomic<bool> forked = false;

}  // namespace

void watch_forks() {
  [[maybe_unused]] static const int watched =
      pthread_atfork(nullptr, nullptr, [] { forked.store(true, std::memory_order_relaxed); });
}

bool in_forked_child() { return forked.load(std::memory_order_relaxed); }

}  // namespace tandem::api
