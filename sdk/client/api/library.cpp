// Implements the functions of tandem.h that need no handle.
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
  switch (result) {
    case TANDEM_OK:
      return "TANDEM_OK";
    case TANDEM_INVALID_ARGUMENT:
      return "TANDEM_INVALID_ARGUMENT";
    case TANDEM_MALFORMED:
      return "TANDEM_MALFORMED";
    case TANDEM_UNSUPPORTED:
      return "TANDEM_UNSUPPORTED";
    case TANDEM_MISMATCH:
      return "TANDEM_MISMATCH";
    case TANDEM_OUT_OF_ORDER:
      return "TANDEM_OUT_OF_ORDER";
    case TANDEM_CAPACITY:
      return "TANDEM_CAPACITY";
    case TANDEM_TIMEOUT:
      return "TANDEM_TIMEOUT";
    case TANDEM_CONFLICT:
      return "TANDEM_CONFLICT";
    case TANDEM_TRANSPORT:
      return "TANDEM_TRANSPORT";
    case TANDEM_IO:
      return "TANDEM_IO";
    case TANDEM_INVALID_HANDLE:
      return "TANDEM_INVALID_HANDLE";
    case TANDEM_NOT_READY:
      return "TANDEM_NOT_READY";
    case TANDEM_IN_CALLBACK:
      return "TANDEM_IN_CALLBACK";
    case TANDEM_WRONG_THREAD:
      return "TANDEM_WRONG_THREAD";
    case TANDEM_OUT_OF_MEMORY:
      return "TANDEM_OUT_OF_MEMORY";
    case TANDEM_INTERNAL:
      return "TANDEM_INTERNAL";
    default:
      return "unknown result";
  }
}

const char* tandem_error_text() noexcept { return tandem::api::refusal_text(); }

int64_t tandem_clock_ns() noexcept { return tandem::transport::steady_ns(); }
