#pragma once
// TANDEM_ASSERT checks invariants of this code, never received bytes. On in Debug and RelWithDebInfo.

#include <cstdio>
#include <cstdlib>

namespace tandem {

/// Prints the broken condition to stderr and ends the process.
[[noreturn]] inline void assertion_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: broken invariant: %s\n", file, line, condition);
  std::abort();
}

}  // namespace tandem

#ifdef TANDEM_ASSERTIONS
#define TANDEM_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::tandem::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define TANDEM_ASSERT(condition) static_cast<void>(sizeof((condition) ? 1 : 0))
#endif
