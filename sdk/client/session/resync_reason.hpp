#pragma once
// The reasons why a client rejoins.

#include <cstddef>
#include <cstdint>

namespace tandem::client {

enum class ResyncReason : std::uint8_t {
  kGap = 0,           ///< a frame was missing
  kLostPart = 1,      ///< a new frame began while one was incomplete
  kMissingInput = 2,  ///< a scheduled input did not come in time
  kMismatch = 3,      ///< the state hash differed from the server's
  kRefused = 4,       ///< bytes that broke a rule of the format
  kOverflow = 5,      ///< more deltas waited than the buffer holds
  kLag = 6,           ///< too far behind for too long
};
inline constexpr std::size_t kResyncReasons = 7;
/// A short text for a human.
[[nodiscard]] const char* describe(ResyncReason reason);

}  // namespace tandem::client
