#pragma once
// TANDEM_ASSERT checks invariants of this code, never received bytes. On in Debug and RelWithDebInfo, and in every
// build with the CMake option TANDEM_ASSERTIONS, as in preset ci.

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace tandem {

/// Is told of a broken invariant before the process ends: the condition's text, the source file and the line.
using AssertionHandler = void (*)(const char* condition, const char* file, int line);

/// Of the whole process; null: the text goes to stderr.
inline std::atomic<AssertionHandler> assertion_handler{nullptr};

/// Tells the handler, or stderr, and ends the process.
[[noreturn, gnu::cold, gnu::noinline]] inline void assertion_failed(const char* condition, const char* file, int line) {
  if (const AssertionHandler handler = assertion_handler.load(); handler != nullptr) {
    handler(condition, file, line);
  } else {
    std::fprintf(stderr, "%s:%d: broken invariant: %s\n", file, line, condition);
  }
  std::abort();
}

}  // namespace tandem

#ifdef TANDEM_ASSERTIONS
#define TANDEM_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::tandem::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define TANDEM_ASSERT(condition) static_cast<void>(sizeof((condition) ? 1 : 0))
#endif
