#pragma once
// Gives the free memory of a program back to the system. Only programs use this, because a library must not
// manage the heap of its host.

#include <condition_variable>
#include <mutex>
#include <thread>

namespace tandem {

/// While it lives, it gives pages that the program does not use any more back every 15 s. glibc gives back
/// only the top of a heap, so memory below a block that is still in use would stay for ever after a crowd of
/// clients. Has no effect with another C library.
class HeapTrimmer {
 public:
  HeapTrimmer();

 private:
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;  // last member, so that it ends first
};

/// Gives back the memory that is free now. Thread-safe; takes milliseconds, in which other threads may have
/// to wait for memory.
void trim_heap();

}  // namespace tandem
