#pragma once
// Decides which streams are computed.

#include <array>
#include <cstdint>
#include <optional>

#include "sdk/wire/units.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/frames/frame_source.hpp"

namespace tandem::host {

/// Decides which streams are computed. A stream is computed while a client plays it or was served its
/// snapshot, and for kLingerNs after that, so that a client that is lost for a moment does not cost a new
/// start. Not thread-safe.
class Audience {
 public:
  static constexpr std::int64_t kLingerNs = 5 * kSecond;

  /// The streams to compute now. Without clients it is only the first.
  [[nodiscard]] StreamSet wanted(Roster& roster, std::int64_t now_ns);

 private:
  std::array<std::optional<std::int64_t>, transport::kMaxStreams> needed_ns_{};  // by stream: when it was
                                                                                 // last needed
};

}  // namespace tandem::host
