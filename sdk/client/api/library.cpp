// Implements the functions of tandem.h that need no handle.
#include <array>
#include <cstddef>

#include "sdk/client/api/boundary.hpp"
#include "sdk/wire/clock.hpp"

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage): numbers become text
#define TANDEM_TEXT_OF(number) #number
#define TANDEM_TEXT(number) TANDEM_TEXT_OF(number)  // NOLINT(cppcoreguidelines-macro-usage)

const char* tandem_version() noexcept {
  return TANDEM_TEXT(TANDEM_VERSION_MAJOR) "." TANDEM_TEXT(TANDEM_VERSION_MINOR) "." TANDEM_TEXT(
      TANDEM_VERSION_PATCH);
}

uint32_t tandem_version_number() noexcept { return TANDEM_VERSION_NUMBER; }

const char* tandem_result_text(tandem_result result) noexcept {
  constexpr std::array kNames{
      "TANDEM_OK",        "TANDEM_INVALID_ARGUMENT", "TANDEM_MALFORMED",    "TANDEM_UNSUPPORTED",
      "TANDEM_MISMATCH",  "TANDEM_OUT_OF_ORDER",     "TANDEM_CAPACITY",     "TANDEM_TIMEOUT",
      "TANDEM_CONFLICT",  "TANDEM_TRANSPORT",        "TANDEM_IO",           "TANDEM_INVALID_HANDLE",
      "TANDEM_NOT_READY", "TANDEM_IN_CALLBACK",      "TANDEM_WRONG_THREAD", "TANDEM_OUT_OF_MEMORY",
      "TANDEM_INTERNAL"};
  static_assert(TANDEM_OK == 0 && kNames.size() == TANDEM_INTERNAL + 1);
  return result >= 0 && result < static_cast<int>(kNames.size()) ? kNames[static_cast<std::size_t>(result)]
                                                                 : "unknown result";
}

const char* tandem_error_text() noexcept { return tandem::api::refusal_text(); }

int64_t tandem_clock_ns() noexcept { return tandem::transport::steady_ns(); }
