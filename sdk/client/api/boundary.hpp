#pragma once
// The boundary from C to C++: results and their texts. No exception crosses it.

#include <exception>
#include <new>
#include <utility>

#include "tandem/result.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

inline constexpr tandem_result kOk = TANDEM_OK;

/// Stores the text for tandem_error_text() of this thread and returns the code.
tandem_result refuse(tandem_result code, const char* text) noexcept;
tandem_result refuse(const Error& error) noexcept;
[[nodiscard]] const char* refusal_text() noexcept;

/// Marks that an application's callback runs in this thread while the object lives.
class CallbackScope {
 public:
  CallbackScope();
  ~CallbackScope();
  CallbackScope(const CallbackScope&) = delete;
  CallbackScope& operator=(const CallbackScope&) = delete;
  /// True if a CallbackScope lives in this thread.
  [[nodiscard]] static bool active();
};

/// Runs the body of a function of tandem.h that uses handles. `body` takes no arguments and returns a
/// tandem_result.
template <class Body>
tandem_result call(Body&& body) noexcept {
  if (CallbackScope::active()) {
    return refuse(TANDEM_IN_CALLBACK, "a callback may not call the client's functions");
  }
  try {
    return std::forward<Body>(body)();
  } catch (const std::bad_alloc&) {
    return refuse(TANDEM_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& e) {
    return refuse(TANDEM_INTERNAL, e.what());
  } catch (...) {
    return refuse(TANDEM_INTERNAL, "an unknown exception");
  }
}

/// The result for a forked child that asks for a client or browser.
inline tandem_result forked_child() noexcept {
  return refuse(TANDEM_TRANSPORT,
                "a child of fork() cannot use DDS after its parent has; start a program with exec()");
}

inline tandem_result null_pointer(const char* name) noexcept { return refuse(TANDEM_INVALID_ARGUMENT, name); }

}  // namespace tandem::api
