#pragma once
// What guards the little that threads share, and is nothing where there are none.

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
using Lock = std::lock_guard<Mutex>;  ///< holds it for as long as it lives
#endif

}  // namespace tandem::client
