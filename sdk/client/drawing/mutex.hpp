#pragma once
// A mutex for the little data that threads share. It does nothing in builds without threads.

#if defined(__wasm__) && !defined(__wasm_atomics__)
#define TANDEM_ONE_THREAD
#else
#include <mutex>
#endif

namespace tandem::client {

#ifdef TANDEM_ONE_THREAD
struct Mutex {};
struct Lock {
  explicit Lock(Mutex& /*mutex*/) {}
};
#else
using Mutex = std::mutex;
using Lock = std::lock_guard<Mutex>;  ///< holds the mutex while it lives
#endif

}  // namespace tandem::client
