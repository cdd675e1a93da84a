#pragma once
// Result<T>: how the SDK and its core report failure. No exceptions cross these interfaces.

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace tandem {

/// Why something failed. Values are stable; new ones are appended.
enum class ErrorCode : std::uint8_t {
  kInvalidArgument = 1,  ///< the caller passed something out of range
  kMalformed = 2,        ///< received bytes do not parse, or break a rule of the format
  kUnsupported = 3,      ///< well-formed, but of a version, codec or section this build does not know
  kMismatch = 4,         ///< applied, but the state hash differs from the sender's
  kOutOfOrder = 5,       ///< a frame, number or epoch that does not follow what is held
  kCapacity = 6,         ///< a declared limit would be exceeded
  kTimeout = 7,          ///< nothing arrived in time
  kConflict = 8,         ///< somebody else owns the name
  kTransport = 9,        ///< the middleware reported an error
  kIo = 10,              ///< a file could not be read or written
  // Only the functions in tandem/tandem.h return the following.
  kInvalidHandle = 11,  ///< closed, or never made
  kNotReady = 12,       ///< not yet: nothing to draw, not playing, not known, or no event
  kInCallback = 13,     ///< called from a callback
  kWrongThread = 14,    ///< another thread does this already
  kOutOfMemory = 15,
  kInternal = 16,  ///< a fault of the library
};

/// A failure: a code to branch on and one line for a human that says what to do.
struct Error {
  ErrorCode code;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

/// Shorthand: `return fail(ErrorCode::kMalformed, "truncated section");`
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace tandem
