#pragma once
// Gives the free memory of a program back to the system. Only for programs: a library must not manage the
// heap of its host.

#include <condition_variable>
#include <mutex>
#include <thread>

namespace tandem {

/// While it lives, the pages that the program does not use any more are given back every 15 s. glibc gives
/// back the top of a heap only: what a crowd of clients left below a block that is still in use would stay
/// for ever. No effect with another C library.
class HeapTrimmer {
 public:
  HeapTrimmer();

 private:
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;  // last: ends first
};

/// Gives back what is free now. Thread-safe; takes milliseconds, in which other threads may have to wait for
/// memory.
void trim_heap();

}  // namespace tandem
