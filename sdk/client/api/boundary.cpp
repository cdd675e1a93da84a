#include "sdk/client/api/boundary.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "sdk/client/api/registry.hpp"

namespace tandem::api {
namespace {

thread_local std::array<char, 512> last_text{};
thread_local bool in_callback = false;

constexpr tandem_result code_of(ErrorCode code) { return static_cast<tandem_result>(code); }
static_assert(code_of(ErrorCode::kInvalidArgument) == TANDEM_INVALID_ARGUMENT);
static_assert(code_of(ErrorCode::kMalformed) == TANDEM_MALFORMED);
static_assert(code_of(ErrorCode::kUnsupported) == TANDEM_UNSUPPORTED);
static_assert(code_of(ErrorCode::kMismatch) == TANDEM_MISMATCH);
static_assert(code_of(ErrorCode::kOutOfOrder) == TANDEM_OUT_OF_ORDER);
static_assert(code_of(ErrorCode::kCapacity) == TANDEM_CAPACITY);
static_assert(code_of(ErrorCode::kTimeout) == TANDEM_TIMEOUT);
static_assert(code_of(ErrorCode::kConflict) == TANDEM_CONFLICT);
static_assert(code_of(ErrorCode::kTransport) == TANDEM_TRANSPORT);
static_assert(code_of(ErrorCode::kIo) == TANDEM_IO);
static_assert(code_of(ErrorCode::kInvalidHandle) == TANDEM_INVALID_HANDLE);
static_assert(code_of(ErrorCode::kNotReady) == TANDEM_NOT_READY);
static_assert(code_of(ErrorCode::kInCallback) == TANDEM_IN_CALLBACK);
static_assert(code_of(ErrorCode::kWrongThread) == TANDEM_WRONG_THREAD);
static_assert(code_of(ErrorCode::kOutOfMemory) == TANDEM_OUT_OF_MEMORY);
static_assert(code_of(ErrorCode::kInternal) == TANDEM_INTERNAL);

}  // namespace

tandem_result refuse(tandem_result code, const char* text) noexcept {
  const std::size_t length = std::min(std::strlen(text), last_text.size() - 1);
  std::memmove(last_text.data(), text, length);  // `text` may be the last one
  last_text.at(length) = '\0';
  return code;
}

tandem_result refuse(const Error& error) noexcept {
  return refuse(code_of(error.code), error.message.c_str());
}

const char* refusal_text() noexcept { return last_text.data(); }

CallbackScope::CallbackScope() { in_callback = true; }
CallbackScope::~CallbackScope() { in_callback = false; }
bool CallbackScope::active() { return in_callback; }

Handle next_handle() {
  static std::atomic<Handle> last = 0;
  return ++last;
}

}  // namespace tandem::api
